"""The raw wrench of a sensor that carries its tool, and how it changes with each unknown."""

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.conditioning.postures import StaticPostures

NAMES = (
    "mass",
    *(f"sensor rotation about {axis}" for axis in "xyz"),
    *(f"force bias {axis}" for axis in "xyz"),
    *(f"centre of mass {axis}" for axis in "xyz"),
    *(f"moment bias {axis}" for axis in "xyz"),
)
"""The unknowns, in the order of every vector of them; in place of the centre of mass itself the
vectors hold mass times centre."""
ROTATION = slice(1, 4)


def wrenches(postures: StaticPostures, values: FloatArray, R: FloatArray) -> FloatArray:
    """Return forces and moments, shape (posture, 6)."""
    u = postures.gravity_flange @ R
    force = values[0] * u + values[4:7]
    return np.hstack([force, np.cross(values[7:10], u) + values[10:13]])


def derivatives(postures: StaticPostures, values: FloatArray, R: FloatArray) -> FloatArray:
    """Return its derivatives by mass, rotation (in sensor axes), b, h, b_m; (posture, 6, 13)."""
    u = postures.gravity_flange @ R
    J = np.zeros((len(u), 6, len(NAMES)))
    skew_u = _skew(u)
    J[:, :3, 0] = u
    J[:, :3, ROTATION] = values[0] * skew_u
    J[:, :3, 4:7] = np.eye(3)
    J[:, 3:, ROTATION] = _skew(values[7:10]) @ skew_u
    J[:, 3:, 7:10] = -skew_u
    J[:, 3:, 10:13] = np.eye(3)
    return J


def _skew(v: FloatArray) -> FloatArray:
    """Return ``[v]x`` with ``[v]x a = v x a``."""
    S = np.zeros((*v.shape[:-1], 3, 3))
    S[..., 0, 1], S[..., 0, 2] = -v[..., 2], v[..., 1]
    S[..., 1, 0], S[..., 1, 2] = v[..., 2], -v[..., 0]
    S[..., 2, 0], S[..., 2, 1] = -v[..., 1], v[..., 0]
    return S
