"""Screws and their exponentials: the kinematics of the simulated arm.

Every movement, of a joint or of a spring, is a screw written down once, in base, with the arm at
zero (Brockett's product of exponentials; Lynch and Park, "Modern Robotics", 2017, chapter 4).
The estimator chains link frames instead, so the two share no equation.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True)
class Screws:
    """Axes of movement in the order in which they follow one another from base to tip."""

    axis: FloatArray
    """Unit vectors in base with the arm at zero, shape (element, 3)."""
    point: FloatArray
    """A point on each axis, in base with the arm at zero, shape (element, 3), in m."""
    revolute: BoolArray
    """Whether each turns (else it slides), shape (element,)."""

    @cached_property
    def wedge(self) -> FloatArray:
        """Matrices of the cross product with the axes, shape (element, 3, 3)."""
        return np.cross(self.axis[:, None, :], np.eye(3)).transpose(0, 2, 1)

    @cached_property
    def wedge_squared(self) -> FloatArray:
        """Their squares, shape (element, 3, 3)."""
        squared: FloatArray = self.wedge @ self.wedge
        return squared


def motions(screws: Screws, positions: FloatArray) -> FloatArray:
    """Return the rigid motion that all elements in front of each one have made together.

    ``T[e] = exp(S_0 x_0) … exp(S_{e-1} x_{e-1})``; the last entry is the motion of the tip.

    Parameters
    ----------
    screws : Screws
        The elements.
    positions : ndarray, shape (batch, element)
        Position of each element in rad or m.

    Returns
    -------
    ndarray, shape (element + 1, batch, 4, 4)
        Motions to apply to points given in base with the arm at zero.
    """
    steps = _exponentials(screws, positions)
    total = np.empty((len(steps) + 1, *steps.shape[1:]))
    total[0] = np.eye(4)
    for index, step in enumerate(steps):
        np.matmul(total[index], step, out=total[index + 1])
    return total


def moved_axes(screws: Screws, before: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the axes and points of screws after the motions in front of them.

    Parameters
    ----------
    screws : Screws
        The elements.
    before : ndarray, shape (element, batch, 4, 4)
        Motion in front of each, from `motions`.

    Returns
    -------
    axis, point : ndarray, shape (element, batch, 3)
        Where the axes are now, in base.
    """
    rotation = before[..., :3, :3]
    axis = (rotation @ screws.axis[:, None, :, None])[..., 0]
    point = (rotation @ screws.point[:, None, :, None])[..., 0] + before[..., :3, 3]
    return axis, point


def _exponentials(screws: Screws, positions: FloatArray) -> FloatArray:
    """Return exp(S_e x_e) by Rodrigues' formula, shape (element, batch, 4, 4)."""
    angle = np.where(screws.revolute, positions, 0.0).T[..., None, None]
    slide = np.where(screws.revolute, 0.0, positions).T[..., None]
    rotation = np.sin(angle) * screws.wedge[:, None]
    rotation += (1.0 - np.cos(angle)) * screws.wedge_squared[:, None]
    steps = np.zeros((*angle.shape[:2], 4, 4))
    steps[..., :3, :3] = rotation + np.eye(3)
    steps[..., :3, 3] = -(rotation @ screws.point[:, None, :, None])[..., 0]
    steps[..., :3, 3] += slide * screws.axis[:, None]
    steps[..., 3, 3] = 1.0
    return steps
