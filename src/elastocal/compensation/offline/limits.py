"""Joint limits of programmed and corrected rows, refused by name."""

from collections.abc import Callable

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.path import PathError
from elastocal.robot import Robot
from elastocal.robot.inverse import TURN

Where = Callable[[int], str]
"""Names a row for a person, e.g. ``row 12``."""

_ON_LIMIT = 1e-9
"""Outside by less than this, in rad or m, is on the limit."""


def check_limits(robot: Robot, q: FloatArray, where: Where, what: str) -> None:
    """Refuse joints outside their limits, the first by name.

    Parameters
    ----------
    robot : Robot
        Whose limits hold.
    q : ndarray, shape (row, joint)
        Positions of the robot's first joints (all, or the external axes), in rad or m.
    where : callable
        Names a row.
    what : str
        What is the matter with the joint.

    Raises
    ------
    PathError
        If there is one.
    """
    count = q.shape[1]
    low, high = robot.limits.lower[:count], robot.limits.upper[:count]
    inside = (q >= low - _ON_LIMIT) & (q <= high + _ON_LIMIT)
    if inside.all():
        return
    row, joint = np.argwhere(~inside)[0]
    turns = robot.revolute[joint]
    scale, unit = (180.0 / np.pi, "deg") if turns else (1e3, "mm")
    lower, upper = scale * low[joint], scale * high[joint]
    raise PathError(
        f"{where(int(row))}: {robot.joint_names[joint]} {what} to {scale * q[row, joint]:.4g}"
        f" {unit}, outside its limits {lower:.4g} to {upper:.4g} {unit}"
    )


def turned_inside(robot: Robot, q: FloatArray) -> FloatArray:
    """Return joints that are outside their limits a whole turn elsewhere, if that is inside.

    Parameters
    ----------
    robot : Robot
        Whose limits hold.
    q : ndarray, shape (row, joint)
        In rad or m.
    """
    limits, revolute = robot.limits, np.array(robot.revolute)
    turned = q - TURN * np.sign(q)
    swap = revolute & (limits.margin(q) < -_ON_LIMIT) & (limits.margin(turned) >= -_ON_LIMIT)
    return np.where(swap, turned, q)
