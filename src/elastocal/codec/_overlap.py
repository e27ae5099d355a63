"""Intervals of figures over verification sets that share poses.

The sets are all drawn from the same N poses, so that their spread, taken for that of independent
ones, is too small. C. Nadeau and Y. Bengio ("Inference for the generalization error", Machine
Learning 52, 2003, section 3) give the mean over J sets whose figures are correlated by ``rho`` the
variance ``(1 / J + rho / (1 - rho)) S^2``, and take for ``rho`` what two sets are expected to
share: ``n_2 / (n_1 + n_2)`` for random ones. COVER sets share more, so what they share is counted.
Few sets may share less, even nothing, but their training sets are then nearly the same poses;
so ``rho`` is never taken below that of random sets.
What this covers in simulation: docs/decisions/0030-codec.md.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.special import ndtri, stdtrit

from elastocal.arrays import FloatArray, IndexArray
from elastocal.identification import CONFIDENCE

_DRAWS = 1000
"""Bootstrap draws."""
_TAIL = 0.5 * (1.0 + CONFIDENCE)
_SMALLEST = np.finfo(float).tiny
_ALL = 1.0 - 1e-9


@dataclass(frozen=True)
class Overlap:
    """The poses that verification sets share: how far they are from independent."""

    sets: int
    """Number of sets, J."""
    shared: float
    """Part of its poses that a set shares with another one, mean over all pairs."""
    part: float = 0.0
    """Part of all poses that is in a set, ``N_v / N``: what random sets share."""

    @classmethod
    def of(cls, verification: IndexArray, poses: int) -> "Overlap":
        """Return the overlap of verification sets.

        Parameters
        ----------
        verification : ndarray of int, shape (cv, N_v)
            Pose numbers.
        poses : int
            Number of all poses.
        """
        sets, size = verification.shape
        if sets < 2:
            return cls(sets, 1.0, size / poses)
        member = np.zeros((sets, int(verification.max()) + 1))
        np.put_along_axis(member, verification, 1.0, axis=1)
        shared = (member @ member.T).sum() / size - sets
        return cls(sets, float(shared / (sets * (sets - 1))), size / poses)

    @property
    def rho(self) -> float:
        """Correlation that is taken between the figures of two sets."""
        return max(self.shared, self.part)

    @property
    def known(self) -> bool:
        """Whether the sets show any spread: several, and not all the same."""
        return self.sets > 1 and self.shared < _ALL

    @property
    def variance(self) -> float:
        """Variance of a mean over the sets, in units of the sample variance."""
        return 1.0 / self.sets + self.rho / (1.0 - self.rho)

    @property
    def student(self) -> float:
        """Quantile of Student's distribution for the 95 % interval."""
        return float(stdtrit(self.sets - 1, _TAIL))


@dataclass(frozen=True, eq=False)
class MeanOverSets:
    """A mean over verification sets with its 95 % interval; NaN ends: no spread is known."""

    mean: FloatArray
    """Shape (n,)."""
    low: FloatArray
    high: FloatArray


def corrected_mean(values: FloatArray, overlap: Overlap) -> MeanOverSets:
    """Return the mean over verification sets by the corrected resampled t.

    Parameters
    ----------
    values : ndarray, shape (cv, n)
        A figure of each verification set, for each number of training poses.
    overlap : Overlap
        Of the sets.
    """
    mean = values.mean(axis=0)
    if not overlap.known:
        unknown = np.full_like(mean, np.nan)
        return MeanOverSets(mean, unknown, unknown)
    half = overlap.student * np.sqrt(overlap.variance * values.var(axis=0, ddof=1))
    return MeanOverSets(mean, mean - half, mean + half)


def median_draws(values: FloatArray, overlap: Overlap, rng: Generator) -> FloatArray:
    """Return bootstrap draws of the median over verification sets, shape (draw, n).

    Whole sets are drawn, so that all sizes of one set stay together. The draws are stretched
    about the median to the variance and the quantile of `corrected_mean`, in logarithms, which
    keeps errors positive. There are none where no spread is known.

    Parameters
    ----------
    values : ndarray, shape (cv, n)
        A figure above 0 of each verification set, for each number of training poses.
    overlap : Overlap
        Of the sets.
    rng : Generator
        Source of randomness.
    """
    sets, estimate = len(values), _log_median(values)
    if not overlap.known:
        return np.empty((0, len(estimate)))
    chosen = rng.integers(sets, size=(_DRAWS, sets))
    drawn = np.array([_log_median(values[draw]) for draw in chosen])
    # Draws spread as the population of the sets does, (1 - 1 / J) / J of the sample variance.
    by = np.sqrt(overlap.variance * sets * sets / (sets - 1.0))
    by *= overlap.student / float(ndtri(_TAIL))
    return np.asarray(np.exp(estimate + by * (drawn - estimate)))


def _log_median(values: FloatArray) -> FloatArray:
    return np.asarray(np.log(np.maximum(np.median(values, axis=0), _SMALLEST)))


def micrometres(length: float) -> str:
    """Return a length in m as sentences state it, in µm."""
    return f"{1e6 * length:.1f} µm"


def known(value: float) -> float | None:
    """Return a figure as files hold it: None where it is NaN."""
    return None if np.isnan(value) else float(value)
