"""The error budget: each term is worth what it takes, parts add up, what is not known says so."""

import json
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from elastocal import dataset
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, bearing, tensor
from elastocal.identification import (
    RUNGS,
    ErrorBudget,
    FitOptions,
    TermWorth,
    build,
    error_budget,
    leave_poses_out,
)
from elastocal.records import from_data, to_data
from elastocal.sim.arm import Noise
from support.cells import QUIET, TRACKED, Cell, linear_truth, rich_truth, robot, urdf
from support.cli import elastocal
from support.shared import needs_shared

HOOKS = Path(__file__).parents[2] / "docs" / "hooks"


@cache
def stiffening() -> Readings:
    """Return readings that are many and quiet: the worth of gears differs from pose to pose."""
    return Cell(rich_truth(), poses=60, noise=Noise(force=0.2, marker=2e-6)).readings()


@cache
def linear() -> Readings:
    return Cell(linear_truth(), noise=TRACKED).readings()


def model(rung: str, readings: Readings) -> ElasticModel:
    return ElasticModel(robot(), RUNGS[rung].springs(robot(), readings))


@cache
def budget_of_gears() -> ErrorBudget:
    return error_budget(model("gears", stiffening()), stiffening())


def worth(budget: ErrorBudget, term: str) -> TermWorth:
    (found,) = (each for each in budget.terms if each.term == term)
    return found


def test_gears_and_bearings_of_a_true_arm_that_has_both_are_worth_something():
    for term in ("gears", "bearings"):
        found = worth(budget_of_gears(), term)
        assert found.taken
        assert found.resolved
        assert 0.0 < found.low < found.worth < found.high


def test_gears_of_a_linear_arm_are_worth_nothing():
    found = worth(error_budget(model("bearing", linear()), linear()), "gears")
    assert not found.taken
    assert not (found.resolved and found.worth > 0.0)


def test_a_worth_is_the_difference_in_quadrature_at_left_out_poses():
    budget, found = budget_of_gears(), worth(budget_of_gears(), "gears")
    assert found.error**2 - budget.total.error**2 == pytest.approx(found.worth**2)
    # Without gears the layout is that of the rung below.
    held_out = leave_poses_out(build(model("links", stiffening()), stiffening()))
    assert found.error == pytest.approx(np.sqrt(np.mean(held_out.error**2)), rel=1e-6)


def test_a_term_is_worth_the_same_whether_it_is_taken_out_or_added():
    out = worth(budget_of_gears(), "gears")
    added = worth(error_budget(model("links", stiffening()), stiffening()), "gears")
    assert (out.taken, added.taken) == (True, False)
    np.testing.assert_allclose([added.worth, added.low, added.high], [out.worth, out.low, out.high])


def test_parts_add_up_in_quadrature():
    budget = budget_of_gears()
    parts = (budget.noise, budget.fit, budget.rest)
    assert sum(part.error**2 for part in parts) == pytest.approx(budget.total.error**2)


def test_noise_is_what_the_readings_state_of_tracker_and_force():
    exact = replace(linear(), force_sigma=None)
    marker = error_budget(model("bearing", exact), exact).noise
    assert marker.error == pytest.approx(np.sqrt(3.0) * np.sqrt(2.0) * TRACKED.marker, rel=1e-9)
    both = error_budget(model("bearing", linear()), linear()).noise
    # 2 N on an arm that gives way by some 1.5 um/N.
    assert 1e-6 < np.sqrt(both.error**2 - marker.error**2) < 2e-5
    assert (marker.source, both.source) == (
        "stated: metrology",
        "stated: metrology and force sensor",
    )


def test_noise_is_the_scatter_of_readings_that_were_taken_twice():
    """The interval holds the planted noise, the stated standard deviations have no part in it."""
    exact = replace(Cell(linear_truth(), noise=QUIET).readings(), marker_sigma=None)
    noise = 40e-6 * np.random.default_rng(5).standard_normal((2 * len(exact), 3))
    readings = exact.take(np.tile(np.arange(len(exact)), 2))
    visit = np.repeat([0, 100], len(exact))
    moved = readings.marker_displacement + noise
    readings = replace(readings, pose=visit + readings.pose, marker_displacement=moved)
    found = error_budget(model("bearing", readings), readings)
    assert found.poses == 31
    assert found.noise.low < np.sqrt(3.0) * 40e-6 < found.noise.high
    assert found.noise.source == f"{len(exact)} repeated readings"


def test_without_repeats_and_deviations_noise_is_not_known_and_stays_in_the_rest():
    bare = replace(linear(), marker_sigma=None, force_sigma=None)
    found = error_budget(model("bearing", bare), bare)
    assert (found.noise.error, found.noise.low) == (None, None)
    assert found.rest.source == "noise is in it"
    assert found.rest.error**2 + found.fit.error**2 == pytest.approx(found.total.error**2)


def test_a_tracker_that_is_turned_against_the_base_shows_as_registration():
    turn = np.array([0.0, 0.05, 0.0])
    moved = linear().marker_displacement
    turned = replace(linear(), marker_displacement=moved + np.cross(turn, moved))
    aligned = error_budget(model("bearing", linear()), linear())
    found = worth(error_budget(model("bearing", turned), turned), "registration")
    assert found.resolved
    assert found.worth > 0.0
    # With the turn free the error is that of an aligned tracker.
    assert found.error == pytest.approx(aligned.total.error, rel=0.1)
    assert not worth(aligned, "registration").resolved


def test_what_the_readings_do_not_carry_is_not_judged_and_says_why():
    reasons = {each.term: each.reason for each in budget_of_gears().terms}
    assert reasons["friction"] == "no load case of low load"
    assert reasons["sag"] == "no masses in the URDF"
    tensors = ElasticModel(robot(), tensor(robot()))
    found = worth(error_budget(tensors, linear()), "bearings")
    assert (found.worth, found.reason) == (None, "not among these springs")


def test_free_frames_are_taken_out_as_registration():
    plain = model("bearing", linear())
    found = worth(error_budget(plain, linear(), FitOptions(free_frame="load_case")), "registration")
    assert found.taken
    held_out = leave_poses_out(build(plain, linear()))
    assert found.error == pytest.approx(np.sqrt(np.mean(held_out.error**2)), rel=1e-6)


def test_what_is_known_of_single_springs_has_no_part_in_it():
    plain = model("bearing", linear())
    bounds = FitOptions(lower=np.full(18, 1e-8), upper=np.full(18, 2e-8))
    assert error_budget(plain, linear(), bounds) == error_budget(plain, linear())


def test_a_blunder_that_is_set_aside_is_no_part_of_the_budget():
    spoiled = linear().marker_displacement.copy()
    spoiled[7] += 0.5
    readings = replace(linear(), marker_displacement=spoiled)
    found = error_budget(ElasticModel(robot(), bearing(robot())), readings)
    assert found.readings == len(readings) - 1
    assert found.total.error < 2e-4


def test_a_budget_is_read_back_as_it_was_written():
    budget = budget_of_gears()
    assert from_data(ErrorBudget, json.loads(json.dumps(to_data(budget))), "budget") == budget


def test_calibrate_prints_it_on_demand_and_keeps_it(tmp_path):
    data, out = tmp_path / "data.nc", tmp_path / "model.json"
    dataset.write(Cell(linear_truth(), poses=12, noise=TRACKED).measure(), data)
    (tmp_path / "arm.urdf").write_text(urdf())
    command = ["calibrate", data, "--out", out, "--springs", "bearing"]
    command += ["--robot", tmp_path / "arm.urdf", "--tcp", "tcp"]
    assert json.loads(elastocal(*command, "--json").out)["budget"] is None
    printed = elastocal(*command, "--budget")
    assert printed.code == 0, printed.err
    assert "Error budget" in printed.out + printed.err
    kept = json.loads(out.read_text())["calibration"]["budget"]
    assert [term["term"] for term in kept["terms"]][:2] == ["bearings", "gears"]
    assert kept["total"]["error"] > 0.0


@needs_shared
def test_the_budget_that_the_documentation_quotes_is_that_of_the_fanuc_readings(monkeypatch):
    monkeypatch.syspath_prepend(str(HOOKS))
    from gallery.budget import fanuc_budget, quoted_budget

    found, quoted = to_data(fanuc_budget()), to_data(quoted_budget())
    sys.modules.pop("gallery", None)
    for name in ("total", "fit", "rest"):
        assert found[name]["error"] == pytest.approx(quoted[name]["error"], rel=1e-3)
    for now, before in zip(found["terms"], quoted["terms"], strict=True):
        assert (now["taken"], now["reason"]) == (before["taken"], before["reason"])
        if now["reason"] is None:
            assert now["worth"] == pytest.approx(before["worth"], rel=0.02)
