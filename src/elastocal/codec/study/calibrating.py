"""The estimator's part of a sample: fit, then predict where it has not measured."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.codec.study.samples import Accuracy, Outcome
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.identification import build, solve


@dataclass(frozen=True, eq=False)
class Verification:
    """True deflections without any noise, at poses that no calibration has seen."""

    q: FloatArray
    """Joints under load, shape (reading, joint), in rad or m."""
    force: FloatArray
    """True force on the robot in base, shape (reading, 3), in N."""
    deflection: FloatArray
    """Of the tool in base, shape (reading, 3), in m."""

    def accuracy(self, model: ElasticModel, compliance: FloatArray) -> Accuracy:
        """Return how well a calibrated model predicts the deflections."""
        predicted = model.deflection(compliance, self.q, self.force)
        error = np.linalg.norm(predicted - self.deflection, axis=1)
        size = np.linalg.norm(self.deflection, axis=1)
        return Accuracy(float(error.mean()), float(error.max()), float(size.mean()))


def calibrated(
    model: ElasticModel,
    readings: Readings,
    marker_offset: ArrayLike,
    verification: Verification,
) -> Outcome:
    """Return compliances and accuracy of a calibration with the default options (Eq. 15-19).

    Simulated instruments make no blunders, so none are looked for; otherwise the compliances are
    those of `elastocal.identification.calibrate`. Nothing is resampled: the samples of a study
    show the spread.

    Parameters
    ----------
    model : ElasticModel
        Robot and springs.
    readings : Readings
        Of the calibration poses.
    marker_offset : array_like, shape (3,)
        Metrology marker in the tcp frame, in m.
    verification : Verification
        Where the result is judged.

    Raises
    ------
    IdentificationError
        If nothing can be identified.
    """
    compliance = solve(build(model, readings, None, marker_offset)).compliance
    return Outcome(verification.accuracy(model, compliance), compliance)
