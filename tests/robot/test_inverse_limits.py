"""Whole turns and limits."""

import numpy as np
import pytest

from elastocal.errors import RobotError
from elastocal.robot import Robot
from elastocal.robot.inverse import turns
from elastocal.robot.inverse.arm import nearest_zero
from elastocal.robot.inverse.opw import OpwInverse
from support.urdfs import HALF_TURN, KR_LIKE, opw_arm_urdf, sliding_arm_urdf

KUKA = np.radians(350.0)
LIMITS = (HALF_TURN, HALF_TURN, HALF_TURN, (-KUKA, KUKA), (-2.1, 2.1), (-KUKA, KUKA))


def _robot(limits=LIMITS, **options) -> Robot:
    return Robot.from_urdf(opw_arm_urdf(**KR_LIKE, limits=limits, **options), "tcp")


class TestNearestZero:
    def test_whole_turns_are_taken_off(self):
        q = np.array([0.1, -0.2, 0.3, 3.5, 0.5, -4.0])
        expected = [0.1, -0.2, 0.3, 3.5 - 2 * np.pi, 0.5, -4.0 + 2 * np.pi]
        np.testing.assert_allclose(nearest_zero(_robot(), q), expected, atol=1e-15)

    def test_half_a_turn_is_taken_as_plus(self):
        q = np.array([0.0, 0.0, 0.0, -np.pi, 0.0, -np.pi + 1e-12])
        np.testing.assert_allclose(nearest_zero(_robot(), q)[[3, 5]], np.pi, atol=1e-11)

    def test_the_nearest_within_the_limits_is_taken(self):
        robot = _robot([*LIMITS[:5], (2.0, 9.0)])
        assert nearest_zero(robot, np.zeros(6))[5] == pytest.approx(2 * np.pi)
        assert nearest_zero(robot, [0, 0, 0, 0, 0, 2.5])[5] == pytest.approx(2.5)

    def test_a_joint_that_cannot_be_brought_inside_empties_the_configuration(self):
        assert np.isnan(nearest_zero(_robot(), [0, 0, 0, 0, 2.2, 0])).all()

    def test_a_position_on_its_limit_up_to_round_off_is_put_on_it(self):
        assert nearest_zero(_robot(), [0, 0, 0, 0, 2.1 + 1e-11, 0])[4] == 2.1
        assert np.isnan(nearest_zero(_robot(), [0, 0, 0, 0, 2.1 + 1e-8, 0])).all()

    def test_a_slide_does_not_turn(self):
        robot = Robot.from_urdf(sliding_arm_urdf(), "tcp")
        assert np.isnan(nearest_zero(robot, [0, 0, 0.5 + 2 * np.pi, 0, 0, 0])).all()


class TestTurns:
    def test_two_joints_of_350_degrees_reach_a_pose_in_four_ways(self):
        robot, q = _robot(), np.array([0.1, 0.2, 0.3, 1.0, 0.5, -1.0])
        ways = turns(robot, q)
        assert len(ways) == 4
        np.testing.assert_array_equal(ways[0], q)
        assert robot.limits.margin(ways).min() >= 0.0
        np.testing.assert_allclose(robot.forward(ways), np.tile(robot.forward(q), (4, 1, 1)))

    def test_each_branch_is_solved_once_and_its_turns_are_all_solutions(self):
        robot = _robot()
        q = np.array([0.1, 0.2, 1.3, -3.5, 0.5, 5.0])
        solved = OpwInverse(robot).solve(robot.forward(q))
        ways = np.concatenate([turns(robot, row) for row in solved])
        assert np.abs(ways - q).max(axis=1).min() < 1e-9

    def test_none_is_left_outside_the_limits(self):
        assert turns(_robot(), [0, 0, 0, 0, 2.2, 0]).shape == (0, 6)

    def test_one_turn_away_from_the_limits_is_brought_back(self):
        q = [0.1 + 2 * np.pi, 0, 0, 0, 0, 0]
        assert turns(_robot(), q)[0, 0] == pytest.approx(0.1)

    def test_a_joint_without_limits_keeps_its_position(self):
        text = opw_arm_urdf(**KR_LIKE).replace(
            'name="joint_6" type="revolute"', 'name="joint_6" type="continuous"'
        )
        ways = turns(Robot.from_urdf(text, "tcp"), [0, 0, 0, 0, 0, 40.0])
        np.testing.assert_array_equal(ways, [[0, 0, 0, 0, 0, 40.0]])

    def test_more_than_can_be_listed_are_refused(self):
        robot = _robot([(-1e6, 1e6), *LIMITS[1:]])
        with pytest.raises(RobotError, match="the limits of joint_1 are too wide"):
            turns(robot, np.zeros(6))

    def test_many_configurations_at_once_are_refused(self):
        with pytest.raises(RobotError, match="must be one configuration"):
            turns(_robot(), np.zeros((2, 6)))
