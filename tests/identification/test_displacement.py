"""Rows against a reference: sag between two places, friction along the way of the torques."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from elastocal.dataset import Dataset, Readings
from elastocal.dataset.readings import Presses
from elastocal.elastic import ElasticModel
from elastocal.elastic.layouts import bearing_joint
from elastocal.identification.displacement import displacement_blocks, reference_joints
from elastocal.identification.rungs import gears
from elastocal.robot import Rail, Robot, T_from_xyzabc, on_rail, with_tool
from elastocal.sim.arm import Linkage, Noise, bearing_truth, measure, press_forces, press_poses
from elastocal.sim.arm.elastic_arm import GRAVITY, ElasticArm
from sim.conftest import ARM_URDF
from support.virtual_chain import ARMS


@cache
def truth() -> ElasticArm:
    return bearing_truth(Linkage.from_urdf(ARM_URDF, "tcp"), gravity=GRAVITY)


@cache
def measured() -> Dataset:
    poses = press_poses(truth().linkage, 12, np.random.default_rng(5))
    forces = press_forces(poses.T_base_tcp)
    return measure(truth(), poses.joints, forces, Noise(), np.random.default_rng(1))


def robot() -> Robot:
    return Robot.from_urdf(measured().robot_urdf, measured().tcp_frame)


def readings() -> Readings:
    return measured().readings(robot().joint_names)


def error_of_fit(
    rows: np.ndarray, deflection_rows: np.ndarray, shown: np.ndarray | None = None
) -> float:
    """Return the mean error of the true deflection, as a part of it, fitted to what was seen."""
    seen = readings()
    shown = seen.deflection if shown is None else shown
    c = np.linalg.lstsq(rows.reshape(-1, rows.shape[-1]), shown.ravel(), rcond=None)[0]
    true = truth().equilibrium(seen.joint_position, seen.force).deflection
    error = np.linalg.norm(deflection_rows @ c - true, axis=1).mean()
    return float(error / np.linalg.norm(true, axis=1).mean())


@pytest.mark.parametrize("recorded", [True, False])
def test_rows_with_sag_find_the_true_deflection_of_a_heavy_arm(recorded):
    model, seen = ElasticModel(robot(), bearing_joint(robot())), readings()
    assert seen.reference_joint_position is not None
    if not recorded:
        seen = replace(seen, reference_joint_position=None)
    at_the_same_joints = model.observation_blocks(seen.joint_position, seen.force)
    with_sag = error_of_fit(displacement_blocks(model, seen), at_the_same_joints)
    without = error_of_fit(at_the_same_joints, at_the_same_joints)
    # Today's rows take the change of sag for deflection: 0.56 % of 1.56 mm here.
    assert with_sag < 0.002 < 0.004 < without


def test_rows_against_a_lightly_loaded_reference_find_the_whole_deflection():
    """The simulator's arm was deflected already when the zero was read, so less was shown."""
    model, seen = ElasticModel(robot(), bearing_joint(robot())), readings()
    lightly = 0.2 * seen.force[:, [1, 2, 0]]
    hidden = truth().equilibrium(seen.reference_joint_position, lightly).deflection
    rows = displacement_blocks(model, replace(seen, reference_force=lightly))
    at_the_same_joints = model.observation_blocks(seen.joint_position, seen.force)
    shown = seen.deflection - hidden
    assert error_of_fit(rows, at_the_same_joints, shown) < 0.002
    assert error_of_fit(displacement_blocks(model, seen), at_the_same_joints, shown) > 0.02


@pytest.mark.parametrize("arm", ["six axes", "on a rail", "offset wrist on a turntable"])
def test_an_unrecorded_reference_is_where_the_controller_began_with_external_axes_still(arm):
    made = Robot.from_urdf(ARMS[arm], "tcp")
    rng, external = np.random.default_rng(0), len(made.joint_names) - 6
    q = rng.uniform(-1.0, 1.0, (20, len(made.joint_names)))
    q[:, external + 2] += 1.5
    q[:, external + 4] = np.copysign(0.3 + np.abs(q[:, external + 4]), q[:, external + 4])
    moved = 5e-3 * rng.normal(size=(20, 3))
    nothing = np.zeros((20, 3))
    seen = Readings(np.arange(20), np.array(["normal"] * 20), q, nothing, moved, nothing)
    q_0 = reference_joints(made, seen)
    here, there = made.forward(q), made.forward(q_0)
    np.testing.assert_array_equal(q_0[:, :external], q[:, :external])
    np.testing.assert_allclose(there[:, :3, 3], here[:, :3, 3] - moved, atol=1e-9)
    np.testing.assert_allclose(there[:, :3, :3], here[:, :3, :3], atol=1e-9)


def test_rows_of_a_marker_are_those_of_an_arm_whose_tcp_it_is():
    """Loads keep their place: about the marker they have a moment as well."""
    offset, seen = np.array([0.1, -0.2, 0.3]), readings()
    urdf = with_tool(measured().robot_urdf, "tcp", "marker", T_from_xyzabc(*offset, 0.0, 0.0, 0.0))
    aside = Robot.from_urdf(urdf, "marker")
    springs = bearing_joint(robot())
    lever = robot().forward(seen.joint_position)[:, :3, :3] @ offset
    moved = replace(seen, moment=np.cross(-lever, seen.force))
    rows = displacement_blocks(ElasticModel(robot(), springs), seen, offset)
    expected = displacement_blocks(ElasticModel(aside, springs), moved)
    np.testing.assert_allclose(rows, expected, atol=1e-9 * np.abs(expected).max())


def with_friction() -> ElasticModel:
    return ElasticModel(robot(), gears(robot(), readings(), slips=(0.1, 0.3)))


@pytest.mark.parametrize("lightly", [0.0, 0.1])
@pytest.mark.parametrize("conditioned", [False, True])
def test_friction_goes_from_free_by_way_of_the_zero_through_the_presses_of_a_pose(
    conditioned, lightly
):
    """A conditioned pose is pressed once before its zero is read."""
    model, offset = with_friction(), np.array([0.0, 0.1, 0.2])
    seen = replace(
        readings(),
        sequence=np.tile(np.arange(5), 12),
        conditioned=conditioned,
        reference_force=lightly * readings().force,
    )
    q, q_0, f, f_0 = (
        seen.joint_position,
        seen.reference_joint_position,
        seen.force,
        seen.reference_force,
    )
    pressed = model.load_torques(q, f) + model.weight_torques(q)
    zero = model.load_torques(q_0, f_0) + model.weight_torques(q_0)
    found = displacement_blocks(model, seen, offset)
    for first in range(0, len(seen), 5):
        rows = slice(first, first + 5)
        way = [model.weight_torques(q_0[first]), zero[first], *pressed[rows]]
        at_zero, presses = 1, [2, 3, 4, 5, 6]
        if conditioned:
            way[1:3] = pressed[first], zero[first]
            at_zero, presses = 2, [1, 3, 4, 5, 6]
        states = model.friction.path(np.array(way))
        expected = (
            model.observation_blocks(q[rows], f[rows], None, offset, states[presses])
            + model.sag_blocks(q[rows], offset)
            - model.sag_blocks(q_0[rows], offset)
            - model.observation_blocks(q_0[rows], f_0[rows], None, offset, states[at_zero])
        )
        np.testing.assert_allclose(found[rows], expected, atol=1e-12 * np.abs(expected).max())


def test_friction_felt_a_press_that_gave_no_reading():
    model, whole = with_friction(), replace(readings(), sequence=np.tile(np.arange(5), 12))
    rows = displacement_blocks(model, whole)
    kept = whole.load_case != "south"
    slipped = whole.take(~kept)
    presses = Presses(
        slipped.pose, slipped.sequence, slipped.joint_position, slipped.force, slipped.moment
    )
    part = replace(whole.take(kept), also_pressed=presses)
    np.testing.assert_allclose(displacement_blocks(model, part), rows[kept], rtol=0, atol=1e-18)
    forgotten = displacement_blocks(model, replace(part, also_pressed=None))
    assert np.abs(forgotten - rows[kept]).max() > 1e-3 * np.abs(rows).max()


def test_the_order_in_time_is_the_sequence_and_not_the_order_of_the_rows():
    model, whole = with_friction(), replace(readings(), sequence=np.tile(np.arange(5), 12))
    rows = displacement_blocks(model, whole)
    shuffled = np.random.default_rng(0).permutation(len(whole))
    np.testing.assert_array_equal(displacement_blocks(model, whole.take(shuffled)), rows[shuffled])


def test_a_conditioning_press_that_slipped_still_conditions():
    model = with_friction()
    whole = replace(readings(), sequence=np.tile(np.arange(5), 12), conditioned=True)
    rows = displacement_blocks(model, whole)
    kept = whole.load_case != "normal"
    first = whole.take(~kept)
    presses = Presses(first.pose, first.sequence, first.joint_position, first.force)
    part = replace(whole.take(kept), also_pressed=presses)
    # The zero is solved or recorded once a pose, so that no reading is needed to know it.
    np.testing.assert_allclose(displacement_blocks(model, part), rows[kept], rtol=0, atol=1e-18)


def test_the_chain_is_evaluated_once_for_the_loaded_and_once_for_the_reference_joints(monkeypatch):
    model, seen = with_friction(), readings()
    evaluated = []
    for name in ("spring_jacobian", "weight_torques"):
        method = getattr(ElasticModel, name)

        def counted(self, q, name=name, method=method):
            evaluated.append(name)
            return method(self, q)

        monkeypatch.setattr(ElasticModel, name, counted)
    displacement_blocks(model, seen, [0.0, 0.0, 0.1])
    assert sorted(evaluated) == ["spring_jacobian"] * 2 + ["weight_torques"] * 2


def test_twenty_percent_wrong_masses_change_little():
    seen = readings()
    exact = ElasticModel(robot(), bearing_joint(robot()))
    at_the_same_joints = exact.observation_blocks(seen.joint_position, seen.force)
    errors = {}
    for by in (0.8, 1.0, 1.2):
        masses = r'mass value="([0-9.]+)"'
        text = re.sub(masses, lambda m, by=by: f'mass value="{by * float(m[1])!r}"', ARM_URDF)
        assert (text != ARM_URDF) == (by != 1.0)
        heavier = Robot.from_urdf(text, "tcp")
        model = ElasticModel(heavier, bearing_joint(heavier))
        errors[by] = error_of_fit(displacement_blocks(model, seen), at_the_same_joints)
    without = error_of_fit(at_the_same_joints, at_the_same_joints)
    # Measured: 0.12, 0.14 and 0.25 %, and 0.56 % without any.
    assert max(errors.values()) < 0.003 < 0.005 < without


@pytest.mark.parametrize(
    "gravity", [(9.80665, 0.0, 0.0), (0.0, 0.0, 9.80665), (0.0, -6.93435, -6.93435)]
)
def test_an_arm_on_a_wall_the_ceiling_or_a_slope_sags_as_gravity_pulls_there(gravity):
    arm = bearing_truth(Linkage.from_urdf(ARM_URDF, "tcp"), gravity=gravity)
    poses = press_poses(arm.linkage, 12, np.random.default_rng(5))
    data = measure(
        arm, poses.joints, press_forces(poses.T_base_tcp), Noise(), np.random.default_rng(1)
    )
    assert data.gravity == gravity
    upright = robot()
    seen = data.readings(upright.joint_names)
    true = arm.equilibrium(seen.joint_position, seen.force).deflection
    errors = []
    for mounted in (replace(upright, gravity=gravity), upright):
        model = ElasticModel(mounted, bearing_joint(mounted))
        rows = displacement_blocks(model, seen).reshape(-1, len(model.parameters))
        c = np.linalg.lstsq(rows, seen.deflection.ravel(), rcond=None)[0]
        found = model.deflection(c, seen.joint_position, seen.force)
        errors.append(np.linalg.norm(found - true, axis=1).mean())
    size = np.linalg.norm(true, axis=1).mean()
    assert errors[0] < 0.0025 * size
    assert errors[1] > 2.0 * errors[0]


def test_a_rail_bears_what_stands_on_it_along_its_slope():
    slope = np.radians(20.0)
    rail = Rail("rail", (np.cos(slope), 0.0, np.sin(slope)), -2.0, 2.0)
    robot_on_rail = Robot.from_urdf(on_rail(ARM_URDF, rail), "tcp")
    model = ElasticModel(robot_on_rail, bearing_joint(robot_on_rail))
    q = np.array([0.7, 0.3, -1.2, 1.4, 0.2, 0.5, -0.4])
    # The base's plate of 100 kg rides on the rail as well.
    carried = 100.0 + 260.0 + 240.0 + 190.0 + 45.0 + 30.0 + 5.0 + 95.0
    assert model.weight_torques(q)[0] == pytest.approx(-9.80665 * carried * np.sin(slope))
    # What a stop of the rail gives along it moves the tcp as much.
    compliance = np.zeros(len(model.parameters))
    compliance[0] = 1e-8
    sag = model.sag_blocks(q) @ compliance
    expected = -1e-8 * 9.80665 * carried * np.sin(slope) * np.array(rail.axis)
    np.testing.assert_allclose(sag, expected, atol=1e-15)
