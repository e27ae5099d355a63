"""Tools and rails: what is written reads back, and what cannot be is refused by name."""

import math

import numpy as np
import pytest

from elastocal.errors import RobotError
from elastocal.robot import (
    Rail,
    Robot,
    T_from_xyzabc,
    catalogue,
    on_rail,
    with_tool,
    with_tool_mass,
    without_tool_mass,
)
from support.urdfs import KR_LIKE, opw_arm_urdf

ARM = opw_arm_urdf(**KR_LIKE)
Q = np.radians([20.0, -70.0, 95.0, 30.0, 40.0, -110.0])
T_TOOL = T_from_xyzabc(0.15, -0.02, 0.35, 0.3, -0.8, 2.1)


def random_transforms(count: int) -> np.ndarray:
    rng = np.random.default_rng(3)
    angles = rng.uniform(-math.pi, math.pi, (3, count))
    angles[1, : count // 4] = math.pi / 2
    angles[1, count // 4 : count // 2] = -math.pi / 2
    return T_from_xyzabc(*rng.uniform(-1.0, 1.0, (3, count)), *angles)


class TestWithTool:
    def test_tool_frame_reads_back_to_rounding_at_the_gimbal_too(self):
        flange = Robot.from_urdf(ARM, "tcp").forward(Q)
        for T in random_transforms(40):
            tip = Robot.from_urdf(with_tool(ARM, "tcp", "tool", T), "tool").forward(Q)
            np.testing.assert_allclose(tip, flange @ T, atol=1e-12)

    def test_tool_of_a_catalogue_robot_follows_its_flange(self):
        name = "KR 300 R2500 ultra"
        robot = Robot.from_urdf(with_tool(catalogue.urdf(name), "flange", "tcp", T_TOOL), "tcp")
        expected = catalogue.load(name).forward(Q) @ T_TOOL
        np.testing.assert_allclose(robot.forward(Q), expected, atol=1e-12)

    def test_assumptions_and_source_comments_stay(self):
        name = "KR 300 R2500 ultra"
        text = with_tool(catalogue.urdf(name), "flange", "tcp", T_TOOL)
        assert Robot.from_urdf(text, "tcp").assumptions == catalogue.load(name).assumptions
        assert catalogue.entry(name).sources["dimension"] in text

    def test_tools_can_be_stacked(self):
        text = with_tool(with_tool(ARM, "tcp", "sensor", T_TOOL), "sensor", "tip", T_TOOL)
        expected = Robot.from_urdf(ARM, "tcp").forward(Q) @ T_TOOL @ T_TOOL
        np.testing.assert_allclose(Robot.from_urdf(text, "tip").forward(Q), expected, atol=1e-12)

    def test_a_mass_is_weighed_and_taken_off_again(self):
        heavy = with_tool(ARM, "tcp", "tool", T_TOOL, 12.0, (0.01, 0.02, -0.1))
        bare = Robot.from_urdf(with_tool(ARM, "tcp", "tool", T_TOOL), "tool")
        robot = Robot.from_urdf(heavy, "tool")
        masses = [sum(j.mass for j in each.chain.joints) for each in (robot, bare)]
        assert masses[0] - masses[1] == pytest.approx(12.0)
        light = Robot.from_urdf(without_tool_mass(heavy, "tool"), "tool")
        assert sum(j.mass for j in light.chain.joints) == pytest.approx(masses[1])
        np.testing.assert_allclose(light.forward(Q), robot.forward(Q), atol=1e-12)

    def test_the_mass_of_a_link_of_the_arm_stays(self):
        name = "KR 300 R2500 ultra"
        urdf = catalogue.urdf(name)
        last = Robot.from_urdf(urdf, "flange")
        kept = Robot.from_urdf(without_tool_mass(urdf, "link_6"), "flange")
        assert [j.mass for j in kept.chain.joints] == [j.mass for j in last.chain.joints]

    def test_missing_parent_is_refused_with_the_nearest_link(self):
        with pytest.raises(RobotError, match=r"no link 'link_66'.*did you mean 'link_6'\?"):
            with_tool(ARM, "link_66", "tool", T_TOOL)

    def test_taken_link_name_is_refused(self):
        with pytest.raises(RobotError, match="cannot get a link 'tcp': the name must be new"):
            with_tool(ARM, "link_6", "tcp", T_TOOL)

    def test_taken_joint_name_is_refused(self):
        text = ARM.replace('joint name="tool"', 'joint name="probe_joint"')
        with pytest.raises(RobotError, match="cannot get a joint 'probe_joint'"):
            with_tool(text, "tcp", "probe", T_TOOL)

    @pytest.mark.parametrize(
        ("T", "message"),
        [
            (np.eye(3), r"must be 4x4 finite numbers, has shape \(3, 3\)"),
            (np.full((4, 4), np.nan), "must be 4x4 finite numbers"),
            (np.diag([1.0, 1.0, -1.0, 1.0]), "not a rotation and a translation: off by 2"),
            (np.diag([2.0, 0.5, 1.0, 1.0]), "not a rotation and a translation: off by"),
            (np.eye(4) + np.eye(4, k=-3), "not a rotation and a translation: off by 1"),
        ],
    )
    def test_transform_that_is_not_rigid_is_refused(self, T, message):
        with pytest.raises(RobotError, match=message):
            with_tool(ARM, "tcp", "tool", T)

    def test_text_that_is_no_urdf_is_refused(self):
        with pytest.raises(RobotError, match="not valid XML"):
            with_tool("<robot", "tcp", "tool", T_TOOL)


class TestWithToolMass:
    def test_its_weight_acts_at_the_centre_given(self):
        robot = Robot.from_urdf(ARM, "tcp")
        weighed = Robot.from_urdf(with_tool_mass(ARM, "tcp", 40.0, (0.0, 0.1, 0.2)), "tcp")
        behind = Robot.from_urdf(
            with_tool(ARM, "tcp", "centre", T_from_xyzabc(0.0, 0.1, 0.2, 0.0, 0.0, 0.0)), "centre"
        )
        weight = behind.jacobian(Q).translation.T @ [0.0, 0.0, -9.80665 * 40.0]
        more = weighed.gravity_torques(Q)
        if robot.has_masses:
            more = more - robot.gravity_torques(Q)
        np.testing.assert_allclose(more, -weight, atol=1e-9)
        np.testing.assert_array_equal(weighed.forward(Q), robot.forward(Q))

    def test_no_mass_leaves_the_text(self):
        assert with_tool_mass(ARM, "tcp", 0.0, np.zeros(3)) == ARM

    def test_a_link_that_is_not_there_or_weighed_already_is_refused(self):
        with pytest.raises(RobotError, match=r"link 'tcq': no such link"):
            with_tool_mass(ARM, "tcq", 1.0, np.zeros(3))
        with pytest.raises(RobotError, match=r"link 'tcp': a mass already"):
            with_tool_mass(with_tool_mass(ARM, "tcp", 1.0, np.zeros(3)), "tcp", 1.0, np.zeros(3))


class TestOnRail:
    def test_travel_moves_the_robot_along_the_rails_axis(self):
        axis = np.array([0.6, -0.8, 0.0])
        rail = Rail("joint_e1", 5.0 * axis, -1.0, 4.0, T_TOOL)
        robot = Robot.from_urdf(on_rail(ARM, rail), "tcp")
        assert robot.base == "joint_e1_base"
        assert robot.joint_names[0] == "joint_e1"
        assert robot.external_axes == 1
        expected = T_TOOL @ Robot.from_urdf(ARM, "tcp").forward(Q)
        expected[:3, 3] += 1.5 * axis
        np.testing.assert_allclose(robot.forward([1.5, *Q]), expected, atol=1e-12)

    def test_limits_of_the_rail_are_those_of_the_first_joint(self):
        limits = Robot.from_urdf(on_rail(ARM, Rail("e1", [1, 0, 0], -1.0, 4.0)), "tcp").limits
        assert (limits.lower[0], limits.upper[0]) == (-1.0, 4.0)
        assert math.isnan(limits.velocity[0])
        assert math.isnan(limits.effort[0])

    def test_known_speed_and_force_are_written(self):
        rail = Rail("e1", [1, 0, 0], -1.0, 4.0, velocity=1.89, effort=702.0)
        limits = Robot.from_urdf(on_rail(ARM, rail), "tcp").limits
        assert (limits.velocity[0], limits.effort[0]) == (1.89, 702.0)

    def test_robot_can_still_be_read_without_its_rail(self):
        text = on_rail(ARM, Rail("e1", [0, 1, 0], 0.0, 3.0, T_TOOL))
        robot = Robot.from_urdf(text, "tcp", base="base")
        expected = Robot.from_urdf(ARM, "tcp").forward(Q)
        np.testing.assert_allclose(robot.forward(Q), expected, atol=1e-12)

    def test_rail_does_not_see_later_changes_of_its_arrays(self):
        axis = np.array([1.0, 0.0, 0.0])
        rail = Rail("e1", axis, 0.0, 1.0)
        axis[:] = 0.0
        np.testing.assert_array_equal(rail.axis, [1.0, 0.0, 0.0])
        with pytest.raises(ValueError, match="read-only"):
            np.asarray(rail.T_rail_base)[0, 0] = 2.0

    def test_two_rails_of_one_name_are_refused(self):
        rail = Rail("e1", [1, 0, 0], 0.0, 1.0)
        with pytest.raises(RobotError, match="cannot get a link 'e1_base'"):
            on_rail(on_rail(ARM, rail), rail)

    @pytest.mark.parametrize("axis", [[0, 0, 0], [1, 0], [math.nan, 0, 1], [math.inf, 0, 0]])
    def test_axis_without_a_direction_is_refused(self, axis):
        with pytest.raises(RobotError, match="of rail 'e1' must be 3 finite numbers"):
            Rail("e1", axis, 0.0, 1.0)

    @pytest.mark.parametrize(
        ("lower", "upper"), [(1.0, 1.0), (2.0, 1.0), (math.nan, 1.0), (0.0, math.inf)]
    )
    def test_travel_without_length_is_refused(self, lower, upper):
        with pytest.raises(RobotError, match="rail 'e1' travels from"):
            Rail("e1", [1, 0, 0], lower, upper)
