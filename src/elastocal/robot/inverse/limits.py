"""Joint limits and whole turns: which of the equivalent positions a joint may take."""

import itertools

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.errors import RobotError
from elastocal.robot.robot import Robot

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

    A KUKA A4 or A6 that may turn by ±350° reaches most poses in two ways. A joint without
    limits (continuous) keeps its position; the others are never infinitely many.

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
