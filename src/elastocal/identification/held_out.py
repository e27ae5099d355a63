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
    return HeldOut(np.linalg.norm(predicted - problem.d, axis=1), fold, compliance)


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
