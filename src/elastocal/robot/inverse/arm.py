"""The arm behind the external axes: its frames and axes, and its whole turns within the limits.

Frames and axes come from the chain itself and not from the names of its links.
"""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.errors import RobotError
from elastocal.results import brief_repr
from elastocal.robot.chain import ChainJoint
from elastocal.robot.robot import Robot


@brief_repr
@dataclass(frozen=True)
class AxisLines:
    """Axes of the arm's joints as lines, at q = 0, in the arm frame."""

    point: FloatArray
    """A point of each line, shape (joint, 3), in m."""
    direction: FloatArray
    """Unit vector of each line, positive rotation about it, shape (joint, 3)."""
    T_arm_tcp: FloatArray
    """Tool centre point at q = 0, shape (4, 4), in m."""


def arm_joints(robot: Robot) -> tuple[ChainJoint, ...]:
    """Return the joints behind the external axes."""
    return robot.chain.joints[robot.external_axes :]


def arm_base(robot: Robot, external: FloatArray) -> FloatArray:
    """Return T_base_arm: the frame that moves with the last external axis.

    Without external axes that is the base itself.

    Parameters
    ----------
    external : ndarray, shape (..., external axis)
        Positions of its external axes in rad or m.

    Returns
    -------
    ndarray, shape (..., 4, 4)
        The pose of the arm frame in base, in m.
    """
    T = np.broadcast_to(np.eye(4), (*external.shape[:-1], 4, 4))
    for index, joint in enumerate(robot.chain.joints[: robot.external_axes]):
        T = T @ joint.placement @ _motion(joint, external[..., index])
    return np.array(T)


def arm_axes(robot: Robot) -> AxisLines:
    """Return the axis lines of the arm's joints, and its tool, at q = 0 in the arm frame."""
    T, points, directions = np.eye(4), [], []
    for joint in arm_joints(robot):
        T = T @ joint.placement
        points.append(T[:3, 3])
        directions.append(T[:3, :3] @ joint.axis)
    return AxisLines(np.array(points), np.array(directions), T @ robot.chain.T_last_tip)


def _motion(joint: ChainJoint, position: FloatArray) -> FloatArray:
    """Return the joint's motion in its own frame, shape (..., 4, 4): Rodrigues or a shift."""
    T = np.zeros((*position.shape, 4, 4))
    T[...] = np.eye(4)
    if not joint.revolute:
        T[..., :3, 3] = position[..., None] * joint.axis
        return T
    K = np.cross(np.eye(3), joint.axis)
    sine, versine = np.sin(position), 1.0 - np.cos(position)
    T[..., :3, :3] += sine[..., None, None] * K + versine[..., None, None] * (K @ K)
    return T


TURN = 2.0 * np.pi
_ON_LIMIT = 1e-10
"""A position this near outside a limit (rad or m) is on it, and put there."""
_HALF_TURN = 1e-9
"""Within this of minus half a turn (rad) a position counts as plus half a turn."""
_MOST_TURNS = 10_000


def nearest_zero(robot: Robot, q: ArrayLike) -> FloatArray:
    """Return the equivalent of ``q`` nearest to zero within the limits, or NaN.

    Parameters
    ----------
    robot : Robot
        Whose limits hold.
    q : array_like, shape (..., joint)
        Positions of the last joints of the robot (all of them, or those of the arm), in rad
        or m.

    Returns
    -------
    ndarray, shape (..., joint)
        Each revolute joint moved by whole turns to the position nearest to zero; NaN in
        every joint of a configuration of which one joint cannot be brought inside.
    """
    q = np.asarray(q, dtype=float)
    revolute = np.array(robot.revolute)[-q.shape[-1] :]
    lower, upper = robot.limits.lower[-q.shape[-1] :], robot.limits.upper[-q.shape[-1] :]
    half = np.pi + _HALF_TURN
    base = np.where(revolute, q - TURN * np.ceil((q - half) / TURN), q)
    first, last = _turn_range(base, lower, upper)
    first, last = np.where(revolute, first, 0.0), np.where(revolute, last, 0.0)
    moved = base + TURN * np.clip(0.0, first, np.maximum(first, last))
    inside = (moved >= lower - _ON_LIMIT) & (moved <= upper + _ON_LIMIT)
    moved = np.clip(moved, lower, upper)
    return np.where(inside.all(axis=-1, keepdims=True), moved, np.nan)


def turns(robot: Robot, q: ArrayLike) -> FloatArray:
    """Return all configurations within the limits that differ from ``q`` by whole turns.

    A KUKA A4 or A6 with a range of ±350° reaches most poses in two ways. A joint without limits
    (continuous) keeps its position, so that the number of configurations is finite.

    Parameters
    ----------
    robot : Robot
        Whose limits hold.
    q : array_like, shape (joint,)
        A configuration in rad or m, e.g. a row of `InverseKinematics.solve`.

    Returns
    -------
    ndarray, shape (k, joint)
        Nearest to ``q`` first: row 0 is ``q`` itself if it is within the limits.

    Raises
    ------
    RobotError
        If ``q`` is not one configuration, or more than 10 000 others are equivalent to it.
    """
    q = robot.check_positions(q)
    if q.ndim != 1:
        raise RobotError(f"joint positions of shape {q.shape}: must be one configuration")
    limits = robot.limits
    first, last = _turn_range(q, limits.lower, limits.upper)
    turning = np.array(robot.revolute) & np.isfinite(first) & np.isfinite(last)
    inside = (q >= limits.lower - _ON_LIMIT) & (q <= limits.upper + _ON_LIMIT)
    first = np.where(turning, first, 0.0)
    last = np.where(turning, last, np.where(inside, 0.0, -1.0))
    counts = np.maximum(last - first + 1, 0)
    if not np.prod(counts) <= _MOST_TURNS:
        raise RobotError(
            f"{robot.name} reaches a pose in {np.prod(counts):.3g} equivalent ways (allowed"
            f" {_MOST_TURNS}): the limits of {robot.joint_names[int(np.argmax(counts))]} are too"
            " wide to list them"
        )
    whole = [np.arange(a, b + 1) for a, b in zip(first, last, strict=True)]
    grid = np.array(list(itertools.product(*whole)), dtype=float).reshape(-1, len(q))
    # Stable sort of a lexicographic list: ties keep a defined order.
    order = np.argsort(np.linalg.norm(grid, axis=1), kind="stable")
    return np.clip(q + TURN * grid[order], limits.lower, limits.upper)


def _turn_range(
    q: FloatArray, lower: FloatArray, upper: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the fewest and the most whole turns that keep ``q`` within the limits."""
    first = np.ceil((lower - _ON_LIMIT - q) / TURN)
    last = np.floor((upper + _ON_LIMIT - q) / TURN)
    return first, last
