import numpy as np
import pytest

from elastocal.errors import UnreachableError
from elastocal.sim.arm import LOAD_CASES, press_forces, press_poses, solve_inverse
from elastocal.sim.arm.linkage import pose_error
from elastocal.sim.arm.measurement import SphericalCap


def test_the_tool_touches_the_dome_along_its_normal(linkage, poses):
    cap = SphericalCap()
    up = np.array(cap.normal) / np.linalg.norm(cap.normal)
    centre = np.array(cap.apex) - cap.radius * up
    T = linkage.forward(poses.joints)
    np.testing.assert_allclose(T, poses.T_base_tcp, atol=1e-10)
    outward = (T[:, :3, 3] - centre) / cap.radius
    np.testing.assert_allclose(outward, -T[:, :3, 2], atol=1e-10)


def test_poses_stay_within_the_rim_and_apart(poses):
    points = poses.T_base_tcp[:, :3, 3]
    distance = np.linalg.norm(points[:, None] - points[None], axis=-1)
    assert distance.max() < 1.2
    assert np.min(distance + 9.0 * np.eye(len(points))) > 0.5 * 1.2 / np.sqrt(len(points))


def test_poses_respect_the_joint_limits(linkage, poses):
    assert np.all((poses.joints >= linkage.lower) & (poses.joints <= linkage.upper))


def test_the_same_seed_gives_the_same_poses_and_another_one_others(linkage, poses):
    again = press_poses(linkage, 12, np.random.default_rng(5))
    other = press_poses(linkage, 12, np.random.default_rng(6))
    np.testing.assert_array_equal(again.joints, poses.joints)
    assert np.abs(other.joints - poses.joints).max() > 0.1


def test_a_dome_out_of_reach_is_refused(linkage):
    with pytest.raises(UnreachableError, match=r"arm cannot press at .* and so for 3 of 3 points"):
        press_poses(linkage, 3, np.random.default_rng(0), SphericalCap(apex=(5.0, 0.0, 0.7)))


def test_load_cases_are_those_of_the_paper():
    T = np.eye(4)[None]
    expected = [[0, 0, -9], [7, 0, -9], [-7, 0, -9], [0, -8, -9], [0, 8, -9]]
    np.testing.assert_array_equal(press_forces(T, 7, 8, 9)[0], expected)
    assert LOAD_CASES == ("normal", "north", "south", "east", "west")


def test_forces_turn_with_the_tool(poses, forces):
    np.testing.assert_allclose(forces[:, 0], -1100.0 * poses.T_base_tcp[:, :3, 2], atol=1e-9)
    north = 0.5 * (forces[:, 1] - forces[:, 2])
    np.testing.assert_allclose(north, 280.0 * poses.T_base_tcp[:, :3, 0], atol=1e-9)


def test_reach_finds_joints_for_poses_of_the_arm_itself(linkage):
    rng = np.random.default_rng(3)
    q = np.array([0.1, -1.5, 1.6, 0.3, 0.9, -0.2]) + rng.uniform(-0.3, 0.3, (20, 6))
    found = solve_inverse(linkage, linkage.forward(q), q + rng.uniform(-0.2, 0.2, q.shape))
    assert found.ok.all()
    np.testing.assert_allclose(linkage.forward(found.q), linkage.forward(q), atol=1e-10)


def test_reach_says_which_poses_it_has_not_reached(linkage):
    q = np.tile([0.1, -1.5, 1.6, 0.3, 0.9, -0.2], (2, 1))
    goals = linkage.forward(q)
    goals[1, 0, 3] += 4.0
    assert solve_inverse(linkage, goals, q + 0.1).ok.tolist() == [True, False]


@pytest.mark.parametrize("angle", [0.0, 1e-12, 0.4, 2.0, 3.1])
def test_pose_error_is_shift_and_rotation_vector(angle):
    goal = np.eye(4)[None].copy()
    goal[0, :3, 3] = [1.0, 2.0, 3.0]
    goal[0, 1:3, 1:3] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    np.testing.assert_allclose(pose_error(np.eye(4)[None], goal)[0], [1, 2, 3, angle, 0, 0])
