"""How the robot moves between poses: HOME, axis speeds, and how long a pose takes."""

import math
from collections.abc import Iterable
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, FiniteFloat, field_validator

from elastocal.arrays import FloatArray
from elastocal.errors import RobotError, UnitError, nearest
from elastocal.records import StrictModel
from elastocal.robot import Robot
from elastocal.units import parse_quantity

_SLOWEST = 1e-12
"""A joint that is slower, in rad/s or m/s, has no speed."""


def _finite(value: float) -> float:
    if not math.isfinite(value):
        raise ValueError("must be finite")
    return value


PositiveTime = Annotated[
    float,
    BeforeValidator(lambda text: parse_quantity(text, "time")),
    Field(gt=0.0),
    AfterValidator(_finite),
]
"""In s, above 0."""
PositiveSpeed = Annotated[
    float,
    BeforeValidator(lambda text: parse_quantity(text, "speed")),
    Field(gt=0.0),
    AfterValidator(_finite),
]
"""In m/s, above 0."""


class Motion(StrictModel):
    """HOME, and the figures that the cycle time is estimated from."""

    home: dict[str, str]
    """Position of every joint, external axes too, where the robot starts and ends."""
    speed: dict[str, str] = Field(default_factory=dict)
    """Largest speed of each joint, by name; those of the robot's description by default."""
    provenance: Annotated[str | None, Field(validate_default=True)] = None
    """Where the speeds are from; needed when there are any."""
    override: Annotated[FiniteFloat, Field(ge=0.01, le=1.0)] = 0.2
    """Part of the speeds that is used; controllers know no less than a percent."""
    acceleration_time: PositiveTime = 0.5
    """Time in which a joint reaches its full speed, in s."""
    contact_speed: Annotated[PositiveSpeed, Field(ge=1e-4)] = 0.02
    """Speed of the straight motion between approach pose and contact, in m/s."""
    unloaded_time: PositiveTime = 4.0
    """Time of the unloaded reference of a pose, in s."""
    load_time: PositiveTime = 8.0
    """Time of one load case, in s: ramp, settle, average."""

    @field_validator("provenance")
    @classmethod
    def _known_origin(cls, text: str | None, info: Any) -> str | None:
        if info.data.get("speed") and not (text or "").strip():
            raise ValueError("say where the speeds are from")
        return text


def home_position(robot: Robot, entry: Motion) -> FloatArray:
    """Return the joint positions of HOME.

    Parameters
    ----------
    robot : Robot
        The robot, with its rail.
    entry : Motion
        What the cell file says.

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
    _refuse_unknown(robot, "home", entry.home)
    limits, home = robot.limits, np.empty(len(robot.joint_names))
    for index, name in enumerate(robot.joint_names):
        if name not in entry.home:
            raise RobotError(
                f"home.{name} is missing: every joint needs a position"
                f" (joints: {', '.join(robot.joint_names)})"
            )
        home[index] = _parse(f"home.{name}", entry.home[name], robot.revolute[index])
        lower, upper = limits.lower[index], limits.upper[index]
        if not lower <= home[index] <= upper:
            one, unit = (math.radians(1.0), "deg") if robot.revolute[index] else (1e-3, "mm")
            raise RobotError(
                f"home.{name}: {entry.home[name]} must be within {lower / one:g} {unit} and"
                f" {upper / one:g} {unit}"
            )
    return home


def axis_speeds(robot: Robot, entry: Motion) -> FloatArray:
    """Return the speeds that are used: the largest ones times the override.

    Parameters
    ----------
    robot : Robot
        The robot, with its rail.
    entry : Motion
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
    _refuse_unknown(robot, "speed", entry.speed)
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
    used: FloatArray = entry.override * speeds
    return used


def _refuse_unknown(robot: Robot, key: str, names: Iterable[str]) -> None:
    for name in names:
        if name not in robot.joint_names:
            raise RobotError(
                f"{key}: {robot.name} has no joint {name!r}{nearest(name, robot.joint_names)}"
                f" (joints: {', '.join(robot.joint_names)})"
            )


def _parse(key: str, text: str, revolute: bool, speed: bool = False) -> float:
    names = ("angular speed", "speed") if speed else ("angle", "length")
    try:
        return parse_quantity(text, names[0] if revolute else names[1])
    except UnitError as error:
        raise UnitError(f"{key}: {error}") from error
