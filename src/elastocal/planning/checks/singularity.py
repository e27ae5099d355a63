"""Check ``singularity``: the arm keeps away from postures in which it cannot move some way."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.planning.postures import Postures
from elastocal.robot import Robot, smallest_singular_value, wrist_angle


@dataclass(frozen=True)
class SingularityCheck:
    """Smallest singular value of the length-scaled Jacobian, less the least one allowed."""

    robot: Robot
    least: float
    """Least singular value, dimensionless; see `robot.singularity`."""
    name: str = "singularity"
    unit: str = "1"
    advice: str = "bring the tooling nearer: a stretched arm is singular"

    def margin(self, postures: Postures) -> FloatArray:
        """Return the margin of each posture, shape (pose,)."""
        return np.asarray(smallest_singular_value(self.robot, postures.q) - self.least)


@dataclass(frozen=True)
class WristCheck:
    """Angle between the axes of joints 4 and 6, less the least one allowed (KUKA: |A5|)."""

    robot: Robot
    least: float
    """Least angle in rad."""
    name: str = "wrist"
    unit: str = "rad"
    advice: str = "tilt the tooling or the tool: axes 4 and 6 line up"

    def margin(self, postures: Postures) -> FloatArray:
        """Return the margin of each posture, shape (pose,), in rad."""
        return np.asarray(np.abs(wrist_angle(self.robot, postures.q)) - self.least)
