"""Check that the recorded joints belong to this robot."""

import numpy as np

from elastocal.dataset import Readings
from elastocal.errors import DatasetError
from elastocal.robot import Robot

_OUTSIDE = np.radians(5.0)
"""Distance outside a joint limit that cannot be calibration or rounding, in rad (or m)."""
_TCP_WRONG = 0.05
"""Median distance between recorded and computed tcp position that geometry errors and
deflection cannot explain, in m."""
_TCP_OFF = 0.005
"""The same distance above which it is worth a warning, in m."""


def check_joints(robot: Robot, readings: Readings) -> tuple[str, ...]:
    """Return warnings about recorded joints, or refuse them.

    Raises
    ------
    DatasetError
        If a joint lies clearly outside its limits (degrees in a radian column, another joint
        order), or the recorded tcp positions are elsewhere.
    """
    return (*_limits(robot, readings), *_positions(robot, readings))


def _limits(robot: Robot, readings: Readings) -> list[str]:
    margin = robot.limits.margin(readings.joint_position)
    reading, joint = np.unravel_index(int(margin.argmin()), margin.shape)
    worst, limits = float(margin[reading, joint]), robot.limits
    if worst >= 0.0:
        return []
    value = readings.joint_position[reading, joint]
    unit = "rad" if robot.revolute[joint] else "m"
    message = (
        f"{robot.joint_names[joint]} at pose {readings.pose[reading]} is {value:.4g} {unit},"
        f" outside the robot's {limits.lower[joint]:.4g} to {limits.upper[joint]:.4g} {unit}"
    )
    if limits.lower[joint] >= limits.upper[joint]:
        raise DatasetError(
            f"URDF of {robot.name} leaves {robot.joint_names[joint]} no range: its limits are"
            f" {limits.lower[joint]:g} to {limits.upper[joint]:g} {unit}"
        )
    assumed = any(assumption.field == "position" for assumption in robot.assumptions)
    if worst < -_OUTSIDE and not assumed:
        raise DatasetError(f"{message}: degrees, another joint order, or another robot?")
    return [message + (" (limits assumed, no source)" if assumed else "")]


def _positions(robot: Robot, readings: Readings) -> list[str]:
    if readings.tcp_position is None:
        return []
    computed = robot.forward(readings.joint_position)[:, :3, 3]
    recorded = readings.tcp_position + readings.controller_displacement
    distance = np.linalg.norm(computed - recorded, axis=1)
    median = float(np.median(distance))
    message = (
        f"recorded tcp_position is {1e3 * median:.1f} mm (median) from that of the joints of"
        f" {robot.name} at {robot.tip!r}"
    )
    if median > _TCP_WRONG:
        raise DatasetError(f"{message}: another tcp, joint signs, joint order or base frame?")
    return [message] if median > _TCP_OFF else []
