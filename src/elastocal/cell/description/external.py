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
INSIDE_LENGTH = 1e-3
"""How far inside the margins of a linear axis the outermost searched positions lie, in m."""
INSIDE_ANGLE = math.radians(0.1)
"""The same for a turning axis, in rad."""
_ROUNDING = 1e-9
"""How near to the end of its range a position counts as on it, in m or rad."""
MOST = 500
"""Largest number of combinations of positions that are tried."""


def external_positions(robot: Robot, entry: RobotEntry, margin: FloatArray) -> FloatArray:
    """Return every combination of positions of the external axes.

    All of them are where poses may be: farther from the limits than the margin.

    Parameters
    ----------
    robot : Robot
        The robot, with its rail.
    entry : RobotEntry
        What the cell file says.
    margin : ndarray, shape (joint,)
        Distance that each joint keeps to its limits, in rad or m; it leaves some of the range.

    Returns
    -------
    ndarray, shape (combination, external axis)
        In m or rad; one row without columns when the robot has no external axis.

    Raises
    ------
    RobotError
        If a name is no external axis, a position is not within the margins, an axis without
        limits is to be searched, or there are more than 500 combinations.
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
    counts = [_count(robot, index, choice, margin) for index, choice in enumerate(wanted)]
    if math.prod(counts) > MOST:
        each = " x ".join(f"{count} of {name}" for name, count in zip(names, counts, strict=True))
        raise RobotError(
            f"external: {each} are {math.prod(counts)} combinations of positions, at most {MOST}"
            " are tried: list the positions to try instead of search, or is the travel in the"
            " wrong unit?"
        )
    axes = [_positions(robot, index, choice, margin) for index, choice in enumerate(wanted)]
    combinations = list(itertools.product(*axes))
    return np.array(combinations, dtype=float).reshape(len(combinations), len(names))


def _range(robot: Robot, index: int, margin: FloatArray) -> tuple[float, float]:
    """Return the ends of what the margin leaves of an axis; poses are between, not on them."""
    limits, keep = robot.limits, float(margin[index])
    return float(limits.lower[index]) + keep, float(limits.upper[index]) - keep


def _count(robot: Robot, index: int, wanted: str | tuple[str, ...], margin: FloatArray) -> int:
    """Return how many positions of an axis are tried."""
    if wanted != "search":
        return len(wanted)
    low, high = _range(robot, index, margin)
    if not math.isfinite(high - low):
        name = robot.joint_names[index]
        raise RobotError(f"external.{name}: an axis without limits cannot be searched")
    return math.ceil((high - low) / (STEP_ANGLE if robot.revolute[index] else STEP_LENGTH)) + 1


def _positions(
    robot: Robot, index: int, wanted: str | tuple[str, ...], margin: FloatArray
) -> FloatArray:
    name, revolute = robot.joint_names[index], robot.revolute[index]
    low, high = _range(robot, index, margin)
    if wanted == "search":
        inside = min(INSIDE_ANGLE if revolute else INSIDE_LENGTH, 0.25 * (high - low))
        count = _count(robot, index, wanted, margin)
        return np.linspace(low + inside, high - inside, count)
    values = np.array([parse_quantity(text, "angle" if revolute else "length") for text in wanted])
    if not len(values):
        raise RobotError(f"external.{name}: give at least one position, or 'search'")
    within = (values > low + _ROUNDING) & (values < high - _ROUNDING)
    if not within.all():
        key, unit, scale = (
            ("joint_margin", "deg", 180.0 / math.pi) if revolute else ("rail_margin", "mm", 1e3)
        )
        raise RobotError(
            f"external.{name}: {wanted[int(np.argmin(within))]} must be above {scale * low:.6g}"
            f" {unit} and below {scale * high:.6g} {unit}, which are its limits less"
            f" limits.{key} of {scale * margin[index]:.6g} {unit}; the very ends are no places"
            " for poses"
        )
    return values
