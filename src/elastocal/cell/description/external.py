"""Where the external axes may stand: values that are given, or a grid to search."""

import itertools
import math

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell.description.robot import RobotEntry
from elastocal.errors import RobotError, nearest
from elastocal.robot import Robot
from elastocal.units import parse_quantity

STEP_LENGTH = 0.25
"""Largest distance between positions of a linear axis that are searched, in m."""
STEP_ANGLE = math.radians(15.0)
"""Largest angle between positions of a turning axis that are searched, in rad."""


def external_positions(robot: Robot, entry: RobotEntry) -> FloatArray:
    """Return every combination of positions of the external axes.

    Parameters
    ----------
    robot : Robot
        The robot, with its rail.
    entry : RobotEntry
        What the cell file says.

    Returns
    -------
    ndarray, shape (combination, external axis)
        In m or rad; one row without columns when the robot has no external axis.

    Raises
    ------
    RobotError
        If a name is no external axis, a position is outside the limits, or an axis without
        limits is to be searched.
    UnitError
        If a position has no unit or a wrong one.
    """
    names = robot.joint_names[: robot.external_axes]
    for name in entry.external:
        if name not in names:
            raise RobotError(
                f"external: {robot.name} has no external axis {name!r}{nearest(name, names)}"
                f" (it has {', '.join(names) or 'none'})"
            )
    wanted = [entry.external.get(name, "search") for name in names]
    axes = [_positions(robot, index, choice) for index, choice in enumerate(wanted)]
    combinations = list(itertools.product(*axes))
    return np.array(combinations, dtype=float).reshape(len(combinations), len(names))


def _positions(robot: Robot, index: int, wanted: str | tuple[str, ...]) -> FloatArray:
    name, revolute = robot.joint_names[index], robot.revolute[index]
    lower, upper = robot.limits.lower[index], robot.limits.upper[index]
    unit = "rad" if revolute else "m"
    if wanted == "search":
        if not math.isfinite(upper - lower):
            raise RobotError(f"external.{name}: an axis without limits cannot be searched")
        step = STEP_ANGLE if revolute else STEP_LENGTH
        return np.linspace(lower, upper, math.ceil((upper - lower) / step) + 1)
    values = np.array([parse_quantity(text, "angle" if revolute else "length") for text in wanted])
    if not len(values):
        raise RobotError(f"external.{name}: give at least one position, or 'search'")
    outside = ~((values >= lower) & (values <= upper))
    if outside.any():
        raise RobotError(
            f"external.{name}: {values[outside][0]:g} {unit} must be within {lower:g} and {upper:g}"
        )
    return values
