"""Other conventions of controllers for the joints of an arm, which logs may contain."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.results import brief_repr
from elastocal.robot.robot import Robot

_ROLL = (0, 3, 5)
"""First, fourth and sixth joint of an arm."""


@brief_repr
@dataclass(frozen=True)
class JointReading:
    """A convention for joints that differs from the URDF's."""

    message: str
    """Meaning of the joints, as a sentence without its end."""
    read: Callable[[Robot, FloatArray], FloatArray]
    """Function from recorded joints, shape (row, joint), to those of the URDF."""


def _turn_roll(robot: Robot, q: FloatArray) -> FloatArray:
    signs = np.ones(q.shape[1])
    signs[[robot.external_axes + index for index in _ROLL if index < len(signs)]] = -1.0
    return q * signs


def _uncoupled(sign: float, sense: float) -> Callable[[Robot, FloatArray], FloatArray]:
    """Return the reading of a third joint whose column is the tilt of the forearm, up or down."""

    def read(robot: Robot, q: FloatArray) -> FloatArray:
        free = q.copy()
        second, third = robot.external_axes + 1, robot.external_axes + 2
        free[:, third] = sense * (sign * q[:, third] - q[:, second])
        return free

    return read


def other_joint_readings(robot: Robot) -> tuple[JointReading, ...]:
    """Return the other conventions in which the joints of a robot may have been recorded.

    Those of arms with six axes or more, the likeliest first. In many URDFs of FANUC arms the third
    joint turns against the second, which changes both signs of a coupled one.
    """
    if len(robot.joint_names) < 6:
        return ()
    shoulder, elbow = robot.chain.joints[robot.external_axes + 1 :][:2]
    sense = float(np.copysign(1.0, shoulder.axis @ elbow.placement[:3, :3] @ elbow.axis))
    coupled, level = ("-(q2 + q3)", "q3 - q2") if sense > 0.0 else ("q2 + q3", "q2 - q3")
    return (
        JointReading(
            "joints 1, 4 and 6 of the arm turn the other way round than in the URDF (KUKA's A1, A4,"
            " A6 turn clockwise)",
            _turn_roll,
        ),
        JointReading(
            f"the third joint is coupled to the second as on FANUC controllers: use {coupled}",
            _uncoupled(-1.0, sense),
        ),
        JointReading(
            f"the third joint is measured against the horizontal: use {level}",
            _uncoupled(1.0, sense),
        ),
        JointReading("the joints are in reverse order", lambda _, q: q[:, ::-1]),
    )
