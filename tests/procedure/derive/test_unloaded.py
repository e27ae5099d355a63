from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elastocal.procedure.derive.readings import (
    AXIS_SHIFT,
    AXIS_TILT,
    JOINT_ERROR,
    SAG,
    robot_errors,
)
from elastocal.robot import GRAVITY, Robot
from support import plans
from support.urdfs import opw_arm_urdf

LEVER = np.array([0.1, 0.02, -0.05])
Q = np.array([[0.1, 0.3, -1.4, 1.2, 0.5, 0.8, -0.3], [-0.2, -0.4, -1.1, 1.5, -0.7, 1.0, 0.6]])


@pytest.fixture(scope="module")
def robot() -> Robot:
    return plans.robot()


def marker(robot: Robot, q: np.ndarray) -> np.ndarray:
    T = robot.forward(q)
    return T[:, :3, 3] + T[:, :3, :3] @ LEVER


def test_offsets_of_the_joints_move_the_marker_as_finite_differences_say(robot):
    found = robot_errors(robot, Q, np.array(GRAVITY), LEVER)
    for joint in range(7):
        step = np.zeros(7)
        step[joint] = 1e-6
        numeric = (marker(robot, Q + step) - marker(robot, Q - step)) / 2e-6
        np.testing.assert_allclose(found[:, :, joint], JOINT_ERROR * numeric, atol=1e-11)


def test_sag_turns_each_joint_by_its_share_of_the_largest_torque(robot):
    found = robot_errors(robot, Q, np.array(GRAVITY), LEVER)
    torque = robot.gravity_torques(Q)
    share = torque / np.abs(torque).max()
    expected = found[:, :, :7] / JOINT_ERROR * SAG * share[:, None, :]
    np.testing.assert_allclose(found[:, :, 7:14], expected, atol=1e-15)


def test_an_axis_that_sits_elsewhere_moves_the_marker_as_finite_differences_say(robot):
    """Joint 3 shifted along, and tilted about, the directions that its columns stand for."""
    found = robot_errors(robot, Q, np.array(GRAVITY), LEVER)[:, :, 14 + 5 * 3 :][:, :, :5]
    joints = robot.chain.joints
    across = np.linalg.svd(joints[3].axis[None])[2][1:]

    def moved(shift: np.ndarray, turn: np.ndarray) -> np.ndarray:
        wrong = np.eye(4)
        wrong[:3, :3], wrong[:3, 3] = Rotation.from_rotvec(turn).as_matrix(), shift
        joint = replace(joints[3], placement=joints[3].placement @ wrong)
        chain = replace(robot.chain, joints=(*joints[:3], joint, *joints[4:]))
        return marker(replace(robot, chain=chain), Q)

    for column, axis in enumerate([*np.eye(3), *across]):
        step, none = 1e-6 * axis, np.zeros(3)
        ways = [(s * step, none) if column < 3 else (none, s * step) for s in (1.0, -1.0)]
        numeric = (moved(*ways[0]) - moved(*ways[1])) / 2e-6
        likely = AXIS_SHIFT if column < 3 else AXIS_TILT
        np.testing.assert_allclose(found[:, :, column], likely * numeric, atol=1e-11)


def test_a_robot_without_masses_has_no_sag():
    massless = Robot.from_urdf(opw_arm_urdf(0.35, 0.041, 0.0, 0.675, 1.15, 1.2, 0.215), "tcp")
    if any(joint.mass > 0 for joint in massless.chain.joints):
        pytest.fail("the fixture has masses by now: use one without")
    assert robot_errors(massless, Q[:, 1:], np.array(GRAVITY), LEVER).shape == (2, 3, 6 + 5 * 6)


def test_no_pose_has_no_errors(robot):
    assert robot_errors(robot, np.empty((0, 7)), np.array(GRAVITY), LEVER).shape == (0, 3, 0)
