"""How sure a figure over verification sets is, when the sets share poses.

The sets are all drawn from the same N poses, so that their spread, taken for that of independent
ones, is too small. C. Nadeau and Y. Bengio ("Inference for the generalization error", Machine
Learning 52, 2003, section 3) correct the variance of a mean over J splits from ``S^2 / J`` to
``(1 / J + n_2 / n_1) S^2``, with ``n_1`` training and ``n_2`` verification items; items are poses
here. What this covers in simulation, and what it does not: docs/decisions/0030-codec.md.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.stats import norm, t

from elastocal.arrays import FloatArray
from elastocal.identification.bootstrap import CONFIDENCE

DRAWS = 1000
"""Bootstrap draws."""
_TAIL = 0.5 * (1.0 + CONFIDENCE)


@dataclass(frozen=True, eq=False)
class MeanOverSets:
    """A mean over verification sets with its 95 % interval; the ends are NaN for one set."""

    mean: FloatArray
    """Shape (n,)."""
    low: FloatArray
    high: FloatArray


def corrected_mean(values: FloatArray, shared: float) -> MeanOverSets:
    """Return the mean over verification sets by the corrected resampled t.

    Parameters
    ----------
    values : ndarray, shape (cv, n)
        A figure of each verification set, for each number of training poses.
    shared : float
        Verification poses over training poses of a split, ``N_v / N_c``.
    """
    sets, mean = len(values), values.mean(axis=0)
    if sets < 2:
        unknown = np.full_like(mean, np.nan)
        return MeanOverSets(mean, unknown, unknown)
    variance = (1.0 / sets + shared) * values.var(axis=0, ddof=1)
    half = float(t.ppf(_TAIL, sets - 1)) * np.sqrt(variance)
    return MeanOverSets(mean, mean - half, mean + half)


def median_draws(values: FloatArray, shared: float, rng: Generator) -> FloatArray:
    """Return bootstrap draws of the median over verification sets, shape (draw, n).

    Whole sets are drawn, so that all sizes of one set stay together; the draws are stretched
    about the median to the variance of `corrected_mean` and to Student's quantile. There are
    none for a single set, which shows no spread.

    Parameters
    ----------
    values : ndarray, shape (cv, n)
        A figure of each verification set, for each number of training poses.
    shared : float
        Verification poses over training poses of a split, ``N_v / N_c``.
    rng : Generator
        Source of randomness.
    """
    sets, estimate = len(values), np.median(values, axis=0)
    if sets < 2:
        return np.empty((0, len(estimate)))
    chosen = rng.integers(sets, size=(DRAWS, sets))
    drawn = np.array([np.median(values[draw], axis=0) for draw in chosen])
    student = float(t.ppf(_TAIL, sets - 1) / norm.ppf(_TAIL))
    # Draws spread as the population of the sets does, 1 - 1 / J of the variance in the formula.
    corrected = (1.0 + sets * shared) * sets / (sets - 1.0)
    return np.asarray(estimate + student * np.sqrt(corrected) * (drawn - estimate))
