"""Whether a calibration saw all that a prediction may need."""

from elastocal.identification import CalibratedModel, attainable_rank

NOT_COVERED = (
    "the calibration saw fewer combinations of springs than a force can load: predictions away from"
    " its poses are not covered by the intervals"
)


def covered(calibrated: CalibratedModel) -> bool:
    """Return whether the calibration determined every combination that forces can load."""
    return calibrated.observability.rank >= attainable_rank(calibrated.model)
