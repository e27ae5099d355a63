"""One sample of a study: a simulated arm, calibrated under every condition."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.random import Generator

from elastocal.arrays import FloatArray


class Purpose(IntEnum):
    """What a sample draws for; each has a generator of its own."""

    TRUTH = 0
    """The true arm."""
    ERRORS = 1
    """Errors of the instruments."""
    CHOICE = 2
    """Techniques that choose by chance."""


@dataclass(frozen=True)
class Sample:
    """What is to be simulated: which of the arms."""

    seed: int
    """Of the study."""
    number: int
    """Of the sample, from 0."""

    def generator(self, purpose: Purpose) -> Generator:
        """Return the generator of a purpose.

        It depends on nothing but seed, number and purpose: any order, any number of processes
        and any cluster draw the same.
        """
        key = (self.number, int(purpose))
        return np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=key))


@dataclass(frozen=True)
class Accuracy:
    """What a calibration under one condition reaches at poses that it has not seen.

    All in m, over the verification poses and all load cases of the cell.
    """

    error_mean: float
    """Mean norm of predicted minus true deflection."""
    error_max: float
    """Largest norm."""
    deflection_mean: float
    """Mean norm of the true deflection: the error without any calibration."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """A calibration under one condition."""

    accuracy: Accuracy
    compliance: FloatArray
    """Shape (spring,), in rad/(N·m) or m/N."""


@dataclass(frozen=True, eq=False)
class SampleResult:
    """A finished sample."""

    number: int
    outcomes: tuple[Outcome, ...]
    """In the order of the conditions."""


Simulate = Callable[[Sample], SampleResult]
"""Simulates one sample. It is sent to other processes, so it can be pickled, and it is a pure
function: the same sample gives the same result bit for bit."""
