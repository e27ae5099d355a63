"""The error at a load level that no fit has seen, beside the noise of such a reading.

A model fitted at full load and at a low one is tested at a load between them. The poses are those
of the fit: what the check shows is how well the law of the springs holds between loads, not how
well it holds between poses (`elastocal.identification.uncertainty` shows that).
"""

import numpy as np
from numpy.typing import ArrayLike

from elastocal.dataset import Readings
from elastocal.identification.budget import stated_noise
from elastocal.identification.calibration import Calibration
from elastocal.identification.displacement import displacement_blocks
from elastocal.records import record
from elastocal.results import brief_repr


@brief_repr
@record()
class LoadCheck:
    """Errors of the fitted model at load cases that are kept out of every fit, in m."""

    load_cases: tuple[str, ...]
    readings: int
    mean: float
    p95: float
    max: float
    rms: float
    """Root mean square of the error norms."""
    deflection: float
    """Mean norm of the measured deflections."""
    noise: float | None
    """Root mean square of the norms of the noise in them; none where it is not known."""
    source: str
    """Origin of the noise, or the reason why it is unknown."""


def check_loads(
    calibration: Calibration, readings: Readings, marker_offset: ArrayLike | None = None
) -> LoadCheck | None:
    """Return the errors at readings that are kept out of every fit; None where there are none.

    There is no check with free frames either: the frame of a session is that of its own readings.
    Nor is there one where the tooling holds the tool, whose contact is a part of what is shown.

    Parameters
    ----------
    calibration : Calibration
        Calibration from the other readings; poses that it has not seen are left out.
    readings : Readings
        From ``Dataset.readings(..., check=True)``.
    marker_offset : array_like, shape (3,), optional
        Metrology marker in the tcp frame, in m.
    """
    readings = readings.take(np.isin(readings.pose, calibration.readings.pose))
    if not len(readings) or calibration.frames or readings.contacts is not None:
        return None
    model, compliance = calibration.calibrated.model, calibration.calibrated.compliance
    shown = displacement_blocks(model, readings, marker_offset) @ compliance
    error = np.linalg.norm(shown - readings.deflection, axis=1)
    noise = stated_noise(model, readings, compliance)
    return LoadCheck(
        load_cases=tuple(dict.fromkeys(readings.load_case.tolist())),
        readings=len(readings),
        mean=float(error.mean()),
        p95=float(np.percentile(error, 95)),
        max=float(error.max()),
        rms=float(np.sqrt(np.mean(np.square(error)))),
        deflection=float(np.linalg.norm(readings.deflection, axis=1).mean()),
        noise=noise.error,
        source=noise.source,
    )
