"""What the findings need to know of the robot: where it stands, how far it reaches, what."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.robot import Robot
from elastocal.robot.inverse import InverseKinematics, arm_base


def arm_reach(robot: Robot) -> float:
    """Return a bound in m that the tool centre point never goes beyond.

    The sum of the lengths from the arm's second joint to the tool centre point, and of the first
    joint's from its own origin: the arm stretched out as no limit would let it.

    Parameters
    ----------
    robot : Robot
        The robot with its tool.
    """
    joints = robot.chain.joints[robot.external_axes + 1 :]
    lengths = [float(np.linalg.norm(joint.placement[:3, 3])) for joint in joints]
    return sum(lengths) + float(np.linalg.norm(robot.chain.T_last_tip[:3, 3]))


def arm_stands(robot: Robot, external: FloatArray) -> FloatArray:
    """Return where the arm's first joint can be, in base, shape (combination, 3), in m.

    Parameters
    ----------
    robot : Robot
        The robot.
    external : ndarray, shape (combination, external axis)
        Positions of its external axes in rad or m.
    """
    first = robot.chain.joints[robot.external_axes].placement
    return (arm_base(robot, external) @ first)[:, :3, 3]


@dataclass(frozen=True, eq=False)
class ReachableFrom:
    """Whether a robot reaches poses from any of some positions of its external axes."""

    inverse: InverseKinematics
    external: FloatArray
    """Shape (combination, external axis), in rad or m."""

    def __call__(self, T_base_tcp: FloatArray) -> BoolArray:
        """Return whether each pose is reached within the limits, shape (pose,).

        Parameters
        ----------
        T_base_tcp : ndarray, shape (pose, 4, 4)
            In m.
        """
        reached = np.zeros(len(T_base_tcp), dtype=bool)
        for position in self.external:
            left = np.flatnonzero(~reached)
            if len(left):
                reached[left] = self.inverse.solve_many(T_base_tcp[left], position).reachable
        return reached
