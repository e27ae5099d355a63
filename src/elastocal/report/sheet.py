"""One flat piece of a printed map of a surface."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray, IndexArray

ONE_WAY = np.cos(np.radians(72.0))
"""Least cosine between a normal and the viewing direction at which a surface still reads well."""


@dataclass(frozen=True, eq=False)
class Sheet:
    """A part of the surface with its own flat map ``u = A x + b``."""

    A: FloatArray
    """Shape (2, 3): unit vectors to the right and upward in the figure, in base."""
    b: FloatArray
    """Shape (2,), in m."""
    faces: IndexArray
    """Which faces are drawn, the farthest from the viewer first."""
    candidates: IndexArray
    """Which candidates lie on it."""

    def flat(self, points: FloatArray) -> FloatArray:
        """Return points in the figure, shape (..., 2), in m."""
        return points @ self.A.T + self.b

    @property
    def towards_viewer(self) -> FloatArray:
        """Unit vector out of the figure, in base, shape (3,)."""
        return np.cross(self.A[0], self.A[1])


def axes_across(towards: FloatArray, upward: FloatArray) -> FloatArray:
    """Return right and up in the plane across a unit vector, shape (2, 3).

    Parameters
    ----------
    towards : ndarray, shape (3,)
        Unit vector to the viewer, in base.
    upward : ndarray, shape (3,)
        What is to point upward in the figure, as well as it can.
    """
    up = upward - towards * (towards @ upward)
    if not np.linalg.norm(up) > 1e-3 * np.linalg.norm(upward):
        up = np.eye(3)[np.argmin(np.abs(towards))]
        up = up - towards * (towards @ up)
    up = up / np.linalg.norm(up)
    return np.stack([np.cross(up, towards), up])
