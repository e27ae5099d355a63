"""Postures and frames as people write them: quantities with units, separated by commas."""

from collections.abc import Sequence

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import ElastocalError, RobotError, UnitError
from elastocal.robot import Robot, T_from_xyzabc
from elastocal.units import parse_quantity


def parse_posture(robot: Robot, text: str | None) -> FloatArray | None:
    """Return joint positions, shape (joint,), in rad or m; None for no text.

    Raises
    ------
    RobotError
        If there is not one quantity a joint, or one is outside its limits.
    UnitError
        If a unit is missing or wrong.
    """
    if text is None:
        return None
    parts, names = [part.strip() for part in text.split(",")], robot.joint_names
    if len(parts) != len(names):
        raise RobotError(
            f"posture {text!r} has {len(parts)} values: it must have one a joint of {robot.name}"
            f" ({', '.join(names)})"
        )
    kinds = ["angle" if turns else "length" for turns in robot.revolute]
    q = np.array([parse_quantity(part, kind) for part, kind in zip(parts, kinds, strict=True)])
    outside = ~(robot.limits.margin(q) >= 0.0)
    if outside.any():
        joint = int(np.argmax(outside))
        raise RobotError(
            f"posture {text!r}: {names[joint]} at {parts[joint]} is outside its limits"
        )
    return q


def write_posture(robot: Robot, q: Sequence[float]) -> str:
    """Return a posture as `parse_posture` reads it, to 0.1 deg and 0.1 mm."""
    return ", ".join(
        f"{np.degrees(value):.1f} deg" if turns else f"{1e3 * value:.1f} mm"
        for value, turns in zip(q, robot.revolute, strict=True)
    )


def parse_frame(
    text: str,
    name: str = "frame",
    rule: str = "must be six quantities, e.g. '0 mm, 0 mm, 565 mm, 0 deg, 0 deg, 0 deg'",
    error: type[ElastocalError] = UnitError,
) -> FloatArray:
    """Return a frame, shape (4, 4), from ``"x, y, z, a, b, c"`` (KUKA Z-Y'-X'').

    Parameters
    ----------
    text : str
        Three lengths and three angles.
    name, rule : str
        For the refusal of another number of quantities.
    error : type
        What that refusal is raised as.

    Raises
    ------
    UnitError
        If a unit is missing or wrong.
    """
    parts = [part.strip() for part in text.split(",")]
    if len(parts) != 6:
        raise error(f"{name} {text!r} {rule}")
    kinds = ("length",) * 3 + ("angle",) * 3
    return T_from_xyzabc(*(parse_quantity(p, kind) for p, kind in zip(parts, kinds, strict=True)))
