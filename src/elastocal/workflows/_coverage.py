"""Whether a calibration determined all that a prediction may need."""

from elastocal.identification import CalibratedModel, attainable_rank

_NOT_COVERED = (
    "the calibration saw fewer combinations of springs than a force can load: predictions away from"
    " its poses are not covered by the intervals"
)


def coverage_notes(calibrated: CalibratedModel) -> tuple[str, ...]:
    """Return a warning unless every combination that forces can load was determined."""
    covered = calibrated.observability.rank >= attainable_rank(calibrated.model)
    return () if covered else (_NOT_COVERED,)
