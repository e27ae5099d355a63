"""The usual ways of reading data otherwise than the conventions say (spec section 6).

A new one is a function that undoes it and an entry in `MISTAKES`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.dataset import Readings
from elastocal.robot import Robot

_Undo = Callable[[Robot, Readings], Readings]


@dataclass(frozen=True)
class Mistake:
    """A way of reading the data that differs from the conventions."""

    message: str
    undo: _Undo
    """Returns the readings as they would be if the mistake had been made."""
    six_axes: bool = False
    """Whether it concerns joints by number and so arms of six axes or more."""


def mistakes_of(robot: Robot) -> tuple[Mistake, ...]:
    """Return the mistakes that are possible with a robot, the likeliest first."""
    six = len(robot.joint_names) >= 6
    return tuple(mistake for mistake in MISTAKES if six or not mistake.six_axes)


def _turn_force(_: Robot, readings: Readings) -> Readings:
    return _with_wrench(readings, -readings.force, _negative(readings.moment))


def _from_tcp_frame(robot: Robot, readings: Readings) -> Readings:
    return _rotated(readings, robot.forward(readings.joint_position)[:, :3, :3])


def _from_last_link_frame(robot: Robot, readings: Readings) -> Readings:
    R_base_tcp = robot.forward(readings.joint_position)[:, :3, :3]
    return _rotated(readings, R_base_tcp @ robot.chain.T_last_tip[:3, :3].T)


def _turn_roll_joints(robot: Robot, readings: Readings) -> Readings:
    """Turn the sign of the first, fourth and sixth joint of the arm."""
    signs = np.ones(len(robot.joint_names))
    signs[[robot.external_axes + index for index in (0, 3, 5) if index < len(signs)]] = -1.0
    return replace(readings, joint_position=readings.joint_position * signs)


def _uncouple(robot: Robot, readings: Readings, sign: float) -> Readings:
    """Return joints whose third one was recorded relative to the horizontal."""
    q = readings.joint_position.copy()
    second, third = robot.external_axes + 1, robot.external_axes + 2
    q[:, third] = sign * q[:, third] - q[:, second]
    return replace(readings, joint_position=q)


def _reverse_joints(_: Robot, readings: Readings) -> Readings:
    return replace(readings, joint_position=readings.joint_position[:, ::-1])


def _both(first: _Undo, second: _Undo) -> _Undo:
    return lambda robot, readings: second(robot, first(robot, readings))


MISTAKES = (
    Mistake(
        "the force (or the displacement) has its sign turned: elastocal takes the force on the"
        " robot, and deflection = marker minus controller displacement",
        _turn_force,
    ),
    Mistake("the forces are in the tcp frame, not in base", _from_tcp_frame),
    Mistake(
        "the forces are in the tcp frame with their sign turned",
        _both(_from_tcp_frame, _turn_force),
    ),
    Mistake("the forces are in the sensor (last link) frame, not in base", _from_last_link_frame),
    Mistake(
        "the forces are in the sensor (last link) frame with their sign turned",
        _both(_from_last_link_frame, _turn_force),
    ),
    Mistake(
        "joints 1, 4 and 6 of the arm turn the other way round than in the URDF (KUKA's A1, A4,"
        " A6 turn clockwise)",
        _turn_roll_joints,
        six_axes=True,
    ),
    Mistake(
        "the third joint is coupled to the second as on FANUC controllers: use -(q2 + q3)",
        lambda robot, readings: _uncouple(robot, readings, -1.0),
        six_axes=True,
    ),
    Mistake(
        "the third joint is measured against the horizontal: use q3 - q2",
        lambda robot, readings: _uncouple(robot, readings, 1.0),
        six_axes=True,
    ),
    Mistake("the joints are in reverse order", _reverse_joints, six_axes=True),
)
"""Every mistake that is tried, the likeliest first."""


def _rotated(readings: Readings, R: FloatArray) -> Readings:
    moment = readings.moment
    turned = None if moment is None else np.einsum("rij,rj->ri", R, moment)
    return _with_wrench(readings, np.einsum("rij,rj->ri", R, readings.force), turned)


def _with_wrench(readings: Readings, force: FloatArray, moment: FloatArray | None) -> Readings:
    return replace(readings, force=force, moment=moment)


def _negative(array: FloatArray | None) -> FloatArray | None:
    return None if array is None else -array
