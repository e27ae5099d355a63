"""Campaigns at other poses or loads: what a comparison concludes is restricted to common ground."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from elastocal.elastic import ElasticModel, layout
from elastocal.identification import CalibratedModel, calibrate
from elastocal.identification.recertification import Verdict, recertify
from support.cells import Cell, linear_truth, rich_truth, robot, unseen
from support.recertified import calibrated, soft_truth


@cache
def elsewhere(seed: int = 5) -> CalibratedModel:
    """Return the calibration of an unchanged arm at the half of the poses with A1 to the left."""
    return _part(seed, lambda q: q[:, 0] > np.median(q[:, 0]))


@cache
def here(seed: int = 6) -> CalibratedModel:
    return _part(seed, lambda q: q[:, 0] < np.median(q[:, 0]))


def _part(seed, choose) -> CalibratedModel:
    readings = Cell(rich_truth(), seed=seed, poses=60).readings()
    # Far apart: all but the poses in the middle.
    q = readings.joint_position
    spread = q[:, 0] - np.median(q[:, 0])
    readings = readings.take(choose(q) & (np.abs(spread) > 0.5 * np.abs(spread).max()))
    model = ElasticModel(robot(), layout(robot(), "actuated"))
    found = calibrate(model, readings, np.random.default_rng(0)).calibrated
    return replace(found, provenance=f"campaign {seed}")


@pytest.mark.slow
def test_campaigns_of_one_region_and_load_judge_springs():
    found = recertify(calibrated(linear_truth(), 0), calibrated(soft_truth(), 50_000)).summary
    assert found.ground.springs_judged
    assert found.moved[0] == "joint_3.axial"
    assert not any("same region" in note for note in found.notes)


def test_springs_of_campaigns_at_other_poses_are_not_held_against_one_another():
    found = recertify(here(), elsewhere()).summary
    assert found.ground.old_covered < 0.5
    assert not found.springs_judged
    assert found.moved == ()
    assert not any(each.moved for each in found.springs)
    assert "Springs are not held against one another" in found.moved_sentence


@pytest.mark.slow
def test_springs_of_campaigns_under_other_forces_are_not_held_against_one_another():
    model = calibrated(linear_truth(), 0)
    domain = model.domain
    lighter = replace(
        calibrated(linear_truth(), 1),
        domain=replace(
            domain,
            force=0.4 * domain.force,
            torque_low=0.4 * domain.torque_low,
            torque_high=0.4 * domain.torque_high,
        ),
    )
    found = recertify(model, lighter).summary
    assert not found.springs_judged
    assert found.ground.old_covered < 0.1
    assert found.ground.new_covered == 1.0


def test_rows_that_one_campaign_does_not_cover_are_left_out_and_counted():
    there = unseen(linear_truth())
    q = np.vstack([there.joint_position[:5] + 2.5, there.joint_position[5:]])
    models = calibrated(linear_truth(), 0), calibrated(linear_truth(), 1)
    found = recertify(*models, q, there.force, limit=0.4e-3)
    ground = found.summary.ground
    assert ground.rows == len(q)
    assert ground.left_out >= 5
    assert ground.rows_covered == found.summary.deflection.rows == len(found.rows.q)
    assert found.summary.deflection.where.row >= 5
    np.testing.assert_array_equal(q[found.rows.number], found.rows.q)
    assert found.summary.verdict is Verdict.PASS
    assert f"over the {ground.rows_covered} of {len(q)} rows" in found.summary.reason
    assert any("were left out" in note for note in found.summary.notes)


def test_without_a_common_row_nothing_is_judged_and_the_reason_says_so():
    there = unseen(linear_truth())
    models = calibrated(linear_truth(), 0), calibrated(linear_truth(), 1)
    found = recertify(*models, there.joint_position + 2.5, there.force, limit=1e-4)
    assert found.rows is None
    assert found.summary.verdict is None
    assert "lies where both campaigns measured" in found.summary.reason


@pytest.mark.parametrize("which", [0, 1])
def test_with_a_model_that_does_not_know_its_domain_every_row_counts(which):
    models = [calibrated(linear_truth(), 0), calibrated(linear_truth(), 1)]
    models[which] = replace(models[which], domain=None, provenance="an older file")
    there = unseen(linear_truth())
    found = recertify(*models, there.joint_position + 2.5, there.force).summary
    assert found.ground is None
    assert found.deflection.rows == len(there)
    assert any("same region under the same forces" in note for note in found.notes)
