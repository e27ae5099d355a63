"""What a person types for ``elastocal tool``."""

from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import CompensationError
from elastocal.identification import read_model
from elastocal.robot import Robot, T_from_xyzabc
from elastocal.units import parse_quantity
from elastocal.workflows import find_robot


def posture_robot(robot: str | None, flange: str) -> Robot | None:
    """Return the robot of a model file, a URDF file or the catalogue, up to the flange."""
    if robot is None:
        return None
    if Path(robot).suffix.lower() == ".json":
        return read_model(Path(robot)).model.robot
    return find_robot(robot, flange, None)


def transform(text: str) -> FloatArray:
    """Return a transform from ``"x, y, z, a, b, c"`` with units (KUKA Z-Y'-X'').

    Raises
    ------
    CompensationError
        If the text is not six quantities.
    UnitError
        If one has no unit or a wrong one.
    """
    parts = [part.strip() for part in text.split(",")]
    if len(parts) != 6:
        raise CompensationError(
            f"sensor {text!r} must be six quantities, e.g. '0 mm, 0 mm, 45 mm, 0 deg, 0 deg, 0 deg'"
        )
    dimensions = ("length",) * 3 + ("angle",) * 3
    x, y, z, a, b, c = (parse_quantity(p, of) for p, of in zip(parts, dimensions, strict=True))
    return T_from_xyzabc(x, y, z, a, b, c)


def three_numbers(text: str) -> FloatArray:
    """Return a direction from ``"x, y, z"``.

    Raises
    ------
    CompensationError
        If the text is not three numbers.
    """
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError as error:
        raise CompensationError(
            f"direction {text!r} must be three numbers, e.g. '0, 0, -1'"
        ) from error
    return np.array([x, y, z])
