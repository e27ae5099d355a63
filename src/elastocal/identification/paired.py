"""Pairwise comparison of models by held-out errors, shared by `calibrate` and `codec`.

Sets of held-out poses are all drawn from the same N poses, and the refits share nearly all the
others, so that a standard error that treats them as independent is too small. C. Nadeau and Y.
Bengio ("Inference for the generalization error", Machine Learning 52, 2003, section 3) give the
mean over J sets whose figures are correlated by ``rho`` the variance ``(1 / J + rho / (1 - rho))
S^2``, and take for ``rho`` the expected overlap of two sets: ``n_2 / (n_1 + n_2)`` for random ones.
COVER sets overlap more, so their overlap is counted. Few sets, and those of a leave-one-out,
overlap less or not at all, but their training sets are then nearly the same poses; so ``rho`` is
never taken below that of random sets. The rate of false differences is in
docs/decisions/0069-one-judgement.md.

Models that are not worse than the best by more than one standard error of their paired difference
are near it (L. Breiman, J. Friedman, R. Olshen, C. Stone, *Classification and Regression Trees*,
1984, section 3.4.3, who take the simplest of them). For springs the best itself is chosen, for
geometry the simplest near it; docs/decisions/0066-ladder.md gives the reasons.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.identification.uncertainty import CONFIDENCE
from elastocal.results import brief_repr

_TAIL = 0.5 * (1.0 + CONFIDENCE)
_ALL = 1.0 - 1e-9
_EQUAL = 1e-3
"""Share of an error by which it must be lower to count as lower."""
_ROUND_OFF = 1e-9
"""Part of an error below which a difference is round-off: models that say the same."""


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

    @classmethod
    def leaving_one_out(cls, poses: int) -> "Overlap":
        """Return the overlap of sets of one pose each, every pose once."""
        return cls(poses, 0.0, 1.0 / poses)

    @property
    def rho(self) -> float:
        """Correlation that is taken between the figures of two sets."""
        return max(self.shared, self.part)

    @property
    def known(self) -> bool:
        """Whether the sets show any spread: several sets, not all equal."""
        return self.sets > 1 and self.shared < _ALL

    @property
    def variance(self) -> float:
        """Variance of a mean over the sets, in units of the sample variance."""
        return 1.0 / self.sets + self.rho / (1.0 - self.rho)

    @property
    def student(self) -> float:
        """Quantile of Student's distribution for the 95 % interval."""
        return float(stdtrit(self.sets - 1, _TAIL))


@brief_repr
@dataclass(frozen=True, eq=False)
class MeanOverSets:
    """A mean over verification sets with its 95 % interval; NaN ends: no spread is known."""

    mean: FloatArray
    """Shape (n,)."""
    low: FloatArray
    high: FloatArray
    standard_error: FloatArray


def corrected_mean(values: FloatArray, overlap: Overlap) -> MeanOverSets:
    """Return the mean over verification sets by the corrected resampled t.

    Parameters
    ----------
    values : ndarray, shape (cv, n)
        A figure of each verification set, for each number of training poses.
    overlap : Overlap
        Overlap of the sets.
    """
    mean = values.mean(axis=0)
    if not overlap.known:
        unknown = np.full_like(mean, np.nan)
        return MeanOverSets(mean, unknown, unknown, unknown)
    error = np.sqrt(overlap.variance * values.var(axis=0, ddof=1))
    half = overlap.student * error
    return MeanOverSets(mean, mean - half, mean + half, error)


def paired_difference(errors_a: FloatArray, errors_b: FloatArray, overlap: Overlap) -> MeanOverSets:
    """Return the mean difference of two errors on the same held-out sets.

    Parameters
    ----------
    errors_a, errors_b : ndarray, shape (set, n)
        Mean error of each held-out set, in m.
    overlap : Overlap
        Overlap of the sets.
    """
    difference = errors_a - errors_b
    round_off = np.abs(difference) <= _ROUND_OFF * np.maximum(errors_a, errors_b)
    return corrected_mean(np.where(round_off, 0.0, difference), overlap)


@brief_repr
@dataclass(frozen=True, eq=False)
class Judgement:
    """Models from simple to rich, judged by their errors on the same held-out sets."""

    difference: MeanOverSets
    """Error of each model minus that of the best allowed one, arrays of shape (model,), in m."""
    best: int
    """Number of the allowed model with the lowest mean error; of equal ones, which differ by less
    than a thousandth, the simplest."""
    near: IndexArray
    """Numbers of the allowed models that are not worse by more than one standard error."""


def judge_models(errors: FloatArray, allowed: BoolArray, overlap: Overlap) -> Judgement:
    """Return which models predict best, and which nearly as well.

    Parameters
    ----------
    errors : ndarray, shape (set, model)
        Mean error of each held-out set, in m, the simplest model first.
    allowed : ndarray of bool, shape (model,)
        Which may be taken, at least one; the others are judged beside them.
    overlap : Overlap
        Overlap of the sets.
    """
    mean = np.where(allowed, errors.mean(axis=0), np.inf)
    # Where nothing is gained, a richer model only shares what the readings say among more springs,
    # so that the numbers of each are those of its prior.
    best = int(np.argmax(mean <= (1.0 + _EQUAL) * mean.min()))
    difference = paired_difference(errors, errors[:, [best]], overlap)
    within = difference.mean <= np.nan_to_num(difference.standard_error)
    near = np.flatnonzero(allowed & within)
    return Judgement(difference, best, near)
