"""The effect on production and the next step: one for every state, each with its figure."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.identification import MOST_UNEXPLAINED, PredictionDoubt
from elastocal.verdict import Evidence, find_everything, judge_evidence
from elastocal.verdict.findings import NOT_SETTLED, STILL_FALLING
from elastocal.verdict.headline import next_step, poses_to_settle, production_effect
from support.reported import MADE, POSES


def step_of(evidence, wanted=()):
    """Return the next step with the findings of some kinds alone."""
    held = [each for each in find_everything(evidence) if each.kind in wanted]
    return next_step(evidence, held)


def with_errors(parts, tolerance, **changed):
    unseen = replace(parts.unseen, **changed)
    again = replace(parts.reproduction, unseen=unseen)
    limits = replace(parts.limits, tolerance=tolerance)
    return replace(parts, reproduction=again, limits=limits)


def test_the_effect_is_that_of_the_simulated_process(parts):
    line = parts.process.table.lines[-1]
    effect = production_effect(parts)
    assert effect.figures == f"{1e3 * line.before.mean:.3f} mm → {1e3 * line.after.mean:.3f} mm"
    assert f"{-100 * line.reduction.mean:+.1f}%" in effect.rest
    assert effect.where == "On the process path, in simulation"


def test_without_a_process_it_is_predicted_and_says_so(parts, monkeypatch):
    monkeypatch.setattr(Evidence, "doubt_on_production", PredictionDoubt(1e-3, 5e-5, 40))
    effect = production_effect(replace(parts, process=None))
    assert effect.figures == "1.000 mm → ±0.050 mm"
    assert "predicted" in effect.where
    assert effect.rest.endswith("(40 points); nothing was measured there")


@pytest.mark.parametrize("doubt", [None, PredictionDoubt(1e-3, 6e-4, 40)])
def test_there_is_no_effect_of_what_is_not_known(parts, monkeypatch, doubt):
    monkeypatch.setattr(Evidence, "doubt_on_production", doubt)
    assert production_effect(replace(parts, process=None)) is None


def test_nothing_begins_with_a_plan_and_a_plan_with_a_run():
    assert next_step(Evidence(made=MADE), ()).kind == "verdict.next.plan"


def test_readings_without_a_model_are_calibrated(parts):
    without = replace(parts, calibrated=None, reproduction=None)
    assert next_step(without, ()).values["poses"] == POSES
    planned = replace(without, dataset=None)
    found = next_step(planned, ())
    assert (found.kind, found.values["poses"]) == ("verdict.next.measure", POSES)
    assert "min of cell time" in found


def test_files_that_contradict_come_first(parts):
    broken = replace(parts, doubts=("a", "b"), calibrated=None)
    assert step_of(broken, ("verdict.contradiction",)) == (
        "Settle 2 contradictions between the files: `elastocal verify` names every file, and no"
        " figure counts before"
    )


@pytest.mark.parametrize(
    ("springs", "kind"), [("auto", "look-for-a-mistake"), ("bearing", "other-springs")]
)
def test_springs_that_explain_too_little_are_not_helped_by_poses(parts, monkeypatch, springs, kind):
    monkeypatch.setattr(type(parts.figures), "unexplained", MOST_UNEXPLAINED + 0.1)
    settings = replace(parts.figures.settings, springs=springs)
    figures = replace(parts.figures, settings=settings)
    useless = replace(parts, calibrated=replace(parts.calibrated, figures=figures))
    found = next_step(useless, ())
    assert (found.kind, f"{found.values['share']:.0%}") == (f"verdict.next.{kind}", "60%")


def test_without_a_tolerance_it_is_said_which_one_would_be_kept(parts):
    found = next_step(with_errors(parts, None), ())
    largest = max(parts.unseen.max, parts.unseen.p95.high)
    assert found.values == {"limit": largest}


def test_errors_at_one_pose_send_there_with_what_is_left_elsewhere(parts):
    error = np.linspace(1e-4, 2e-4, len(parts.unseen.error))
    pose = np.array(parts.unseen.pose)
    error[-4:], pose[-4:] = 5e-4, 6
    found = next_step(with_errors(parts, 3e-4, error=error, pose=pose), ())
    assert (found.kind, found.values["pose"]) == ("verdict.next.look-at-pose", 6)
    assert (found.values["error"], found.values["rest"] <= 2e-4) == (5e-4, True)
    assert "min of cell time" in found


def test_errors_everywhere_are_not_lowered_by_poses_when_there_are_enough(parts):
    error = np.full(len(parts.unseen.error), 5e-4)
    found = next_step(with_errors(parts, 3e-4, error=error), ())
    assert (found.kind, found.values["tolerance"]) == ("verdict.next.reduce-error", 3e-4)


@pytest.mark.parametrize("kind", [STILL_FALLING, NOT_SETTLED])
def test_more_poses_come_with_their_time_and_what_the_last_ones_brought(parts, kind):
    best = parts.saturation
    found = next_step(with_errors(parts, 1.0), [kind(last=best.last, poses=POSES)])
    assert found.kind == "verdict.next.more-poses"
    curve = np.median(parts.codecs[0].data.errors(best.variant), axis=0)
    assert found.values["after"] == curve[best.last - 1]
    assert found.values["before"] == curve[best.last - 1 - found.values["poses"]]
    assert found.values["more"] == poses_to_settle(best, POSES)


def test_an_open_point_is_counted_and_its_advice_given(parts):
    found = step_of(with_errors(parts, 1.0), ("verdict.tool-file-missing",))
    assert found.kind == "verdict.next.real-cell"
    without = replace(with_errors(parts, 1.0), tool=None, codecs=())
    found = step_of(without, ("verdict.no-codec",))
    assert found == (
        f"Ask whether {POSES} poses were enough: `elastocal codec` leaves them out in turn,"
        " without the robot"
    )


def test_what_is_within_is_measured_on_the_real_cell_or_used(parts):
    within = with_errors(parts, 1.0)
    assert f"{POSES} poses took about" in next_step(within, ())
    assert next_step(replace(within, cell=None), ()).kind == "verdict.next.use"


def test_a_verdict_has_both(parts):
    verdict = judge_evidence(parts)
    assert verdict.effect == production_effect(parts)
    assert verdict.next_step
