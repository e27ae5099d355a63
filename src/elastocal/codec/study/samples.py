"""One sample of a study: a simulated arm, calibrated under every condition.

Here is the estimator's part: fit, then predict where it has not measured.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.identification import build, solve
from elastocal.records import record
from elastocal.results import brief_repr


class Purpose(IntEnum):
    """A purpose that a sample draws for; each has a generator of its own."""

    TRUTH = 0
    """The true arm."""
    ERRORS = 1
    """Errors of the instruments."""
    CHOICE = 2
    """Techniques that choose by chance."""


@dataclass(frozen=True)
class Sample:
    """One of the arms to be simulated."""

    seed: int
    """Seed of the study."""
    number: int
    """Number of the sample, from 0."""

    def generator(self, purpose: Purpose) -> Generator:
        """Return the generator of a purpose.

        It depends on nothing but seed, number and purpose: any order, any number of processes
        and any cluster draw the same.
        """
        key = (self.number, int(purpose))
        return np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=key))


@brief_repr
@record(eq=False)
class ConditionResult:
    """A calibration under one condition, and how accurate it is at poses that it has not seen.

    Errors are in m, over the verification poses and all load cases of the cell.
    """

    error_mean: float
    """Mean norm of predicted minus true deflection."""
    error_max: float
    """Largest norm."""
    deflection_mean: float
    """Mean norm of the true deflection: the error without any calibration."""
    compliance: FloatArray
    """Shape (spring,), in rad/(N·m) or m/N."""


@brief_repr
@record(eq=False)
class SampleResult:
    """A finished sample."""

    number: int
    outcomes: tuple[ConditionResult, ...]
    """In the order of the conditions."""


Simulate = Callable[[Sample], SampleResult]
"""Simulates one sample. It is sent to other processes, so it can be pickled, and it is a pure
function: the same sample gives the same result bit for bit."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Verification:
    """True deflections without any noise, at poses that no calibration has seen."""

    q: FloatArray
    """Joints under load, shape (reading, joint), in rad or m."""
    force: FloatArray
    """True force on the robot in base, shape (reading, 3), in N."""
    deflection: FloatArray
    """True deflection of the tool in base, shape (reading, 3), in m."""

    def judge(self, model: ElasticModel, compliance: FloatArray) -> ConditionResult:
        """Return how well a calibrated model predicts the deflections."""
        predicted = model.deflection(compliance, self.q, self.force)
        error = np.linalg.norm(predicted - self.deflection, axis=1)
        size = np.linalg.norm(self.deflection, axis=1)
        return ConditionResult(
            float(error.mean()), float(error.max()), float(size.mean()), compliance
        )


def calibrated(
    model: ElasticModel, readings: Readings, marker_offset: ArrayLike, verification: Verification
) -> ConditionResult:
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
    return verification.judge(model, compliance)
