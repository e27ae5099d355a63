import numpy as np
import pytest

from elastocal.robot import Robot, link_gap, same_joints, tcp_gap, tool_gap
from elastocal.robot.identity import Gap
from support.cells import robot, urdf


def changed(before: str, after: str) -> Robot:
    assert before in urdf()
    return Robot.from_urdf(urdf().replace(before, after), "tcp")


def test_a_longer_tool_is_another_tool_of_the_same_arm():
    other = changed("0.15 0.0 0.565", "0.16 0.0 0.565")
    assert same_joints(robot(), other)
    assert link_gap(robot(), other).closed
    for gap in (tool_gap(robot(), other), tcp_gap(robot(), other)):
        assert gap.distance == pytest.approx(0.01)
        assert not gap.closed


def test_a_longer_arm_is_another_robot_with_the_same_tool():
    other = changed("1.15", "1.17")
    assert tool_gap(robot(), other).closed
    assert link_gap(robot(), other).distance == pytest.approx(0.02)
    assert str(link_gap(robot(), other)).startswith("20 mm and ")


def test_joints_of_other_names_are_not_the_same():
    assert not same_joints(robot(), changed('"joint_3"', '"elbow"'))


def test_the_angle_of_a_gap_is_that_of_the_rotation_between():
    turned = np.eye(4)
    angle = 0.3
    turned[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    assert Gap.between(np.eye(4), turned).angle == pytest.approx(angle, rel=1e-12)
    assert not Gap.between(np.eye(4), turned).closed


def test_a_gap_that_is_not_a_number_is_not_closed():
    assert not Gap(float("nan"), 0.0).closed
