"""How the robot moves: HOME, speeds, margins, torques, and positions of the external axes."""

import itertools
import math
from collections.abc import Iterable, Mapping
from typing import Annotated

import numpy as np
from pydantic import Field, FiniteFloat

from elastocal.arrays import FloatArray
from elastocal.cell._quantities import PositiveSpeed, PositiveTime, needed_for, vector
from elastocal.cell.hardware import RobotEntry
from elastocal.cell.procedure import Limits, TorqueLimits
from elastocal.errors import RobotError, UnitError, nearest
from elastocal.records import StrictModel
from elastocal.robot import Robot
from elastocal.units import parse_quantity

_SLOWEST = 1e-12
"""A joint that is slower, in rad/s or m/s, has no speed."""
_USABLE = 1e-4
"""Slowest speed that is used, in rad/s or m/s: a quarter turn takes four hours."""
_STEP_LENGTH = 0.25
"""Largest distance between positions of a linear axis that are searched, in m."""
_STEP_ANGLE = math.radians(15.0)
"""Largest angle between positions of a turning axis that are searched, in rad."""
_INSIDE_LENGTH = 1e-3
"""Distance of the outermost searched positions of a linear axis from its margins, in m."""
_INSIDE_ANGLE = math.radians(0.1)
"""The same for a turning axis, in rad."""
_ROUNDING = 1e-9
"""Largest distance from the end of a range at which a position counts as on it, in m or rad."""
_MOST = 500
"""Largest number of combinations of positions that are tried."""


class MotionEntry(StrictModel):
    """HOME, and the figures that the cycle time is estimated from."""

    home: dict[str, str]
    """Position of every joint, external axes too, where the robot starts and ends."""
    speed: dict[str, str] = Field(default_factory=dict)
    """Largest speed of each joint, by name; those of the robot's description by default."""
    provenance: Annotated[
        str | None,
        needed_for("speed", "say where the speeds are from"),
        Field(validate_default=True),
    ] = None
    """Source of the speeds; required if any are given."""
    override: Annotated[FiniteFloat, Field(ge=0.01, le=1.0)] = 0.2
    """Part of the speeds that is used; controllers know no less than a percent."""
    acceleration_time: PositiveTime = 0.5
    """Time in which a joint reaches its full speed, in s."""
    contact_speed: Annotated[PositiveSpeed, Field(ge=1e-4)] = 0.02
    """Fastest straight motion of the robot program between approach pose and contact, in m/s.
    `elastocal run` has ``procedure.approach_speed``, and for the last millimetres
    ``procedure.contact_speed``: the times of a plan are for those."""
    unloaded_time: PositiveTime = 4.0
    """Without effect, and read for cells of earlier versions: times follow from ``procedure``."""
    load_time: PositiveTime = 8.0
    """Accepted in old files; it has no effect."""


def home_position(robot: Robot, entry: MotionEntry) -> FloatArray:
    """Return the joint positions of HOME; see `joint_positions`."""
    return joint_positions(robot, "home", entry.home)


def joint_positions(robot: Robot, key: str, positions: Mapping[str, str]) -> FloatArray:
    """Return a posture that a cell file gives joint by joint.

    Parameters
    ----------
    robot : Robot
        The robot, with its rail.
    key : str
        The key of the cell file, for refusals.
    positions : mapping of str to str
        Position of every joint with its unit, by name.

    Returns
    -------
    ndarray, shape (joint,)
        In rad or m.

    Raises
    ------
    RobotError
        If a joint is missing, unknown, or outside its limits.
    UnitError
        If a position has no unit or a wrong one.
    """
    _require_joints(robot, f"{key}: ", positions)
    limits, found = robot.limits, np.empty(len(robot.joint_names))
    for index, name in enumerate(robot.joint_names):
        if name not in positions:
            raise RobotError(
                f"{key}.{name} is missing: every joint needs a position"
                f" (joints: {', '.join(robot.joint_names)})"
            )
        found[index] = _parse(f"{key}.{name}", positions[name], robot.revolute[index])
        lower, upper = limits.lower[index], limits.upper[index]
        if not lower <= found[index] <= upper:
            one, unit = (math.radians(1.0), "deg") if robot.revolute[index] else (1e-3, "mm")
            raise RobotError(
                f"{key}.{name}: {positions[name]} must be within {lower / one:g} {unit} and"
                f" {upper / one:g} {unit}"
            )
    return found


def axis_speeds(robot: Robot, entry: MotionEntry) -> FloatArray:
    """Return the speeds that are used: the largest ones times the override.

    Parameters
    ----------
    robot : Robot
        The robot, with its rail.
    entry : MotionEntry
        What the cell file says; it precedes the robot's description.

    Returns
    -------
    ndarray, shape (joint,)
        In rad/s or m/s, above 0.

    Raises
    ------
    RobotError
        If a name is no joint, or a speed is not above 0 or known from nowhere.
    UnitError
        If a speed has no unit or a wrong one.
    """
    _require_joints(robot, "speed: ", entry.speed)
    speeds = np.array(robot.limits.velocity)
    for index, name in enumerate(robot.joint_names):
        if name in entry.speed:
            text = entry.speed[name]
            speeds[index] = _parse(f"speed.{name}", text, robot.revolute[index], speed=True)
        elif not _SLOWEST <= speeds[index] < math.inf:
            raise RobotError(
                f"speed.{name} is missing: the description of {robot.name} has no speed of it"
            )
        if not speeds[index] >= _SLOWEST:
            raise RobotError(f"speed.{name}: {entry.speed[name]} must be above 0")
        if not entry.override * speeds[index] >= _USABLE:
            unit = "rad/s" if robot.revolute[index] else "m/s"
            raise RobotError(
                f"speed.{name}: {speeds[index]:.3g} {unit}, of which {entry.override:.3g} is used,"
                f" is too slow: at least {_USABLE:g} {unit} must be used"
            )
    return entry.override * speeds


def joint_margins(robot: Robot, limits: Limits) -> FloatArray:
    """Return the least distance of each joint to its limits, shape (joint,), in rad or m.

    Raises
    ------
    RobotError
        If a margin leaves a joint nothing of its range.
    """
    margins = [limits.joint_margin if turns else limits.rail_margin for turns in robot.revolute]
    for index, (name, margin) in enumerate(zip(robot.joint_names, margins, strict=True)):
        lower, upper = robot.limits.lower[index], robot.limits.upper[index]
        if not 2.0 * margin < upper - lower:
            turns = robot.revolute[index]
            key, unit = ("joint_margin", "deg") if turns else ("rail_margin", "m")
            scale = 180.0 / math.pi if turns else 1.0
            raise RobotError(
                f"limits.{key}: {scale * margin:g} {unit} leaves nothing of the range of"
                f" {name}, which is {scale * lower:g} to {scale * upper:g} {unit}"
            )
    return vector(tuple(margins))


def torque_limits(robot: Robot, torque: TorqueLimits) -> FloatArray:
    """Return the torques that may be used, shape (joint,), in N·m (N); NaN where not known.

    Raises
    ------
    RobotError
        If a figure is of no joint.
    UnitError
        If a figure is a force where a moment is needed, or the other way round.
    """
    _require_joints(robot, "", torque.values)
    limits = np.array(robot.limits.effort)
    for joint in torque.values:
        index = robot.joint_names.index(joint)
        limits[index] = torque.figure(joint, robot.revolute[index])
    return torque.factor * limits


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
    if math.prod(counts) > _MOST:
        each = " x ".join(f"{count} of {name}" for name, count in zip(names, counts, strict=True))
        raise RobotError(
            f"external: {each} are {math.prod(counts)} combinations of positions, at most {_MOST}"
            " are tried: list the positions to try instead of search, or is the travel in the"
            " wrong unit?"
        )
    axes = [_positions(robot, index, choice, margin) for index, choice in enumerate(wanted)]
    combinations = list(itertools.product(*axes))
    return np.array(combinations, dtype=float).reshape(len(combinations), len(names))


def _require_joints(robot: Robot, key: str, names: Iterable[str]) -> None:
    for name in names:
        if name not in robot.joint_names:
            raise RobotError(
                f"{key}{robot.name} has no joint {name!r}{nearest(name, robot.joint_names)}"
                f" (joints: {', '.join(robot.joint_names)})"
            )


def _parse(key: str, text: str, revolute: bool, speed: bool = False) -> float:
    names = ("angular speed", "speed") if speed else ("angle", "length")
    try:
        return parse_quantity(text, names[0] if revolute else names[1])
    except UnitError as error:
        raise UnitError(f"{key}: {error}") from error


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
    return math.ceil((high - low) / (_STEP_ANGLE if robot.revolute[index] else _STEP_LENGTH)) + 1


def _positions(
    robot: Robot, index: int, wanted: str | tuple[str, ...], margin: FloatArray
) -> FloatArray:
    name, revolute = robot.joint_names[index], robot.revolute[index]
    low, high = _range(robot, index, margin)
    if wanted == "search":
        inside = min(_INSIDE_ANGLE if revolute else _INSIDE_LENGTH, 0.25 * (high - low))
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
