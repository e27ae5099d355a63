"""Pose-block bootstrap: how much the fit depends on the poses that happened to be measured.

Whole poses are drawn with replacement (Efron and Tibshirani, *An Introduction to the Bootstrap*,
1993, section 8.6), since the readings at one pose share what the model gets wrong there. The
draws are kept, so that every prediction anywhere gets an interval.
"""

import numpy as np
from numpy.random import Generator

from elastocal.arrays import FloatArray
from elastocal.identification.grams import PoseGrams

CONFIDENCE = 0.95


def bootstrap(grams: PoseGrams, draws: int, rng: Generator) -> FloatArray:
    """Return the compliances refitted to resampled poses.

    Parameters
    ----------
    grams : PoseGrams
        Of the problem that was solved.
    draws : int
        Number of resamples.
    rng : Generator
        Source of randomness.

    Returns
    -------
    ndarray, shape (draw, spring)
    """
    blocks = len(grams.gram)
    chosen = rng.integers(blocks, size=(draws, blocks))
    multiplicity = np.stack([np.bincount(draw, minlength=blocks) for draw in chosen])
    return grams.refit(multiplicity.astype(float))


def interval(draws: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the lower and upper end of the 95 % percentile interval over the first axis."""
    tail = 50.0 * (1.0 - CONFIDENCE)
    low, high = np.percentile(draws, [tail, 100.0 - tail], axis=0)
    return low, high
