"""Production decides where the poses do not: what is not backed there, and what errs least."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from elastocal.elastic import ElasticModel, actuated, bearing, bearing_ends
from elastocal.identification import (
    Choice,
    DriveCompliances,
    FitOptions,
    PredictionDoubt,
    ProductionForecast,
    ProductionRows,
    build,
    choose_model,
    expected_errors,
    solve,
    take_best,
    with_knowledge,
)
from elastocal.identification.prediction_doubt import DOUBT_ROWS
from support.cells import Cell, linear_truth, rich_truth, robot

OPTIONS = FitOptions()


def forecast(size: float, variance: float, poses: int = 31) -> ProductionForecast:
    """Return a forecast of the same deflection along x at ten rows."""
    return ProductionForecast(np.tile([size, 0.0, 0.0], (10, 1)), variance, poses)


@cache
def choice() -> Choice:
    readings = Cell(rich_truth(), seed=3, poses=8).readings()
    rows = ProductionRows(readings.joint_position + 0.1, readings.force)
    return choose_model(robot(), readings, "auto", OPTIONS, production=rows)


def test_the_richest_model_errs_by_chance_alone():
    assert expected_errors([forecast(1e-3, 1e-8), forecast(1.2e-3, 4e-8)])[1] == 2e-4


def test_a_model_that_is_apart_by_no_more_than_chance_has_no_bias():
    # 0.1 mm apart, where chance makes sqrt(4e-8 - 1e-8) = 0.17 mm.
    simple, _ = expected_errors([forecast(1.1e-3, 1e-8), forecast(1.2e-3, 4e-8)])
    assert simple == 1e-4


def test_a_model_that_is_farther_apart_errs_by_its_bias_too():
    simple, _ = expected_errors([forecast(0.7e-3, 1e-8), forecast(1.2e-3, 4e-8)])
    assert simple == pytest.approx(np.sqrt(25e-8 - 3e-8 + 1e-8))


def test_a_jackknife_of_few_poses_is_a_wider_interval():
    wide, narrow = (forecast(1e-3, 1e-8, poses).doubt.half_width for poses in (8, 31))
    assert wide == pytest.approx(2.365e-4, rel=1e-3)
    assert narrow == pytest.approx(2.042e-4, rel=1e-3)


def test_the_doubt_of_two_stretches_is_that_of_all_their_rows():
    rng = np.random.default_rng(0)
    deflection, low, high = rng.standard_normal((3, 30, 3))
    first, rest, whole = (
        PredictionDoubt.of(deflection[rows], low[rows], high[rows])
        for rows in (slice(0, 7), slice(7, 30), slice(None))
    )
    assert first is not None
    assert whole is not None
    both = first.plus(rest).plus(PredictionDoubt.of(deflection[:0], low[:0], high[:0]))
    assert both.rows == 30
    assert both.deflection == pytest.approx(whole.deflection)
    assert both.half_width == pytest.approx(whole.half_width)


def test_production_is_judged_by_rows_with_a_load():
    force = np.zeros((1000, 3))
    force[500:, 2] = -100.0
    few = ProductionRows(np.arange(1000.0)[:, None], force, force).few()
    assert len(few) == DOUBT_ROWS
    assert few.moment is not None
    assert few.joint_position[[0, -1], 0].tolist() == [500.0, 999.0]


def test_without_production_the_rung_that_errs_least_is_taken():
    tried = [replace(each, forecast=None) for each in choice().ladder]
    names = [each.name for each in tried]
    chosen = take_best(tried, names)
    assert all(np.isnan(each.production_error) for each in chosen.ladder)
    assert chosen.taken == min(chosen.ladder, key=lambda each: each.difference).name
    near = [each for each in chosen.ladder if each.difference <= each.standard_error]
    assert near[0].name != chosen.taken, "a simpler one is near, and is not taken"


def test_of_the_near_rungs_the_one_that_errs_least_on_production_is_taken():
    plain = take_best([replace(each, forecast=None) for each in choice().ladder], list_names())
    near = [each.name for each in plain.ladder if each.difference <= each.standard_error]
    sure = near[0]
    tried = [
        replace(each, forecast=forecast(1e-3, 1e-10 if each.name == sure else 1e-8))
        for each in choice().ladder
    ]
    found = take_best(tried, list_names())
    assert plain.taken != sure
    assert found.taken == sure
    told = [each.name for each in found.ladder if np.isfinite(each.production_error)]
    assert told == near


def test_a_rung_that_is_not_sure_of_production_cannot_be_taken_though_it_fits_best():
    worse = 5e-3
    tried = [
        replace(each, score=each.score + (0.0 if each.name == "links" else worse), forecast=sure)
        for each, sure in ((each, forecast(1e-3, 1e-10)) for each in choice().ladder)
    ]
    unsure = [
        replace(each, forecast=forecast(4e-3, 16e-6)) if each.name == "links" else each
        for each in tried
    ]
    assert take_best(tried, list_names()).taken == "links"
    found = take_best(unsure, list_names())
    assert found.taken != "links"
    assert [each.name for each in found.ladder if not each.is_backed] == ["links"]


def test_where_no_rung_is_sure_of_production_one_is_taken_all_the_same():
    tried = [replace(each, forecast=forecast(1e-3, 1e-4)) for each in choice().ladder]
    assert take_best(tried, list_names()).taken in list_names()


def list_names() -> list[str]:
    return [each.name for each in choice().ladder]


def test_drives_are_as_compliant_as_planted_on_an_arm_that_has_nothing_else():
    arm = linear_truth()
    readings = Cell(arm, seed=3, poses=15).readings()
    found = DriveCompliances.of(robot(), readings, OPTIONS)
    assert found is not None
    known = found.known_springs(ElasticModel(robot(), actuated(robot())))
    fitted = solve(build(ElasticModel(robot(), actuated(robot())), readings)).compliance
    sigma = np.array([each.sigma for each in known])
    assert np.isclose(sigma, fitted, rtol=1e-9).sum() >= 3
    assert sigma.min() > 0.0
    assert all(each.compliance == 0.0 for each in known)


def test_no_spring_that_few_poses_hardly_turn_is_far_softer_than_its_drive():
    """On 15 poses of a harsh arm tilts that were hardly turned predicted 3.9 mm in place of 0.5."""
    readings = Cell(rich_truth(), seed=3, poses=31).readings()
    first = np.isin(readings.pose, np.unique(readings.pose)[:4])
    few = readings.take(first & (readings.load_case == "normal"))
    noise = 1e-4 * np.random.default_rng(0).standard_normal(few.marker_displacement.shape)
    few = replace(few, marker_displacement=few.marker_displacement + noise)
    drives = DriveCompliances.of(robot(), readings, OPTIONS)
    assert drives is not None
    model = ElasticModel(robot(), bearing_ends(robot()))
    known = drives.known_springs(model)
    sigma = np.array([each.sigma for each in known])
    plain = solve(build(model, few)).compliance
    told = solve(build(model, few, with_knowledge(OPTIONS, known, model, few))).compliance
    assert (plain / sigma).max() > 50.0
    assert (told / sigma).max() < 3.0


def test_what_the_readings_determine_the_drives_leave_alone():
    readings = Cell(linear_truth(), seed=3, poses=31).readings()
    drives = DriveCompliances.of(robot(), readings, OPTIONS)
    assert drives is not None
    model = ElasticModel(robot(), bearing(robot()))
    options = with_knowledge(OPTIONS, drives.known_springs(model), model, readings)
    plain, told = (build(model, readings, each) for each in (OPTIONS, options))
    apart = np.linalg.norm(told.O @ (solve(told).compliance - solve(plain).compliance), axis=1)
    assert apart.mean() < 1e-3 * np.linalg.norm(told.d, axis=1).mean()
