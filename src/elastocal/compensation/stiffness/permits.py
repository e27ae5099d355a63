"""What a posture must pass to be chosen: margins to limits and singularity, collision."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.cell import Cell
from elastocal.errors import RobotError
from elastocal.planning import cell_surface, collision_scene
from elastocal.robot import Robot, characteristic_length, smallest_singular_value

_SAMPLES = 5
_SAME = 1e-6


@dataclass(frozen=True, eq=False)
class Permit:
    """One condition."""

    name: str
    allows: Callable[[FloatArray], BoolArray]
    """From joints, shape (row, joint), to whether each row passes, shape (row,)."""


def within_limits(robot: Robot, margin: FloatArray) -> Permit:
    """Return the permit of a margin to the joint limits.

    Parameters
    ----------
    robot : Robot
        Whose limits hold.
    margin : ndarray, shape (joint,)
        In rad or m.
    """
    return Permit("joint margin", lambda q: np.all(robot.limits.margin(q) >= margin, axis=1))


def cell_permit(cell: Cell) -> tuple[Permit, ...]:
    """Return the permits of a cell: joint margin, singularity, collision with tooling and fixtures.

    The tool is in contact: it is not checked against the surface that it works on.

    Parameters
    ----------
    cell : Cell
        The cell.
    """
    robot, limits = cell.robot, cell.file.limits
    scene = collision_scene(cell, cell_surface(cell))
    length = characteristic_length(robot)
    return (
        within_limits(robot, cell.joint_margin),
        Permit(
            "singularity",
            lambda q: np.asarray(
                smallest_singular_value(robot, q, length) >= limits.singular_value
            ),
        ),
        Permit("collision", lambda q: scene.keeps(q, limits.clearance, -math.inf)),
    )


def same_robot(model: Robot, cell: Robot) -> None:
    """Refuse a cell whose robot, or whose tcp, is not that of the model.

    Raises
    ------
    RobotError
        If joints have other names, or the same joints lead elsewhere.
    """
    if model.joint_names != cell.joint_names:
        raise RobotError(
            f"the cell's robot has joints {', '.join(cell.joint_names)}, the model's"
            f" {', '.join(model.joint_names)}: they must be the same"
        )
    low, high = (np.clip(end, -np.pi, np.pi) for end in (cell.limits.lower, cell.limits.upper))
    q = np.linspace(low, high, _SAMPLES)
    gap = float(np.abs(model.forward(q) - cell.forward(q)).max())
    if not gap <= _SAME:
        raise RobotError(
            f"the same joints lead {1e3 * gap:.3g} mm apart in the cell and in the model: another"
            " tool centre point, base or robot"
        )
