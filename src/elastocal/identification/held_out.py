"""Accuracy at poses that the fit has not seen.

The type that carries an accuracy knows its split: it cannot be made from training residuals.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from elastocal.arrays import FloatArray, IndexArray
from elastocal.identification.bootstrap import interval
from elastocal.identification.grams import PoseGrams
from elastocal.identification.problem import Problem

MOST_FOLDS = 100
"""With more pose blocks than this, several are left out together."""


@dataclass(frozen=True)
class HeldOut:
    """Prediction errors at left-out poses."""

    error: FloatArray
    """Norm of the prediction error of each reading, shape (reading,), in m."""
    fold: IndexArray
    """Which refit predicted each reading, shape (reading,)."""
    compliance: FloatArray
    """Compliances of each refit, shape (fold, spring)."""
    share: FloatArray
    """Size of the error along each axis as a share of the predicted deflection's norm, shape
    (reading, 3); infinite where no deflection was predicted."""

    @property
    def misfit(self) -> float:
        """Share of the predicted deflection that 95 % of the errors along an axis stay below.

        It holds what no springs of the layout can express, and measurement noise with it. The
        quantile is the one of split-conformal prediction, which counts the next error too (V.
        Vovk, A. Gammerman and G. Shafer, "Algorithmic Learning in a Random World", 2005). NaN
        where there are too few errors for it, or too many without a deflection.
        """
        sizes = np.sort(self.share, axis=None)
        rank = int(np.ceil(0.95 * (len(sizes) + 1)))
        if rank > len(sizes) or not np.isfinite(sizes[rank - 1]):
            return float("nan")
        return float(sizes[rank - 1])

    @property
    def mean(self) -> float:
        """Mean error norm in m."""
        return float(self.error.mean())

    @property
    def max(self) -> float:
        """Largest error norm in m."""
        return float(self.error.max())

    @property
    def folds(self) -> int:
        """Number of refits."""
        return len(self.compliance)


@dataclass(frozen=True)
class Comparison:
    """Two spring layouts on the same left-out poses."""

    layout: str
    """Name of the other layout."""
    held_out: HeldOut
    """Its errors."""
    difference: float
    """Mean error of the other minus mean error of ours, in m; positive: ours is better."""
    low: float
    """Lower end of the difference's 95 % interval (poses resampled in pairs), in m."""
    high: float
    """Upper end, in m."""


def leave_poses_out(problem: Problem) -> HeldOut:
    """Refit without each pose block in turn and predict its readings.

    With more than `MOST_FOLDS` blocks, blocks are left out together in as many folds.
    """
    blocks, index = np.unique(problem.block, return_inverse=True)
    folds = min(len(blocks), MOST_FOLDS)
    fold_of_block = np.arange(len(blocks)) % folds
    kept = fold_of_block[None, :] != np.arange(folds)[:, None]
    compliance = PoseGrams.of(problem).refit(kept.astype(float))
    fold = fold_of_block[index]
    predicted = np.einsum("rin,rn->ri", problem.O, compliance[fold])
    error, norm = predicted - problem.d, np.linalg.norm(predicted, axis=1, keepdims=True)
    share = np.divide(np.abs(error), norm, out=np.full_like(error, np.inf), where=norm > 0.0)
    return HeldOut(np.linalg.norm(error, axis=1), fold, compliance, share)


def compare(
    ours: HeldOut, other: HeldOut, layout: str, problem: Problem, rng: Generator
) -> Comparison:
    """Return the paired difference of two layouts with an interval.

    Whole pose blocks are resampled, with both errors of a reading kept together.
    """
    blocks, index = np.unique(problem.block, return_inverse=True)
    counts = np.bincount(index)
    sums = np.bincount(index, other.error - ours.error)
    chosen = rng.integers(len(blocks), size=(1000, len(blocks)))
    low, high = interval(sums[chosen].sum(axis=1) / counts[chosen].sum(axis=1))
    return Comparison(layout, other, other.mean - ours.mean, float(low), float(high))
