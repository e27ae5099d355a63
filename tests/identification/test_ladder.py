"""The ladder climbs as high as readings carry it, and never higher."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, Gear, bearing
from elastocal.errors import IdentificationError, SpringError
from elastocal.identification import (
    RUNGS,
    Climbed,
    FitOptions,
    build,
    calibrate,
    choose_model,
    leave_poses_out,
    low_loads,
    solve,
    take_best,
    with_knowledge,
)
from elastocal.identification.displacement import displacement_blocks
from elastocal.identification.ladder import climb
from elastocal.identification.rungs import gears, has_levels
from elastocal.robot import T_from_xyzabc, with_tool
from elastocal.sim.arm import Linkage, press_poses
from support.cells import TRACKED, Cell, linear_truth, rich_truth, robot
from support.problems import campaign, linear_readings

OPTIONS = FitOptions()


@cache
def chosen(truth: str, poses: int, springs: str = "auto") -> dict[str, Climbed]:
    arm = {"linear": linear_truth, "rich": rich_truth}[truth]()
    readings = Cell(arm, seed=3, poses=poses).readings()
    ladder = choose_model(robot(), readings, springs, OPTIONS).ladder
    return {rung.name: rung for rung in ladder}


def taken(ladder: dict[str, Climbed]) -> str:
    (name,) = [name for name, rung in ladder.items() if rung.chosen]
    return name


def with_low_load(readings: Readings) -> Readings:
    """Return the readings with those of the normal load case at 45 % besides, planted exactly."""
    low = readings.take(readings.load_case == "normal")
    parts = {
        name: np.concatenate([getattr(readings, name), part * getattr(low, name)])
        for name, part in (
            ("joint_position", 1.0),
            ("force", 0.45),
            ("controller_displacement", 0.45),
            ("marker_displacement", 0.45),
        )
    }
    return Readings(
        np.concatenate([readings.pose, low.pose]),
        np.concatenate([readings.load_case, np.full(len(low), "low")]),
        **parts,
    )


def test_few_springs_are_left_where_more_predict_better():
    assert taken(chosen("linear", 31)) == "bearing"


def test_gears_are_taken_on_an_arm_whose_gears_stiffen():
    ladder = chosen("rich", 60)
    assert taken(ladder) == "gears"
    assert ladder["bearing"].low > 0.0


def test_few_poses_do_not_carry_what_many_do():
    assert taken(chosen("rich", 31)) == "bearing"
    assert taken(chosen("rich", 60)) == "gears"


def test_the_best_rung_differs_from_itself_by_nothing():
    ladder = chosen("rich", 31)
    best = min(ladder.values(), key=lambda rung: rung.score.mean())
    assert (best.difference, best.low, best.high) == (0.0, 0.0, 0.0)


def test_a_pose_that_stands_alone_does_not_hide_which_rung_is_better():
    """It is extrapolated to: the rungs there miss by millimetres, one way or the other."""
    best = chosen("rich", 31)["links"]
    worse = replace(best, name="bearing", score=best.score + 30e-6)
    spoiled = best.score.copy()
    spoiled[7] += 3e-3
    tried = [worse, replace(best, score=spoiled)]
    allowed = ["bearing", "links"]
    company = np.arange(31) != 7
    alone = [replace(each, counted=company) for each in tried]
    assert take_best([replace(each, counted=None) for each in tried], allowed).taken == "bearing"
    assert take_best(alone, allowed).taken == "links"


def judged(gain, spread):
    """Return the rung taken of two, the richer of which errs less by a part, with a scatter."""
    rich = chosen("rich", 31)["links"]
    rng = np.random.default_rng(0)
    scatter = rng.standard_normal(31)
    rich = replace(rich, score=np.full(31, 100e-6), counted=None)
    scatter = 100e-6 * spread * (scatter - scatter.mean()) / scatter.std(ddof=1)
    simple = replace(rich, name="bearing", score=rich.score * (1.0 + gain) + scatter)
    return take_best([simple, rich], ["bearing", "links"]).taken


@pytest.mark.parametrize(
    ("gain", "spread", "taken"),
    [
        (0.03, 0.01, "links"),  # little, and certain
        (0.03, 0.30, "bearing"),  # little, within one standard error
        (0.08, 0.50, "links"),  # more than a twentieth, though it is not certain
        (-0.01, 0.01, "bearing"),
    ],
)
def test_a_richer_rung_must_gain_a_twentieth_or_more_than_a_standard_error(gain, spread, taken):
    assert judged(gain, spread) == taken


@pytest.mark.parametrize("seed", [0, 5, 10])
def test_springs_of_the_axes_alone_are_not_shared_among_more(seed):
    readings, _ = linear_readings("actuated", sigma=20e-6, seed=seed)
    assert choose_model(robot(), readings, "auto", FitOptions()).taken == "actuated"


def test_the_interval_counts_that_refits_overlap():
    """Nadeau and Bengio: wider by sqrt(2) than for independent errors, but for 1 / (n - 1)."""
    rung = chosen("rich", 31)["actuated"]
    best = min(chosen("rich", 31).values(), key=lambda rung: rung.score.mean())
    difference = rung.score - best.score
    naive = difference.std(ddof=1) / np.sqrt(31)
    assert (rung.high - rung.low) / (2.0 * 2.0423 * naive) == pytest.approx(
        np.sqrt(1.0 + 31.0 / 30.0), rel=1e-3
    )


def test_rungs_are_apart_from_the_chosen_one_by_what_they_predict():
    ladder = chosen("linear", 8)
    assert ladder[taken(ladder)].apart == 0.0
    assert min(rung.apart for name, rung in ladder.items() if name != taken(ladder)) > 0.0
    forced = chosen("linear", 8, "bearing")
    assert [name for name, rung in forced.items() if np.isfinite(rung.apart)] == ["bearing"]


def test_springs_that_were_asked_for_by_name_lack_what_clearly_better_ones_predict():
    """Of bending links with 31 poses the interval by springs of the axes alone held 43 %."""
    forced = chosen("rich", 8, "actuated")
    better = {name for name, each in forced.items() if each.difference < -each.standard_error}
    assert "bearing" in better
    doubted = {name for name, each in forced.items() if np.isfinite(each.apart)}
    assert doubted == {"actuated"} | better
    readings = Cell(rich_truth(), seed=3, poses=8).readings()
    model = forced["actuated"].model
    found = calibrate(model, readings, np.random.default_rng(0), ladder=tuple(forced.values()))
    assert found.widening > 1.5 * found.spring_widening


@pytest.mark.parametrize("name", ["actuated", "bearing", "tensor", "gears"])
def test_each_rung_can_be_forced(name):
    assert taken(chosen("rich", 8, name)) == name


def test_the_score_of_a_pose_is_its_mean_error_where_no_load_is_low():
    ladder = chosen("rich", 8)
    readings = Cell(rich_truth(), seed=3, poses=8).readings()
    for rung in ladder.values():
        # Rungs are judged without a prior; the errors of the chosen one are with it.
        held_out = leave_poses_out(build(rung.model, readings))
        error = [held_out.error[readings.pose == k].mean() for k in np.unique(readings.pose)]
        np.testing.assert_allclose(rung.score, error, rtol=1e-6)
        assert rung.chosen or np.allclose(rung.held_out.error, held_out.error, rtol=1e-6)


@pytest.mark.slow
def test_the_errors_of_the_chosen_rung_are_those_of_its_calibration():
    readings = Cell(rich_truth(), seed=3, poses=8).readings()
    choice = choose_model(robot(), readings, "auto", OPTIONS)
    told = with_knowledge(OPTIONS, choice.known, choice.model, readings)
    found = calibrate(choice.model, readings, np.random.default_rng(0), told)
    (rung,) = [each for each in choice.ladder if each.chosen]
    np.testing.assert_allclose(rung.held_out.error, found.held_out.error, rtol=1e-9)


def test_a_low_load_counts_half_at_its_pose_left_out_and_half_with_all_low_loads_left_out():
    readings = with_low_load(campaign())
    (rung,) = climb(robot(), readings, [RUNGS["bearing"]], ["bearing"], OPTIONS).ladder
    problem = build(rung.model, readings, OPTIONS)
    low = low_loads(readings)
    np.testing.assert_array_equal(low, readings.load_case == "low")
    error = leave_poses_out(problem).error
    others = solve(problem.take(~low)).compliance
    error[low] += np.linalg.norm(problem.take(low).residuals(others), axis=1)
    error[low] /= 2.0
    expected = [error[readings.pose == pose].mean() for pose in np.unique(readings.pose)]
    np.testing.assert_allclose(rung.score, expected, rtol=1e-4)


def test_a_low_load_whose_frame_is_free_is_judged_at_its_pose_alone():
    readings, options = with_low_load(campaign()), FitOptions(free_frame="load_case")
    (rung,) = climb(robot(), readings, [RUNGS["bearing"]], ["bearing"], options).ladder
    error = rung.held_out.error
    expected = [error[readings.pose == pose].mean() for pose in np.unique(readings.pose)]
    np.testing.assert_allclose(rung.score, expected)


def test_rungs_that_were_not_tried_are_refused_by_name():
    ladder = list(chosen("rich", 8).values())
    with pytest.raises(
        IdentificationError, match=r"springs gears\+friction, odd were not tried: no"
    ):
        take_best(ladder, ["gears+friction", "odd"])


def test_a_rung_with_more_parameters_than_numbers_were_read_is_not_taken():
    """Of four poses with one load each chance finds the best."""
    ladder = chosen("rich", 8)
    tried = list(ladder.values()) if isinstance(ladder, dict) else list(ladder)
    few = [replace(each, predicted=each.predicted[:7], score=each.score) for each in tried]
    names = [each.name for each in tried]
    best = take_best(few, names)
    assert best.taken == "bearing", "18 parameters and 21 numbers"
    assert take_best(few, names[1:2]).taken == names[1]
    none = [replace(each, predicted=each.predicted[:1]) for each in tried]
    assert take_best(none, names).taken == take_best(tried, names).taken


def test_a_layout_beside_the_ladder_is_taken_and_shown_with_it():
    ladder = chosen("linear", 8, "bearing-joint")
    assert taken(ladder) == "bearing-joint"
    assert set(ladder) > {"actuated", "bearing"}


def test_an_unknown_layout_is_refused_by_name():
    with pytest.raises(SpringError, match="'bering'; did you mean 'bearing'"):
        choose_model(robot(), campaign(), "bering", OPTIONS)


def test_friction_is_not_offered_without_a_load_case_of_low_load():
    assert not has_levels(campaign())
    assert "gears+friction" not in chosen("rich", 8)
    with pytest.raises(IdentificationError, match="no load case has less than 60%"):
        climb(robot(), campaign(), [RUNGS["gears+friction"]], ["gears+friction"], OPTIONS)


@pytest.mark.parametrize("springs", ["auto", "gears"])
def test_planted_friction_is_found_where_there_is_a_low_load(springs):
    readings = with_low_load(campaign())
    assert has_levels(readings)
    model = ElasticModel(robot(), gears(robot(), readings, (0.03, 0.1, 0.3)))
    c = np.array([1e-6 if "friction" in name else 2e-6 for name in model.parameter_names])
    exact = displacement_blocks(model, readings) @ c
    noise = 1e-6 * np.random.default_rng(0).normal(size=exact.shape)
    planted = replace(
        readings, marker_displacement=readings.controller_displacement + exact + noise
    )
    ladder = choose_model(robot(), planted, springs, OPTIONS).ladder
    assert taken({rung.name: rung for rung in ladder}).endswith("friction")


def test_gears_are_scaled_to_the_load_of_each_joint():
    moment = np.random.default_rng(0).normal(0.0, 300.0, (155, 3))
    readings = replace(campaign(), moment=moment)
    springs, remembering = gears(robot(), readings), gears(robot(), readings, (0.03, 0.5))
    model = ElasticModel(robot(), bearing(robot()))
    torque = model.load_torques(readings.joint_position, readings.force, moment)
    for index, spring in enumerate(springs[:5]):
        assert isinstance(spring, Gear)
        typical = np.median(np.abs(torque[:, index]))
        np.testing.assert_allclose(spring.knees, np.array([0.3, 1.0, 3.0]) * typical, rtol=0.06)
        slips = remembering[index].slips
        np.testing.assert_allclose(slips, np.array([0.03, 0.5]) * typical, rtol=0.06)


def test_a_joint_that_is_never_loaded_keeps_a_linear_spring():
    readings = campaign()
    springs = gears(robot(), replace(readings, force=0.0 * readings.force + [0.0, 0.0, -1000.0]))
    assert springs[0].kind == "revolute"
    assert springs[1].kind == "gear"


def test_a_blunder_does_not_decide():
    readings = Cell(rich_truth(), seed=3, poses=60).readings()
    marker = readings.marker_displacement.copy()
    marker[7] += 0.5
    spoiled = replace(readings, marker_displacement=marker)
    ladder = choose_model(robot(), spoiled, "auto", OPTIONS).ladder
    assert taken({rung.name: rung for rung in ladder}) == "gears"


@pytest.mark.parametrize(("springs", "told"), [("auto", True), ("gears", True), ("bearing", False)])
def test_springs_that_a_ladder_chooses_are_told_what_the_drives_say(springs, told):
    readings = Cell(rich_truth(), seed=3, poses=8).readings()
    choice = choose_model(robot(), readings, springs, OPTIONS)
    assert bool(choice.known) is told
    if told:
        assert [each.name for each in choice.known] == list(choice.model.parameter_names)


@pytest.mark.slow
def test_a_longer_tool_does_not_turn_springs_that_the_calibrated_tool_hardly_did_to_great_errors():
    """Springs at the wrist, which presses beside its axis hardly turn, took all of the noise."""
    arm, longer = rich_truth(), T_from_xyzabc(0.0, 0.0, 0.15, 0.0, np.radians(30.0), 0.0)
    readings = Cell(arm, seed=3, poses=8, noise=TRACKED).readings()
    choice = choose_model(robot(), readings, "gears", OPTIONS)
    told = with_knowledge(OPTIONS, choice.known, choice.model, readings)
    urdf_longer = with_tool(robot().urdf, "tcp", "far", longer)
    truth = replace(arm, linkage=Linkage.from_urdf(urdf_longer, "far"))
    q = press_poses(arm.linkage, 20, np.random.default_rng(1)).joints
    force = np.tile([0.0, 0.0, 800.0], (len(q), 1))
    true = truth.equilibrium(q, force).deflection
    errors = []
    for options in (OPTIONS, told):
        fitted = calibrate(choice.model, readings, np.random.default_rng(0), options).calibrated
        found = fitted.with_tool(longer).predict(q, force).deflection
        errors.append(np.linalg.norm(found - true, axis=1).mean())
    print(errors, np.linalg.norm(true, axis=1).mean())
    assert errors[1] < 0.8 * errors[0]
