"""Measures of the distance to singularity."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elastocal.errors import RobotError
from elastocal.robot import Robot, characteristic_length, smallest_singular_value, wrist_angle
from elastocal.robot.singularity import scaled_singular_values
from support.urdfs import (
    KR_LIKE,
    offset_wrist_urdf,
    opw_arm_urdf,
    planar_arm_urdf,
    sliding_arm_urdf,
)

ARM = Robot.from_urdf(opw_arm_urdf(**KR_LIKE), "tcp")
STRETCH = -np.arctan2(KR_LIKE["a2"], KR_LIKE["c3"])
REGULAR = np.array([0.3, -0.4, 1.0, 0.5, 0.8, -0.2])


def _at(**joints: float) -> np.ndarray:
    q = REGULAR.copy()
    for name, value in joints.items():
        q[int(name[1]) - 1] = value
    return q


def _finite_difference_jacobian(robot: Robot, q: np.ndarray, length: float) -> np.ndarray:
    step, columns = 1e-6, []
    for index in range(len(q)):
        delta = step * (np.arange(len(q)) == index)
        ahead, behind = robot.forward(q + delta), robot.forward(q - delta)
        turn = Rotation.from_matrix(ahead[:3, :3] @ behind[:3, :3].T).as_rotvec()
        columns.append(np.concatenate([(ahead - behind)[:3, 3] / length, turn]) / (2 * step))
    return np.array(columns).T


class TestSingularValues:
    def test_they_are_those_of_the_finite_difference_jacobian(self):
        J = _finite_difference_jacobian(ARM, REGULAR, 0.7)
        expected = np.linalg.svd(J, compute_uv=False)
        np.testing.assert_allclose(scaled_singular_values(ARM, REGULAR, 0.7), expected, atol=1e-8)
        assert smallest_singular_value(ARM, REGULAR, 0.7) == pytest.approx(expected[-1], abs=1e-8)

    @pytest.mark.parametrize(
        "q",
        [
            _at(q5=0.0),
            _at(q5=np.pi),
            _at(q3=STRETCH),
            _at(q3=np.pi + STRETCH),
        ],
        ids=["wrist straight", "wrist folded", "elbow stretched", "elbow folded"],
    )
    def test_the_smallest_is_zero_at_a_singularity(self, q):
        assert smallest_singular_value(ARM, REGULAR) > 0.05
        assert smallest_singular_value(ARM, q) < 1e-12

    def test_the_smallest_is_zero_with_the_wrist_centre_on_axis_1(self):
        forearm = np.hypot(KR_LIKE["a2"], KR_LIKE["c3"])
        reach = KR_LIKE["a1"] + KR_LIKE["c2"] * np.sin(-0.4)
        q = _at(q2=-0.4, q3=np.arcsin(-reach / forearm) + STRETCH + 0.4)
        assert smallest_singular_value(ARM, q) < 1e-12

    def test_leading_axes_are_kept(self):
        q = np.tile(REGULAR, (2, 3, 1))
        assert scaled_singular_values(ARM, q).shape == (2, 3, 6)
        assert smallest_singular_value(ARM, q).shape == (2, 3)
        assert wrist_angle(ARM, q).shape == (2, 3)

    def test_a_rail_does_not_hide_a_singular_wrist(self):
        robot = Robot.from_urdf(opw_arm_urdf(**KR_LIKE, rail=(-1.0, 1.0)), "tcp")
        q = np.concatenate([[0.3], _at(q5=0.0)])
        assert smallest_singular_value(robot, q, 1.0) < 1e-12

    def test_a_robot_of_twice_the_size_is_as_far_from_singular(self):
        double = {name: 2.0 * value for name, value in KR_LIKE.items()}
        robot = Robot.from_urdf(opw_arm_urdf(**double), "tcp")
        values = scaled_singular_values(robot, REGULAR)
        np.testing.assert_allclose(values, scaled_singular_values(ARM, REGULAR), rtol=1e-12)

    @pytest.mark.parametrize("length", [0.0, -1.0, np.nan, np.inf])
    def test_a_length_that_is_none_is_refused(self, length):
        with pytest.raises(RobotError, match="must be positive and finite"):
            smallest_singular_value(ARM, REGULAR, length)


class TestCharacteristicLength:
    def test_of_a_link_that_two_axes_turn_is_its_length(self):
        robot = Robot.from_urdf(planar_arm_urdf([0.0, 0.8]), "tcp")
        assert characteristic_length(robot) == pytest.approx(0.8)

    def test_of_two_links_is_their_root_mean_square_distance(self):
        # Axis 2 sees 0.6 always; axis 1 sees 1 + 0.36 + 1.2 cos(q2), of mean 1.36 squared.
        robot = Robot.from_urdf(planar_arm_urdf([1.0, 0.6]), "tcp")
        assert characteristic_length(robot) == pytest.approx(np.sqrt((1.36 + 0.36) / 2), rel=0.05)

    def test_does_not_depend_on_the_rail(self):
        robot = Robot.from_urdf(sliding_arm_urdf(), "tcp")
        assert 0.2 < characteristic_length(robot) < 1.4

    def test_is_refused_when_the_tool_is_on_all_axes(self):
        robot = Robot.from_urdf(planar_arm_urdf([0.0, 0.0]), "tcp")
        with pytest.raises(RobotError, match="planar_arm has no characteristic length"):
            characteristic_length(robot)


class TestWristAngle:
    @pytest.mark.parametrize(("q5", "angle"), [(0.3, 0.3), (-0.3, 0.3), (2.0, np.pi - 2.0)])
    def test_it_is_the_bend_of_joint_5_folded_to_a_right_angle(self, q5, angle):
        assert wrist_angle(ARM, _at(q5=q5)) == pytest.approx(angle)

    def test_it_does_not_depend_on_the_zero_of_joint_5(self):
        robot = Robot.from_urdf(opw_arm_urdf(**KR_LIKE, offsets=(0, 0, 0, 0, 0.5, 0)), "tcp")
        assert wrist_angle(robot, _at(q5=0.3)) == pytest.approx(0.8)

    def test_it_keeps_its_digits_near_zero(self):
        assert wrist_angle(ARM, _at(q5=1e-9)) == pytest.approx(1e-9, rel=1e-6)

    def test_it_is_defined_for_an_offset_wrist(self):
        robot = Robot.from_urdf(offset_wrist_urdf(rail=(-1.0, 1.0)), "tcp")
        assert wrist_angle(robot, np.concatenate([[0.1], _at(q5=0.4)])) == pytest.approx(0.4)

    def test_it_is_refused_without_a_wrist(self):
        with pytest.raises(RobotError, match="planar_arm has no wrist angle"):
            wrist_angle(Robot.from_urdf(planar_arm_urdf(), "tcp"), np.zeros(3))
