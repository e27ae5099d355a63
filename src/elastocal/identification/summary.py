"""The figures of a calibration: what ``calibrate --json`` prints and the model file keeps.

Printed, stored and turned into tables, they are one record, so that no two places can disagree.
All numbers are SI.
"""

import numpy as np

from elastocal.arrays import BoolArray
from elastocal.dataset import Readings
from elastocal.identification.calibration import Calibration
from elastocal.identification.observability import Term
from elastocal.identification.options import FitSettings
from elastocal.identification.suspicious import Screening
from elastocal.identification.uncertainty import HeldOut
from elastocal.records import record
from elastocal.results import brief_repr


@record()
class SpringSummary:
    """One spring: its compliance, how well it is known, and whether it is known by itself."""

    name: str
    kind: str
    unit: str
    """SI unit of the compliance."""
    compliance: float
    low: float
    """Lower end of the 95 % interval."""
    high: float
    """Upper end of the 95 % interval."""
    observable: bool
    """Whether the data determine it by itself."""


@brief_repr
@record()
class ResidualSummary:
    """Residual norms of the readings that entered the fit, in m."""

    mean: float
    max: float
    p95: float
    rms_axis: tuple[float, ...]
    """Root mean square along each axis of base."""


@record()
class DeflectionSummary:
    """Measured deflection norms of the readings that entered the fit, in m."""

    mean: float
    max: float


@record()
class HeldOutSummary:
    """Errors at left-out poses, in m."""

    mean: float
    max: float
    readings: int
    folds: int
    """Number of refits."""
    misfit: float | None = None
    """See `HeldOut.misfit`; none where there are too few errors for it."""
    split: str = "leave-poses-out"


@record()
class DifferenceSummary:
    """Mean error of another layout minus ours, with its 95 % interval, in m."""

    mean: float
    low: float
    high: float


@record()
class ComparisonSummary:
    """Another spring layout on the same left-out poses."""

    springs: str
    """Name of the other layout."""
    held_out: HeldOutSummary
    difference: DifferenceSummary


@record()
class SuspiciousReading:
    """A reading that looks wrong to a robust fit."""

    pose: int
    load_case: str
    score: float
    """Leverage-corrected residual in robust standard deviations."""
    residual: float
    """Residual norm of the robust fit, in m."""
    leverage: float
    set_aside: bool
    """Whether it was left out of the fit as a blunder."""


@brief_repr
@record("elastocal.calibration/1")
class CalibrationSummary:
    """The figures of a calibration (spec section 4)."""

    robot: str
    springs: tuple[SpringSummary, ...]
    rank: int
    rank_attainable: int
    """Rank that any number of poses and forces would reach."""
    springs_total: int
    condition: float
    unobservable: tuple[tuple[Term, ...], ...]
    residual: ResidualSummary
    deflection: DeflectionSummary
    readings: int
    poses: int
    suspicious: tuple[SuspiciousReading, ...]
    """The worst first."""
    held_out: HeldOutSummary
    comparison: ComparisonSummary | None
    draws: int
    interval_widening: float
    warnings: tuple[str, ...]
    settings: FitSettings | None = None
    """With these a report makes the calibration again."""


def summary(calibration: Calibration, settings: FitSettings | None = None) -> CalibrationSummary:
    """Return the figures of a calibration that was made with these settings."""
    calibrated = calibration.calibrated
    seen = calibrated.observability
    residual, deflection = calibration.residual_norm, calibration.deflection_norm
    rms = np.sqrt(np.mean(np.square(calibration.residual[calibration.used]), axis=0))
    return CalibrationSummary(
        robot=calibrated.model.robot.name,
        springs=_springs(calibration),
        rank=seen.rank,
        rank_attainable=calibration.attainable_rank,
        springs_total=seen.springs,
        condition=seen.condition,
        unobservable=seen.unobservable,
        residual=ResidualSummary(
            mean=float(residual.mean()),
            max=float(residual.max()),
            p95=float(np.percentile(residual, 95)),
            rms_axis=tuple(map(float, rms)),
        ),
        deflection=DeflectionSummary(float(deflection.mean()), float(deflection.max())),
        readings=len(residual),
        poses=calibration.poses,
        suspicious=_suspicious(calibration.readings, calibration.screening, calibration.used),
        held_out=_held_out(calibration.held_out),
        comparison=_comparison(calibration),
        draws=len(calibrated.draws),
        interval_widening=calibration.widening,
        warnings=calibration.warnings,
        settings=settings,
    )


def _springs(calibration: Calibration) -> tuple[SpringSummary, ...]:
    calibrated = calibration.calibrated
    low, high = calibrated.interval()
    named = ((spring, each) for spring in calibrated.model.springs for each in spring.parameters)
    return tuple(
        SpringSummary(
            name=parameter.name,
            kind=spring.kind,
            unit=parameter.unit.si,
            compliance=float(calibrated.compliance[i]),
            low=float(low[i]),
            high=float(high[i]),
            observable=calibrated.observability.observable[i],
        )
        for i, (spring, parameter) in enumerate(named)
    )


def _suspicious(
    readings: Readings, screening: Screening, used: BoolArray
) -> tuple[SuspiciousReading, ...]:
    order = np.argsort(-screening.score, kind="stable")
    return tuple(
        SuspiciousReading(
            pose=int(readings.pose[i]),
            load_case=str(readings.load_case[i]),
            score=float(screening.score[i]),
            residual=float(screening.residual[i]),
            leverage=float(screening.leverage[i]),
            set_aside=not bool(used[i]),
        )
        for i in order
        if screening.suspicious[i]
    )


def _held_out(held_out: HeldOut) -> HeldOutSummary:
    return HeldOutSummary(
        mean=held_out.mean,
        max=held_out.max,
        readings=len(held_out.error),
        folds=held_out.folds,
        misfit=held_out.misfit if np.isfinite(held_out.misfit) else None,
    )


def _comparison(calibration: Calibration) -> ComparisonSummary | None:
    other = calibration.comparison
    if other is None:
        return None
    return ComparisonSummary(
        springs=other.layout,
        held_out=_held_out(other.held_out),
        difference=DifferenceSummary(other.difference, other.low, other.high),
    )
