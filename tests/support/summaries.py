"""Figures of a calibration that was never made, for files that only need to hold some."""

from elastocal.identification import CalibrationSummary, DeflectionSummary
from elastocal.identification.figures import HeldOutSummary, ResidualSummary


def made_up_summary(deflection: float = 1e-3) -> CalibrationSummary:
    """Return figures with this mean measured deflection in m, everything else plain."""
    return CalibrationSummary(
        robot="made up",
        springs=(),
        rank=0,
        rank_attainable=0,
        springs_total=0,
        condition=1.0,
        unobservable=(),
        residual=ResidualSummary(1e-5, 2e-5, 2e-5, (1e-5, 1e-5, 1e-5)),
        deflection=DeflectionSummary(deflection, 2.0 * deflection),
        readings=1,
        poses=1,
        suspicious=(),
        held_out=HeldOutSummary(1e-5, 2e-5, 1, 1),
        comparison=None,
        draws=40,
        interval_widening=1.0,
        warnings=(),
    )
