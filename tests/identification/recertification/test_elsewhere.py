"""Campaigns on other places, under other forces, with other tools: only the robot is judged."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.identification import (
    CalibratedModel,
    FitOptions,
    FitSettings,
    calibrate,
    choose_model,
    summary,
    write_model,
)
from elastocal.identification.displacement import displacement_blocks
from elastocal.identification.recertification import (
    ComparedRows,
    Verdict,
    recertify,
    recertify_files,
)
from elastocal.identification.recertification._sums import common_springs, shared_numbers
from elastocal.identification.recertification.arms import model_on
from elastocal.robot import Robot
from elastocal.sim.arm import SHOP_FLOOR, Linkage, bearing_truth, measure, press_forces, press_poses
from elastocal.sim.arm.elastic_arm import ElasticArm
from elastocal.sim.arm.measurement import SphericalCap
from support.by_day import some_by_day
from support.cells import START, linear_truth, rich_truth, robot, urdf
from support.geared import geared, heavy_robot
from support.recertified import softened

ASIDE = SphericalCap(apex=(1.5, 0.35, 0.85))
LIMIT = 0.35e-3


def campaign(arm: ElasticArm, seed: int, force: float, surface, poses: int) -> Readings:
    rng = np.random.default_rng(seed)
    pressed = press_poses(arm.linkage, poses, rng, surface, START)
    forces = force * press_forces(pressed.T_base_tcp)
    data = measure(arm, pressed.joints, forces, SHOP_FLOOR, rng)
    return data.readings(robot().joint_names)


def fitted(arm: ElasticArm, readings: Readings, springs: str, seed: int) -> CalibratedModel:
    linkage = arm.linkage
    of = Robot.from_urdf(linkage.urdf, linkage.tip)
    model = choose_model(of, readings, springs, FitOptions()).model
    found = calibrate(model, readings, np.random.default_rng(0)).calibrated
    return replace(found, provenance=f"campaign {seed}")


@cache
def before(springs: str) -> CalibratedModel:
    """Return the calibration of an arm with stiffening gears under full force."""
    readings = campaign(rich_truth(), 100, 1.0, None, 60)
    return fitted(rich_truth(), readings, springs, 100)


@cache
def after(springs: str, softer: float) -> tuple[CalibratedModel, Readings]:
    """Return one elsewhere under 60 % of the force, with one gear as much softer, if any."""
    arm = rich_truth() if softer == 1.0 else softened(rich_truth(), "joint_3", softer)
    readings = campaign(arm, 300, 0.6, ASIDE, 60)
    return fitted(arm, readings, springs, 300), readings


@pytest.mark.parametrize("springs", ["gears", "bearing"])
@pytest.mark.slow
def test_an_unchanged_robot_on_other_poses_and_loads_is_the_same(springs):
    model, readings = after(springs, 1.0)
    found = recertify(before(springs), model, rows=ComparedRows.of(readings), limit=LIMIT).summary
    assert found.ground.old_covered < 0.5
    assert found.moved == ()
    assert found.verdict is Verdict.PASS
    # 60 % of the force leaves linear springs 30 um beside those of the full one.
    assert 0.0 == found.deflection.mean.low < found.deflection.mean.value
    assert found.deflection.largest.low == 0.0
    assert any("hold what springs cannot express" in note for note in found.notes)


@pytest.mark.parametrize("springs", some_by_day(["gears", "bearing"]))
def test_a_robot_that_really_changed_is_told_from_other_poses_and_loads(springs):
    model, readings = after(springs, 3.0)
    found = recertify(before(springs), model, rows=ComparedRows.of(readings), limit=LIMIT).summary
    assert found.verdict is Verdict.FAIL


@pytest.mark.slow
def test_gears_of_campaigns_under_other_forces_are_held_against_one_another():
    old, (new, _) = before("gears"), after("gears", 1.0)
    assert old.model.springs != new.model.springs
    assert len(common_springs(old, new)) == len(new.model.springs)
    assert recertify(old, new).summary.springs_judged
    assert not recertify(before("bearing"), after("bearing", 1.0)[0]).summary.springs_judged


@pytest.mark.slow
def test_a_gear_amounts_to_its_mean_compliance_between_the_torques_that_both_met():
    old, (new, _) = before("gears"), after("gears", 1.0)
    number = next(each for each in shared_numbers(old, new) if each.name == "joint_2.axial")
    met = []
    for model in (old, new):
        domain = model.domain
        q = domain.joint_position[domain.reading_pose]
        torque = model.model.load_torques(q, domain.force)[:, 1]
        met.append((min(torque.min(), 0.0), max(torque.max(), 0.0)))
    low, high = max(m[0] for m in met), min(m[1] for m in met)
    for model, weights in ((old, number.old), (new, number.new)):
        knees = model.model.springs[1].knees
        mean = [T * (np.arctan(high / T) - np.arctan(low / T)) / (high - low) for T in knees]
        np.testing.assert_allclose(weights[weights != 0.0], [1.0, *mean], rtol=1e-12)


def another_tool() -> ElasticArm:
    longer = urdf().replace("0.15 0.0 0.565", "0.1 0.0 0.665")
    return bearing_truth(Linkage.from_urdf(longer, "tcp"))


def test_one_robot_calibrated_with_two_tools_has_not_moved():
    arm = another_tool()
    old = fitted(linear_truth(), campaign(linear_truth(), 1, 1.0, None, 31), "bearing", 1)
    readings = campaign(arm, 2, 1.0, None, 31)
    new = fitted(arm, readings, "bearing", 2)
    found = recertify(old, new, rows=ComparedRows.of(readings), limit=0.2e-3).summary
    assert found.moved == ()
    assert found.verdict is Verdict.PASS
    assert any("calibrated with another tool (tcp tcp, 112 mm" in note for note in found.notes)
    # Asked at its own tool, the old model deflects otherwise.
    there = model_on(old, new.model.robot).predict(readings.joint_position, readings.force)
    here = old.predict(readings.joint_position, readings.force)
    assert np.abs(there.deflection - here.deflection).max() > 0.1e-3


def test_two_models_are_compared_under_one_weight_of_the_arm():
    """A gear stiffens with the weight: another tool or mounting is no change of the robot."""
    here, hanging = geared(), geared(gravity=(0.0, 0.0, 9.81))
    q = campaign(rich_truth(), 1, 1.0, None, 5).joint_position
    force = np.tile([0.0, 300.0, -900.0], (len(q), 1))
    apart = here.predict(q, force).deflection - hanging.predict(q, force).deflection
    assert np.abs(apart).max() > 1e-6
    other = replace(hanging, draws=hanging.draws * 1.0001, provenance="hanging")
    found = recertify(other, here, q, force)
    np.testing.assert_array_equal(found.rows.old, found.rows.new)
    assert any("under another weight" in note for note in found.summary.notes)


def remembered() -> tuple[CalibratedModel, CalibratedModel, Readings]:
    readings = campaign(rich_truth(), 1, 1.0, None, 6)
    sequence = np.tile([4, 2, 0, 1, 3], 6)
    new = replace(geared(), draws=1.1 * geared().draws, compliance=1.1 * geared().compliance)
    readings = replace(readings, sequence=sequence, conditioned=True)
    return geared(), replace(new, provenance="later"), readings


def test_rows_of_a_dataset_are_the_displacements_that_its_readings_show():
    old, new, readings = remembered()
    found = recertify(old, new, rows=ComparedRows.of(readings)).rows
    for model, shown in ((old, found.old), (new, found.new)):
        blocks = displacement_blocks(model.model, readings)
        np.testing.assert_allclose(shown, blocks @ model.compliance, rtol=0, atol=1e-18)
    forgot = recertify(old, new, readings.joint_position, readings.force).rows
    assert np.abs(forgot.old - found.old).max() > 1e-6


def test_rows_of_one_visit_share_what_friction_remembers():
    old, new, readings = remembered()
    visit = [str(pose) for pose in readings.pose]
    rows = ComparedRows(readings.joint_position, readings.force, visit=visit)
    found = recertify(old, new, rows=rows).rows
    expected = new.predict(readings.joint_position, readings.force, visit=visit)
    np.testing.assert_allclose(found.new, expected.deflection, rtol=0, atol=1e-15)


def test_rows_are_asked_on_the_arm_as_it_stands_there():
    old, new, readings = remembered()
    hanging = heavy_robot((0.0, 0.0, 9.81))
    found = recertify(old, new, rows=ComparedRows.of(readings, hanging)).rows
    model = ElasticModel(hanging, new.model.springs)
    expected = displacement_blocks(model, readings) @ new.compliance
    np.testing.assert_allclose(found.new, expected, rtol=0, atol=1e-18)


def test_frames_that_one_calibration_alone_estimated_are_told(tmp_path):
    readings = replace(
        campaign(linear_truth(), 1, 1.0, None, 12), campaign=np.repeat(["a", "b"], 30)
    )
    model = choose_model(robot(), readings, "actuated", FitOptions()).model
    paths = []
    for free in ("none", "campaign"):
        options = FitOptions(free_frame=free)
        found = calibrate(model, readings, np.random.default_rng(0), options)
        paths.append(tmp_path / f"{free}.json")
        write_model(paths[-1], found.calibrated, summary(found, FitSettings(free_frame=free)))
    notes = recertify_files(*paths).summary.notes
    assert any("estimated frames of the tracker by: none, the new one by" in n for n in notes)
