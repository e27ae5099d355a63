"""Checks ``joint_limits`` and ``travel_limits``: joints keep a margin to their limits.

In contact and at the approach pose. Turning and sliding joints are two checks, since their
margins have different units.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.planning.postures import Postures
from elastocal.results import brief_repr
from elastocal.robot import Robot


@brief_repr
@dataclass(frozen=True, eq=False)
class JointLimitsCheck:
    """Smallest distance of any revolute joint to its nearer limit, less the margin asked for."""

    robot: Robot
    keep: FloatArray | float
    """Margin to keep, a number in `unit`, or shape (joint,), in rad or m."""
    name: str = "joint_limits"
    unit: str = "rad"
    advice: str = "move the tooling towards the middle of the robot's reach, or mount the tool anew"
    _turning: ClassVar[bool] = True

    def margin(self, postures: Postures) -> FloatArray:
        """Return the margin of each posture, shape (pose,), in `unit`."""
        limits, judged = self.robot.limits, np.array(self.robot.revolute) == self._turning
        both = np.minimum(limits.margin(postures.q), limits.margin(postures.q_approach))
        return np.asarray((both - self.keep)[:, judged].min(axis=1, initial=np.inf))


@brief_repr
@dataclass(frozen=True, eq=False)
class TravelLimitsCheck(JointLimitsCheck):
    """Smallest distance of any prismatic joint to its nearer limit, less the margin asked for."""

    name: str = "travel_limits"
    unit: str = "m"
    advice: str = "choose positions of the rail farther from its ends, or a smaller rail_margin"
    _turning: ClassVar[bool] = False
