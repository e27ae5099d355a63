from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from elastocal.errors import DeviceError
from elastocal.planning import make_plan
from elastocal.robot import catalogue
from elastocal.sim.workcell._robot import TrueRobot
from support.simulated import example_cell, places

STEP = 1e-6


@cache
def robot(like="afp"):
    return TrueRobot.of(example_cell(like))


def pressed(arm, q, force_tcp):
    """Free and loaded rest under a force in the tcp frame."""
    free = arm.rest(q, np.zeros(3), arm.springs)
    force = arm.forward(q)[:3, :3] @ np.array(force_tcp, dtype=float)
    return free, arm.rest(q, force, free.springs, free.theta)


def deflection(arm, q, force_tcp):
    free, loaded = pressed(arm, q, force_tcp)
    return loaded.T_base_tcp[:3, 3] - free.T_base_tcp[:3, 3]


@pytest.mark.parametrize("like", ["afp", "machining"])
def test_the_undeformed_robot_is_that_of_the_cell(like):
    cell = example_cell(like)
    for place in places(like):
        np.testing.assert_allclose(
            robot(like).forward(place.q), cell.robot.forward(place.q), atol=1e-9
        )


@pytest.mark.slow
@pytest.mark.parametrize("like", ["afp", "machining"])
def test_typical_deflections_are_half_to_two_and_a_half_millimetres(like):
    cell = example_cell(like)
    sizes = [
        np.linalg.norm(deflection(robot(like), place.q, force))
        for place in places(like, 12)
        for force in cell.file.load_cases.force_tcp
    ]
    assert 0.5e-3 < np.median(sizes) < 2.7e-3
    assert np.mean((np.array(sizes) > 0.4e-3) & (np.array(sizes) < 3.5e-3)) > 0.9


@pytest.mark.slow
@pytest.mark.parametrize("like", ["afp", "machining"])
def test_deflections_at_planned_poses_are_half_to_two_and_a_half_millimetres(like):
    cell = example_cell(like)
    sizes = [
        np.linalg.norm(deflection(robot(like), np.array(pose.joints), force))
        for pose in make_plan(cell, jobs=1).plan.poses
        for force in cell.file.load_cases.force_tcp
    ]
    low, middle, high = np.percentile(sizes, [5, 50, 95])
    assert 0.5e-3 < low < high < 2.5e-3
    assert 1e-3 < middle < 2e-3


def test_all_torques_balance_at_rest():
    for place in places():
        for rest in pressed(robot(), place.q, (200.0, -100.0, -1100.0)):
            assert rest.imbalance < 1e-5


def test_the_robot_gives_way_along_the_force():
    for place in places():
        for force in ((0, 0, -1100), (280, 0, -1100), (0, 280, -1100)):
            R = robot().forward(place.q)[:3, :3]
            assert (R @ np.array(force, dtype=float)) @ deflection(robot(), place.q, force) > 0.3


def test_it_hangs_down_under_its_weight_and_the_balancer_holds_it_up():
    q = np.array([0.0, 0.0, -0.35, 0.6, 0.0, 0.5, 0.0])
    arm = robot()
    hanging = replace(arm, springs=replace(arm.springs, balancer=None))

    def sag(one):
        return one.rest(q, np.zeros(3), one.springs).T_base_tcp[2, 3] - one.forward(q)[2, 3]

    assert sag(hanging) < 1.2 * sag(arm) < 0.0


def test_reciprocity_of_a_robot_without_memory():
    """Betti: small forces do the same work on each other's deflections."""
    arm, q = robot(), places()[1].q
    free = arm.rest(q, np.zeros(3), arm.springs)
    moved = (
        np.stack([arm.rest(q, f, arm.springs, free.theta).T_base_tcp[:3, 3] for f in np.eye(3)])
        - free.T_base_tcp[:3, 3]
    )
    np.testing.assert_allclose(moved, moved.T, atol=2e-3 * np.abs(moved).max())


def test_force_on_deflection_is_the_slope_of_the_stored_energy():
    """The work done on a robot without memory over a small step is what its springs store."""
    arm, q = robot(), places()[0].q
    force = 500.0 * arm.forward(q)[:3, :3] @ (0.0, 0.0, -1.0)
    one, two = (arm.rest(q, s * force, arm.springs) for s in (1.0, 1.001))
    springs = arm.springs.at_joint(float(q[arm.external + 1]))
    stored = springs.evaluate(two.theta[None])[0] - springs.evaluate(one.theta[None])[0]
    way = two.T_base_tcp[:3, 3] - one.T_base_tcp[:3, 3]
    weight = _work_of_weight(arm, q, one, two)
    assert stored[0] - weight == pytest.approx(1.0005 * force @ way, rel=1e-3)


def _work_of_weight(arm, q, one, two):
    def points(rest):
        mechanism = arm._mechanism(q[None], np.zeros((1, 3)), arm.springs)
        return mechanism.load_points(mechanism.motions(rest.theta[None]))[1:, 0]

    return float(np.sum((points(two) - points(one)) * arm._weights))


def test_a_gear_remembers_in_which_direction_it_was_loaded():
    arm, q = robot(), places()[0].q
    free, loaded = pressed(arm, q, (0, 0, -1100))
    back = arm.rest(q, np.zeros(3), loaded.springs, loaded.theta)
    left = np.linalg.norm(back.T_base_tcp[:3, 3] - free.T_base_tcp[:3, 3])
    size = np.linalg.norm(loaded.T_base_tcp[:3, 3] - free.T_base_tcp[:3, 3])
    assert 0.01 < left / size < 0.15
    shaken = arm.rest(q, np.zeros(3), arm.springs, back.theta)
    np.testing.assert_allclose(shaken.T_base_tcp, free.T_base_tcp, atol=1e-9)


def test_deflection_is_not_proportional_to_the_force():
    q = places()[0].q
    half, whole = (np.linalg.norm(deflection(robot(), q, (0, 0, f))) for f in (-550.0, -1100.0))
    assert abs(whole / (2.0 * half) - 1.0) > 0.02


@pytest.mark.parametrize("part", ["gears", "bearings", "links", "floor", "end_effector"])
def test_every_part_can_be_made_stiffer(part):
    q = places()[0].q
    stiff = TrueRobot.of(example_cell(simulation={"truth": {part: 3.0}}))
    force = (280, 0, -1100)
    assert np.linalg.norm(deflection(stiff, q, force)) < np.linalg.norm(
        deflection(robot(), q, force)
    )


def test_stiffnesses_of_the_file_are_taken():
    values = [f"{k} N*m/rad" for k in (1e6, 2e6, 3e6, 4e5, 5e5, 6e5)]
    layout = TrueRobot.of(example_cell(simulation={"gears": {"stiffness": values}}))
    which = layout.springs.gears.which
    np.testing.assert_allclose(layout.springs.stiffness[which], (1e6, 2e6, 3e6, 4e5, 5e5, 6e5))
    assert [layout.chain.springs[i].joint for i in which] == list(
        example_cell().robot.joint_names[1:]
    )


def test_upright_is_where_the_upper_arm_points_up():
    layout = TrueRobot.of(example_cell())
    assert layout.springs.balancer.upright == pytest.approx(-np.pi / 2)
    assert (
        TrueRobot.of(example_cell(simulation={"balancer": {"fitted": False}})).springs.balancer
        is None
    )


_UPRIGHT, _BENT = (0, 0, 0, 0, 45, 0), (0, -90, 90, -90, -90, 0)
_STANDING = {
    "BXP": _UPRIGHT, "IRB": _UPRIGHT, "R-2": _UPRIGHT, "RX1": (0, 0, 90, 0, 45, 0),
    "UR1": _BENT, "UR2": _BENT,
}  # fmt: skip
"""Posture in deg of the arms that are no KUKA, by the beginning of their names."""


@pytest.mark.parametrize("model", catalogue.names())
def test_every_robot_of_the_catalogue_bends_by_a_plausible_amount(model):
    names = catalogue.load(model).joint_names
    angles = _STANDING.get(model[:3], (0, -90, 90, 0, 45, 0))
    other = example_cell(
        "machining",
        robot={"model": model},
        motion={
            "home": {name: f"{a} deg" for name, a in zip(names, angles, strict=True)},
            "speed": dict.fromkeys(names, "100 deg/s"),
            "provenance": "a test",
        },
        limits={},
    )
    arm = TrueRobot.of(other)
    # A UR carries a tenth of what the others do.
    force = 100.0 if model.startswith("UR") else 1000.0
    size = np.linalg.norm(deflection(arm, other.home, (0, 0, -force)))
    assert 0.1e-3 < size < 5e-3


def test_a_robot_of_five_joints_is_refused_by_name():
    cell = example_cell("machining")
    lame = replace(cell, robot=_five_joints(cell))
    with pytest.raises(DeviceError, match="needs six joints"):
        TrueRobot.of(lame)


def _five_joints(cell):
    class Lame:
        urdf = cell.robot.urdf
        tip = "link_5"
        base = cell.robot.base

    return Lame()
