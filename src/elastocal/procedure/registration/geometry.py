"""Whether marker positions are spread enough to say how a station is turned."""

import math

import numpy as np

from elastocal.arrays import FloatArray

ROTATION_SIGMA = 0.02
"""Largest standard deviation of a rotation that is of use, in rad: it turns a displacement of
1 mm into one that is off by 20 µm, as much as a tracker's own noise."""


def determined(position: FloatArray, scatter: float) -> bool:
    """Return whether points determine a rotation well enough.

    Points on a line leave the rotation about it free; how far they are off their best line
    bounds its standard deviation.

    Parameters
    ----------
    position : ndarray, shape (point, 3)
        In any frame, in m.
    scatter : float
        Standard deviation of a coordinate, in m.
    """
    return rotation_sigma(position, scatter) <= ROTATION_SIGMA


def align(here: FloatArray, there: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the rotation and translation that bring points nearest to others (Kabsch 1976).

    Parameters
    ----------
    here, there : ndarray, shape (point, 3)
        In m.
    """
    u, _, vt = np.linalg.svd((there - there.mean(axis=0)).T @ (here - here.mean(axis=0)))
    R: FloatArray = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return R, there.mean(axis=0) - R @ here.mean(axis=0)


def rotation_sigma(position: FloatArray, scatter: float) -> float:
    """Return the standard deviation of the rotation about the points' own line, in rad."""
    if len(position) < 3:
        return math.inf
    spread = np.linalg.svd(position - position.mean(axis=0), compute_uv=False)
    return float(scatter / spread[1]) if spread[1] > 1e-6 else math.inf
