"""Checks ``joint_limits`` and ``travel_limits``: joints keep a margin to their limits.

In contact and at the approach pose. Turning and sliding joints are two checks, since their
margins have different units.
"""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.planning.checks.check import PostureCheck
from elastocal.planning.postures import Postures
from elastocal.planning.surface import Surface
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.wording import phrase


@brief_repr
@dataclass(frozen=True, eq=False)
class JointLimitsCheck(PostureCheck):
    """Smallest distance of any revolute joint to its nearer limit, less the margin asked for."""

    robot: Robot
    joint_margin: FloatArray | float
    """Least distance to the limits, a number in `unit`, or shape (joint,), in rad or m."""
    name: str = "joint_limits"
    unit: str = "rad"
    advice: str = phrase(
        "move the tooling towards the middle of the robot's reach, or mount the tool anew"
    )
    order: ClassVar[int] = 10
    _turning: ClassVar[bool] = True

    @classmethod
    def of(cls, cell: Cell, surface: Surface) -> Self | None:
        """Return the check of a cell's joints; None when the robot has none of the kind."""
        if cls._turning not in cell.robot.revolute:
            return None
        return cls(cell.robot, cell.joint_margin)

    def margin(self, postures: Postures) -> FloatArray:
        """Return the margin of each posture, shape (pose,), in `unit`."""
        limits, judged = self.robot.limits, np.array(self.robot.revolute) == self._turning
        both = np.minimum(limits.margin(postures.q), limits.margin(postures.q_approach))
        return np.asarray((both - self.joint_margin)[:, judged].min(axis=1, initial=np.inf))


@brief_repr
@dataclass(frozen=True, eq=False)
class TravelLimitsCheck(JointLimitsCheck):
    """Smallest distance of any prismatic joint to its nearer limit, less the margin asked for."""

    name: str = "travel_limits"
    unit: str = "m"
    advice: str = phrase(
        "choose positions of the rail farther from its ends, or a smaller rail_margin"
    )
    order: ClassVar[int] = 20
    _turning: ClassVar[bool] = False
