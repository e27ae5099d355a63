"""Forces that change slowly, from a seeded generator, and how they begin and end."""

import numpy as np
from numpy.random import Generator

from elastocal.arrays import FloatArray

PERIODS = (1.0, 2.3, 5.1)
"""Of three sines, in s; no two of them keep step."""


def swing(time: FloatArray, rng: Generator) -> FloatArray:
    """Return a slow swing between -1 and 1, shape (row,): three sines of random phase."""
    phase = rng.uniform(0.0, 2.0 * np.pi, len(PERIODS))
    sines = [
        np.sin(2.0 * np.pi * time / period + p) for period, p in zip(PERIODS, phase, strict=True)
    ]
    mean: FloatArray = np.mean(sines, axis=0)
    return mean


def engaged(time: FloatArray, rise: float) -> FloatArray:
    """Return how much of the force acts, from 0 over 1 to 0, shape (row,).

    Parameters
    ----------
    time : ndarray, shape (row,)
        In s.
    rise : float
        Time from none to all of it, and back at the end, in s; a half cosine.
    """
    inward = np.minimum(time - time[0], time[-1] - time) / rise
    share: FloatArray = 0.5 - 0.5 * np.cos(np.pi * np.clip(inward, 0.0, 1.0))
    return share
