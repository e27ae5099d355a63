from dataclasses import replace

import numpy as np
import pytest

from elastocal.errors import DatasetError
from elastocal.identification.conventions import check_joints
from elastocal.robot import Robot
from support.problems import campaign, elastic
from support.urdfs import sliding_arm_urdf

LIMIT = np.pi
"""Of every joint of the arm, either way."""


def shifted_tcp(metres):
    readings = campaign()
    return replace(readings, tcp_position=readings.tcp_position + np.array([0.0, 0.0, metres]))


def with_joint(value, joint=2):
    readings = campaign()
    q = readings.joint_position.copy()
    q[7, joint] = value
    return replace(readings, joint_position=q, tcp_position=None)


def assumed(robot):
    text = robot.urdf.replace("</robot>", '<assumption field="position" reason="made up"/></robot>')
    return Robot.from_urdf(text, robot.tip)


def test_joints_of_this_robot_pass():
    assert check_joints(elastic().robot, campaign()) == ()


def test_readings_without_positions_pass():
    assert check_joints(elastic().robot, replace(campaign(), tcp_position=None)) == ()


def test_degrees_in_a_radian_column_are_refused():
    readings = campaign()
    degrees = replace(readings, joint_position=np.degrees(readings.joint_position))
    with pytest.raises(DatasetError, match=r"joint_\d at pose \d+ is .* rad, .*degrees"):
        check_joints(elastic().robot, degrees)


@pytest.mark.parametrize("value", [LIMIT + 0.09, -LIMIT - 0.09])
def test_a_joint_clearly_outside_its_limits_is_refused_by_name(value):
    expected = rf"joint_3 at pose 1 is {value:.4g} rad, outside the robot's -3\.142 to 3\.142 rad"
    with pytest.raises(DatasetError, match=expected):
        check_joints(elastic().robot, with_joint(value))


def test_every_joint_outside_is_named_in_one_refusal():
    readings = with_joint(LIMIT + 0.3, joint=2)
    q = readings.joint_position.copy()
    q[9, 4] = -LIMIT - 0.2
    q[9, 5] = LIMIT + 0.01
    with pytest.raises(DatasetError, match=r"joint_3 at pose 1 is .*; joint_5 at") as refused:
        check_joints(elastic().robot, replace(readings, joint_position=q))
    assert "joint_6" not in str(refused.value), "a little outside is no reason"


def test_a_rail_a_little_outside_does_not_hide_behind_an_axis():
    slider = Robot.from_urdf(sliding_arm_urdf(), "tcp")
    q = np.tile([0.0, 0.0, 0.5, 0.0, 0.0, 0.0], (155, 1))
    q[7, 2], q[9, 4] = 1.21, slider.limits.upper[4] + 0.05
    rail, axis = check_joints(slider, replace(campaign(), joint_position=q, tcp_position=None))
    assert rail.startswith("slide at pose 1 is 1.21 m")
    assert slider.joint_names[4] in axis


def test_a_joint_a_little_outside_is_worth_a_warning():
    (warning,) = check_joints(elastic().robot, with_joint(LIMIT + 0.08))
    assert warning.startswith("joint_3 at pose 1 is 3.222 rad, outside")


def test_limits_without_a_source_only_warn():
    (warning,) = check_joints(assumed(elastic().robot), with_joint(LIMIT + 0.2))
    assert warning.endswith("(limits assumed, no source)")


def test_a_sliding_joint_is_named_in_metres():
    slider = Robot.from_urdf(sliding_arm_urdf(), "tcp")
    q = np.tile([0.0, 0.0, 0.5, 0.0, 0.0, 0.0], (155, 1))
    q[7, 2] = 1.4
    with pytest.raises(DatasetError, match=r"slide at pose 1 is 1\.4 m, .*0\.2 to 1\.2 m"):
        check_joints(slider, replace(campaign(), joint_position=q, tcp_position=None))


def test_positions_far_from_the_joints_are_refused():
    with pytest.raises(DatasetError, match=r"60\.0 mm \(median\).*'tcp': another tcp, joint signs"):
        check_joints(elastic().robot, shifted_tcp(0.06))


def test_positions_somewhat_off_are_worth_a_warning():
    (warning,) = check_joints(elastic().robot, shifted_tcp(0.01))
    assert warning.startswith("recorded tcp_position is 10.0 mm (median)")


def test_positions_off_by_the_accuracy_of_an_arm_pass():
    assert check_joints(elastic().robot, shifted_tcp(0.004)) == ()


def test_the_controllers_own_displacement_belongs_to_the_position():
    readings = campaign()
    moved = replace(readings, controller_displacement=readings.controller_displacement + 0.05)
    with pytest.raises(DatasetError, match="tcp_position"):
        check_joints(elastic().robot, moved)


def test_a_single_position_that_is_wrong_does_not_count():
    readings = campaign()
    position = readings.tcp_position.copy()
    position[3] += 1.0
    assert check_joints(elastic().robot, replace(readings, tcp_position=position)) == ()
