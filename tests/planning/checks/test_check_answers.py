"""Known answers of the checks."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from elastocal.planning import CollisionScene
from elastocal.planning.checks import (
    CollisionCheck,
    FrictionCheck,
    JointLimitsCheck,
    SensorCheck,
    SightCheck,
    Station,
    TorqueCheck,
    TravelLimitsCheck,
    WristCheck,
)
from elastocal.planning.checks.collision import _DISTANCES_BEYOND
from elastocal.planning.postures import Postures
from elastocal.robot import Rail, Robot, on_rail
from elastocal.shapes import Body, Box, Sphere
from support.postures import FORCE_TCP, arm, postures

NO_TOOL = (0.0, np.zeros(3))


def test_a_collision_check_says_which_distances_it_tries():
    *some, most = (f"{1e3 * distance:g}" for distance in _DISTANCES_BEYOND)
    assert f"{', '.join(some)} and {most} mm" in CollisionCheck.__doc__


def test_friction_is_what_holds_less_what_pulls():
    # 0.5 * 1100 / 1.25 - 280
    check = FrictionCheck(FORCE_TCP, 0.5, 1.25)
    assert check.margin(postures())[0] == pytest.approx(160.0)
    assert FrictionCheck(FORCE_TCP, 0.25, 1.0).margin(postures())[0] == pytest.approx(-5.0)


def test_joint_limits_look_at_contact_and_approach():
    one = postures().take([0])
    limits = arm().limits
    both = min(limits.margin(one.q).min(), limits.margin(one.q_approach).min())
    assert JointLimitsCheck(arm(), 0.1).margin(one)[0] == pytest.approx(both - 0.1)


def test_the_wrist_angle_is_that_of_joint_five():
    margin = WristCheck(arm(), 0.0).margin(postures())
    folded = np.abs(postures().q[:, 4])
    np.testing.assert_allclose(margin, np.minimum(folded, np.pi - folded), atol=1e-9)


def test_torques_do_the_work_of_the_loads_backwards():
    """Virtual work: tau . dq = -(f . dp), with gravity off."""
    check = TorqueCheck(arm(), FORCE_TCP[1:2], np.ones(6), *NO_TOOL, gravity=(0.0, 0.0, 0.0))
    few = postures().take([0, 5])
    step = 1e-6 * np.array([1.0, -2.0, 1.5, 0.5, -1.0, 2.0])
    moved = arm().forward(few.q + step)[:, :3, 3] - arm().forward(few.q - step)[:, :3, 3]
    force = few.T_base_tcp[:, :3, :3] @ FORCE_TCP[1]
    work = np.sum(force * moved, axis=1)
    np.testing.assert_allclose(check.torques(few)[0] @ (2.0 * step), -work, rtol=1e-6)


def test_the_tool_weighs_on_the_joints_like_a_force_at_its_centre():
    centre = np.array([0.1, 0.0, -0.2])
    light = TorqueCheck(arm(), 0.0 * FORCE_TCP[:1], np.ones(6), 0.0, centre)
    heavy = TorqueCheck(arm(), 0.0 * FORCE_TCP[:1], np.ones(6), 50.0, centre)
    few = postures().take([0, 5])
    extra = (heavy.torques(few) - light.torques(few))[0]
    step = 1e-6 * np.eye(6)
    for column in range(6):
        height = []
        for sign in (1.0, -1.0):
            T = arm().forward(few.q + sign * step[column])
            height.append((T[:, :3, :3] @ centre + T[:, :3, 3])[:, 2])
        slope = (height[0] - height[1]) / 2e-6
        np.testing.assert_allclose(extra[:, column], 50.0 * 9.80665 * slope, atol=1e-3)


def test_unknown_torques_are_not_judged_and_said_so():
    allowed = np.array([np.nan, 9000.0, np.nan, np.nan, np.nan, np.nan])
    assert TorqueCheck(arm(), FORCE_TCP, allowed, *NO_TOOL).judged == ("joint_a2",)
    nothing = TorqueCheck(arm(), FORCE_TCP, np.full(6, np.nan), *NO_TOOL)
    assert nothing.judged == ()


def test_the_torque_of_the_unloaded_arm_counts_too():
    """A push from below relieves the arm: what is worst is then its own weight."""
    few = postures().take(np.arange(10))
    lifting = TorqueCheck(arm(), FORCE_TCP[:1], np.full(6, 9000.0), 60.0, np.zeros(3))
    unloaded = TorqueCheck(arm(), 0.0 * FORCE_TCP[:1], np.full(6, 9000.0), 60.0, np.zeros(3))
    loaded_alone = 1.0 - np.abs(lifting.torques(few)).max(axis=(0, 2)) / 9000.0
    assert np.any(unloaded.margin(few) < loaded_alone - 0.01)
    np.testing.assert_array_less(lifting.margin(few), unloaded.margin(few) + 1e-12)


def test_the_torque_at_the_approach_pose_counts_too():
    few = postures().take(np.arange(5))
    away = Postures(few.T_base_tcp, few.normal, few.q_approach, few.q_approach, few.point)
    check = TorqueCheck(arm(), 0.0 * FORCE_TCP[:1], np.full(6, 9000.0), 0.0, np.zeros(3))
    here = Postures(few.T_base_tcp, few.normal, few.q, few.q, few.point)
    both = np.minimum(check.margin(here), check.margin(away))
    np.testing.assert_allclose(check.margin(few), both)


def test_the_sensor_feels_the_lever_arm():
    T = np.eye(4)
    T[2, 3] = 0.45
    check = SensorCheck(np.array([[500.0, 0, -1500]]), T, np.full(3, 1e9), np.full(3, 300.0))
    # 500 N * 0.45 m = 225 N·m of 300
    assert check.margin(postures())[0] == pytest.approx(0.25)


def test_a_post_in_the_way_is_a_collision_and_named():
    one = postures().take([0])
    inside = np.eye(4)
    T_base_tcp = one.T_base_tcp[0]
    inside[:3, 3] = T_base_tcp[:3, :3] @ [-0.15, 0.0, -0.55] + T_base_tcp[:3, 3]
    obstacles = (Body("post", Box(0.3, 0.3, 0.3), inside),)
    scene = CollisionScene(arm(), (), obstacles)
    assert CollisionCheck(scene, 0.01, 0.1, 0.003).margin(one)[0] < 0.0
    assert "post" in scene.nearest(one.q[0])


def test_in_contact_the_tool_may_touch_what_it_presses_on():
    one = postures().take([0])
    here = np.eye(4)
    here[:3, 3] = one.contact[0]
    tool = (Body("disk", Sphere(0.02), np.eye(4)),)
    mould = (Body("mould", Sphere(0.02), here),)
    pressed = CollisionScene(arm(), tool, mould, frozenset({"mould"}))
    assert pressed.keeps(one.q, 0.01, -np.inf)[0]
    assert not pressed.keeps(one.q, 0.0)[0]
    assert pressed.keeps(one.q_approach, 0.01)[0]


def test_a_tool_that_stands_in_the_tooling_is_a_collision():
    """Wider than the disk and longer than the stem: 20 mm deep when the tcp touches."""
    one = postures().take([0])
    mould = np.eye(4)
    mould[:3, :3] = one.T_base_tcp[0, :3, :3]
    mould[:3, 3] = one.contact[0] + 0.1 * one.T_base_tcp[0, :3, 2]
    block = (Body("mould", Box(0.4, 0.4, 0.2), mould),)

    def margin(depth):
        head = np.eye(4)
        head[:3, 3] = (0.0, 0.0, depth - 0.05)
        tool = (Body("head", Box(0.1, 0.1, 0.1), head),)
        scene = CollisionScene(arm(), tool, block, frozenset({"mould"}))
        return CollisionCheck(scene, 1e-3, 0.1, 0.003).margin(one)[0]

    assert margin(-0.002) > 0.0
    assert margin(0.002) > 0.0
    assert margin(0.020) < 0.0


def test_what_hangs_on_the_first_joint_must_keep_clear_of_fixtures():
    shoulder = np.eye(4)
    shoulder[:3, 3] = (0.25, 0.0, 0.5)
    post = (Body("post", Box(0.1, 0.1, 0.1), shoulder),)
    scene = CollisionScene(arm(), (), post)
    assert not np.any(scene.keeps(postures().q, 0.0))


def test_travel_limits_look_at_the_rail_alone():
    robot = Robot.from_urdf(on_rail(arm().urdf, Rail("rail", (0.0, 1.0, 0.0), -0.3, 0.3)), "tcp")
    few = postures().take([0, 1])
    rail = np.array([[0.29], [-0.1]])
    there = replace(few, q=np.hstack([rail, few.q]), q_approach=np.hstack([rail, few.q_approach]))
    np.testing.assert_allclose(TravelLimitsCheck(robot, 0.0).margin(there), [0.01, 0.2])
    alone = JointLimitsCheck(arm(), 0.05).margin(few)
    np.testing.assert_allclose(JointLimitsCheck(robot, 0.05).margin(there), alone)


def test_what_is_kept_is_the_exact_distance():
    away = np.eye(4)
    away[:3, 3] = (1.2, 1.2, 0.8)
    scene = CollisionScene(arm(), (), (Body("post", Box(0.3, 0.3, 0.3), away),))
    exact = scene.distances(postures().q).min(axis=1)
    for distance in (0.01, 0.1, 0.3):
        decided = np.abs(exact - distance) > 1e-4
        kept = scene.keeps(postures().q, distance)
        np.testing.assert_array_equal(kept[decided], exact[decided] > distance)


class TestSight:
    marker, axis = np.array([0.0, 0.0, -0.1]), np.array([0.0, 0.0, -1.0])

    def station(self, away=3.0, **changes):
        one = postures().take([0])
        R, p = one.T_base_tcp[0, :3, :3], one.contact[0]
        position = p + R @ (self.marker + away * self.axis)
        fields = {"nearest": 1.0, "farthest": 10.0} | changes
        return one, Station("north", tuple(position), **fields)

    def test_straight_ahead_the_whole_acceptance_is_left(self):
        one, station = self.station()
        check = SightCheck((station,), self.marker, self.axis, 0.5)
        assert check.margin(one)[0] == pytest.approx(0.5)
        assert check.seen_by(one) == ["north"]

    def test_a_wall_or_the_range_hides_the_marker(self):
        one, station = self.station()
        wall = trimesh.creation.box((0.5, 0.5, 0.5))
        wall.apply_translation((np.array(station.position) + one.contact[0]) / 2.0)
        hidden = SightCheck((station,), self.marker, self.axis, 0.5, wall)
        assert hidden.margin(one)[0] == -np.pi
        assert hidden.seen_by(one) == [None]
        _, near = self.station(farthest=2.0)
        assert SightCheck((near,), self.marker, self.axis, 0.5).margin(one)[0] == -np.pi

    def test_of_two_stations_the_better_one_counts(self):
        one, station = self.station()
        _, near = self.station(farthest=2.0)
        both = SightCheck((near, station), self.marker, self.axis, 0.5)
        assert both.margin(one)[0] == pytest.approx(0.5)
