"""Checks ``singularity`` and ``wrist``: the arm keeps away from singular postures."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.planning.checks.check import PostureCheck
from elastocal.planning.postures import Postures
from elastocal.planning.surface import Surface
from elastocal.robot import Robot, has_wrist, smallest_singular_value, wrist_angle
from elastocal.wording import phrase


@dataclass(frozen=True)
class SingularityCheck(PostureCheck):
    """Smallest singular value of the length-scaled Jacobian, less the least one allowed."""

    robot: Robot
    least_singular_value: float
    """Least singular value, dimensionless; see `robot.singularity`."""
    name: str = "singularity"
    unit: str = "1"
    advice: str = phrase("bring the tooling nearer: a stretched arm is singular")
    order: ClassVar[int] = 30

    @classmethod
    def of(cls, cell: Cell, surface: Surface) -> Self:
        """Return the check of the cell's arm."""
        return cls(cell.robot, cell.file.limits.singular_value)

    def margin(self, postures: Postures) -> FloatArray:
        """Return the margin of each posture, shape (pose,)."""
        smallest = smallest_singular_value(self.robot, postures.q)
        return np.asarray(smallest - self.least_singular_value)


@dataclass(frozen=True)
class WristCheck(PostureCheck):
    """Angle between the axes of joints 4 and 6, less the least one allowed (KUKA: |A5|)."""

    robot: Robot
    least_wrist_angle: float
    """Least angle in rad, below pi / 2: the angle between two lines is never more."""
    name: str = "wrist"
    unit: str = "rad"
    advice: str = phrase("tilt the tooling or the tool: axes 4 and 6 line up")
    order: ClassVar[int] = 40

    @classmethod
    def of(cls, cell: Cell, surface: Surface) -> Self | None:
        """Return the check of the cell's arm; None without a wrist of joints 4 to 6."""
        if not has_wrist(cell.robot):
            return None
        return cls(cell.robot, cell.file.limits.wrist_angle)

    def margin(self, postures: Postures) -> FloatArray:
        """Return the margin of each posture, shape (pose,), in rad."""
        return np.asarray(np.abs(wrist_angle(self.robot, postures.q)) - self.least_wrist_angle)
