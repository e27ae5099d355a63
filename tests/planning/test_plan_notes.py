"""What a plan says of its cell beside the poses."""

from dataclasses import replace

import numpy as np

from elastocal.planning.plan import unjudged_limits
from elastocal.robot import Robot
from support.simulated import example_cell
from support.urdfs import planar_arm_urdf


def test_an_arm_without_a_wrist_is_not_judged_by_the_wrist_angle_and_that_is_noted():
    cell = example_cell("machining")
    planar = Robot.from_urdf(planar_arm_urdf(), "tcp")
    limits = np.full(len(planar.joint_names), 100.0)
    (note,) = unjudged_limits(replace(cell, robot=planar, torque_limits=limits))
    assert note.startswith("limits.wrist_angle is not judged")
    assert planar.name in note


def test_joints_without_a_torque_are_named():
    cell = example_cell("machining")
    limits = np.where(np.arange(6) == 2, np.nan, cell.torque_limits)
    assert unjudged_limits(cell) == []
    assert unjudged_limits(replace(cell, torque_limits=limits)) == [
        "torques of joint_a3 are not known and not judged"
    ]
