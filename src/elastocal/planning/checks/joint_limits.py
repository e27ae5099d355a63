"""Check ``joint_limits``: every joint keeps a margin to its limits, in contact and approaching."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.planning.postures import Postures
from elastocal.robot import Robot


@dataclass(frozen=True, eq=False)
class JointLimitsCheck:
    """Smallest distance of any joint to its nearer limit, less the margin asked for."""

    robot: Robot
    keep: FloatArray | float
    """Margin to keep, a number or shape (joint,), in rad (in m for prismatic joints)."""
    name: str = "joint_limits"
    unit: str = "rad"
    advice: str = "move the tooling towards the middle of the robot's reach, or mount the tool anew"

    def margin(self, postures: Postures) -> FloatArray:
        """Return the margin of each posture, shape (pose,), in rad or m."""
        limits = self.robot.limits
        both = np.minimum(limits.margin(postures.q), limits.margin(postures.q_approach))
        return np.asarray((both - self.keep).min(axis=1))
