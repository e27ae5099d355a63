"""Candidates with joints: contact point, posture and retreat."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elastocal.arrays import FloatArray, IndexArray
from elastocal.results import brief_repr
from elastocal.robot import Robot

_STRAIGHT = 2e-5
"""Tolerated distance (m) and angle (rad) from the straight line."""
_STEPS = 4


class Rows:
    """Base of frozen dataclasses whose fields are arrays of equal length."""

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self._columns()[0])

    def take(self, index: ArrayLike) -> Self:
        """Return some of the rows (a mask or numbers)."""
        rows = np.asarray(index)
        rows = rows.astype(np.intp) if rows.size == 0 else rows
        return type(self)(*(column[rows] for column in self._columns()))

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Return the rows of several, one after the other."""
        columns = zip(*(part._columns() for part in parts), strict=True)
        return cls(*map(np.concatenate, columns))

    def _columns(self) -> tuple[Any, ...]:
        return tuple(getattr(self, each.name) for each in fields(self))  # type: ignore[arg-type]


def read_only(values: ArrayLike, dtype: type[Any] = float) -> NDArray[Any]:
    """Return a copy of an array that cannot be written to."""
    copy = np.array(values, dtype)
    copy.setflags(write=False)
    return copy


@brief_repr
@dataclass(frozen=True, eq=False)
class Postures(Rows):
    """Contact poses on the surface with the robot's configurations; arrays are read-only."""

    T_base_tcp: FloatArray
    """Contact frames, z into the surface, shape (pose, 4, 4), in m."""
    normal: FloatArray
    """Outward unit normals of the surface in base, shape (pose, 3)."""
    q: FloatArray
    """Joint positions in contact, shape (pose, joint), in rad or m."""
    q_approach: FloatArray
    """Joint positions at the approach pose, off along the normal, shape (pose, joint)."""
    point: IndexArray
    """Sampled point of the surface that each posture touches, shape (pose,)."""

    def __post_init__(self) -> None:
        for name in ("T_base_tcp", "normal", "q", "q_approach"):
            object.__setattr__(self, name, read_only(getattr(self, name)))
        object.__setattr__(self, "point", read_only(self.point, np.intp))

    @property
    def contact(self) -> FloatArray:
        """Contact points in base, shape (pose, 3), in m."""
        return self.T_base_tcp[:, :3, 3]

    def at(self, point: IndexArray) -> "Postures":
        """Return the same postures with new numbers of their points, shape (pose,)."""
        return replace(self, point=point)

    @staticmethod
    def none(joints: int) -> "Postures":
        """Return no postures of a robot with so many joints."""
        return Postures(
            np.zeros((0, 4, 4)),
            np.zeros((0, 3)),
            np.zeros((0, joints)),
            np.zeros((0, joints)),
            np.zeros(0, dtype=np.intp),
        )


def retreat_joints(robot: Robot, postures: Postures, part: float) -> FloatArray:
    """Return the joints part of the way from contact to the approach pose.

    The tool keeps its orientation and moves along a straight line; the joints do not. From the
    straight line in joint space, which is some millimetres off, Newton steps of the arm lead back
    to it, within `_STRAIGHT`.

    Parameters
    ----------
    robot : Robot
        With its tool.
    postures : Postures
        In contact.
    part : float
        0 in contact, 1 at the approach pose.

    Returns
    -------
    ndarray, shape (pose, joint)
        In rad or m; external axes on the straight line between both ends.
    """
    q = postures.q + part * (postures.q_approach - postures.q)
    if part in (0.0, 1.0) or not len(q):
        return q
    R, p = postures.T_base_tcp[:, :3, :3], postures.contact
    place = p + part * (robot.forward(postures.q_approach)[:, :3, 3] - p)
    arm, off = slice(robot.external_axes, None), np.arange(len(q))
    for _ in range(_STEPS):
        error = _error(robot.forward(q[off]), place[off], R[off])
        missed = np.linalg.norm(error, axis=1) > _STRAIGHT
        if not missed.any():
            break
        off = off[missed]
        jacobian = robot.jacobian(q[off])
        J = np.concatenate([jacobian.translation, jacobian.rotation], axis=1)[..., arm]
        q[off, arm] += (np.linalg.pinv(J, rcond=1e-4) @ error[missed, :, None])[..., 0]
    return q


def _error(T: FloatArray, place: FloatArray, R: FloatArray) -> FloatArray:
    """Return the shift and the small turn from one frame to another, shape (pose, 6)."""
    # Half the sum of the cross products of the axes is the turn, to third order.
    turn = 0.5 * np.cross(T[:, :3, :3], R, axis=1).sum(axis=2)
    return np.concatenate([place - T[:, :3, 3], turn], axis=1)
