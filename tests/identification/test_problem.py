from dataclasses import replace

import numpy as np
import pytest

from elastocal.elastic import ElasticModel, layout
from elastocal.errors import IdentificationError
from elastocal.identification import FitOptions, Prior, build, factor, observability, solve
from elastocal.robot import Robot
from support.cells import urdf
from support.problems import campaign, elastic, linear_readings, made_up, planted

PRIOR = Prior(mean=np.full(6, 1e-6), sigma=np.full(6, 2e-7), noise=2e-5)


def test_observation_times_compliance_is_the_deflection():
    readings, compliance = linear_readings()
    problem = build(elastic(), readings)
    np.testing.assert_allclose(problem.residuals(compliance), 0.0, atol=1e-15)
    np.testing.assert_array_equal(problem.d, readings.deflection)
    assert (len(problem), problem.columns) == (155, 18)


def test_a_moment_and_a_marker_enter_the_rows():
    readings = campaign()
    moment = np.random.default_rng(0).normal(0.0, 50.0, (len(readings), 3))
    readings = replace(readings, moment=moment)
    expected = elastic().observation_blocks(
        readings.joint_position, readings.force, moment, [0.0, 0.0, 0.3]
    )
    problem = build(elastic(), readings, marker_offset=[0.0, 0.0, 0.3])
    np.testing.assert_allclose(problem.O, expected, atol=1e-9)


def test_sigmas_weigh_rows_relative_to_the_median_one():
    sigma = np.full((155, 3), 2e-5)
    sigma[7, 2] = 4e-5
    problem = build(elastic(), replace(campaign(), marker_sigma=sigma), FitOptions(weights="sigma"))
    assert problem.weight[7, 2] == 0.5
    assert np.median(problem.weight) == problem.weight[0, 0] == 1.0


def test_without_weights_the_sigmas_are_ignored():
    np.testing.assert_array_equal(build(elastic(), campaign()).weight, 1.0)


@pytest.mark.parametrize(
    ("sigma", "message"),
    [(None, "need marker_sigma"), (np.zeros((155, 3)), "above 0 m"), (-np.ones((155, 3)), "above")],
)
def test_weights_without_usable_sigmas_are_refused(sigma, message):
    with pytest.raises(IdentificationError, match=message):
        build(elastic(), replace(campaign(), marker_sigma=sigma), FitOptions(weights="sigma"))


def test_a_prior_is_a_row_a_spring():
    problem, _ = planted(options=FitOptions(prior=PRIOR))
    np.testing.assert_allclose(problem.prior_rows[:, :-1], np.eye(6) * 100.0)
    np.testing.assert_allclose(problem.prior_rows[:, -1], 1e-4)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mean": 1e-6}, "one mean and sigma for 6 parameters"),
        ({"sigma": np.ones(5)}, "one mean and sigma for 6 parameters"),
        ({"mean": np.full(6, np.nan)}, "finite means"),
        ({"sigma": np.zeros(6)}, "above 0"),
        ({"sigma": np.full(6, np.nan)}, "above 0"),
        ({"noise": 0.0}, "above 0"),
        ({"noise": np.nan}, "above 0"),
        ({"noise": np.inf}, "above 0"),
    ],
)
def test_an_impossible_prior_is_refused(changes, message):
    with pytest.raises(IdentificationError, match=message):
        planted(options=FitOptions(prior=replace(PRIOR, **changes)))


def test_scale_is_the_norm_of_the_weighted_columns():
    problem, _ = made_up(np.random.default_rng(0))
    problem = replace(problem, weight=np.random.default_rng(1).uniform(0.1, 2.0, (32, 3)))
    rows = (problem.O * problem.weight[..., None]).reshape(-1, 5)
    np.testing.assert_allclose(problem.scaled().scale, np.linalg.norm(rows, axis=0))


def test_a_factor_multiplies_squared_residuals():
    problem, _ = made_up(np.random.default_rng(0))
    factor_of = np.linspace(0.1, 2.0, 32)
    again = problem.reweighted(factor_of)
    np.testing.assert_allclose(again.weight**2, factor_of[:, None] * problem.weight**2)
    np.testing.assert_array_equal(again.d, problem.d)


def test_some_readings_keep_their_blocks():
    problem, _ = made_up(np.random.default_rng(0))
    some = problem.take([3, 30])
    np.testing.assert_array_equal(some.block, [0, 7])
    np.testing.assert_array_equal(some.O, problem.O[[3, 30]])
    mask = np.zeros(32, dtype=bool)
    mask[[3, 30]] = True
    np.testing.assert_array_equal(problem.take(mask).d, some.d)


def test_some_springs_keep_their_bounds_and_prior():
    strong = replace(PRIOR, mean=np.arange(1, 7) * 1e-7, sigma=np.logspace(-9, -8, 6))
    options = FitOptions(lower=np.arange(6) * 1e-9, upper=1e-5, prior=strong)
    problem, _ = planted(sigma=1e-5, options=options)
    columns = np.array([1, 4])
    some = problem.with_columns(columns)
    np.testing.assert_array_equal(some.lower, [1e-9, 4e-9])
    expected = replace(
        strong, mean=np.asarray(strong.mean)[columns], sigma=np.asarray(strong.sigma)[columns]
    )
    short = ElasticModel(elastic().robot, [elastic("actuated").springs[i] for i in columns])
    readings, _ = linear_readings("actuated", 1e-5)
    alone = build(short, readings, FitOptions(lower=[1e-9, 4e-9], upper=1e-5, prior=expected))
    np.testing.assert_allclose(solve(some).compliance, solve(alone).compliance, rtol=1e-9)


def on_the_axis():
    """Return a model whose tcp lies on its last axis: no force can turn that spring."""
    aside, on = 'xyz="0.15 0.0 0.565"', 'xyz="0.0 0.0 0.565"'
    assert urdf().count(aside) == 1
    straight = Robot.from_urdf(urdf().replace(aside, on), "tcp")
    return ElasticModel(straight, layout(straight, "actuated"))


def test_a_spring_that_no_force_turns_is_not_observable_and_stays_at_zero():
    readings = campaign()
    problem = build(on_the_axis(), readings)
    solution = solve(problem)
    found = observability(solution.factored, on_the_axis().springs)
    assert (found.rank, found.observable) == (5, (True,) * 5 + (False,))
    assert [[term.spring for term in group] for group in found.unobservable] == [["joint_6.axial"]]
    assert solution.compliance[5] == 0.0
    assert np.all(solution.compliance < 1e-4)


def test_readings_that_do_not_turn_a_spring_do_not_see_it():
    """What is loaded in the whole campaign may be round-off in a part of it."""
    problem, _ = made_up(np.random.default_rng(0))
    problem.O[:20, :, 2] = 1e-13 * np.random.default_rng(1).normal(size=(20, 3))
    part = problem.take(np.arange(20))
    assert np.linalg.matrix_rank(factor(part).s[:, None] * factor(part).Vt, tol=1e-6) == 4
    assert abs(solve(part).compliance[2]) < 1.0


def test_a_column_in_another_unit_is_judged_by_what_a_sensible_value_makes():
    """Metres to a newton beside radians to a newton metre: norms alone say nothing."""
    unit = np.array([1.0, 1.0, 1e-9, 1.0, 1.0])
    problem, truth = made_up(np.random.default_rng(0))
    other = replace(problem, O=problem.O * unit)
    assert np.any(np.all(other.scaled().rows == 0.0, axis=(0, 1)))
    told = replace(other, size=1.0 / unit)
    assert not np.any(np.all(told.scaled().rows == 0.0, axis=(0, 1)))
    np.testing.assert_allclose(solve(told).compliance, truth / unit, rtol=1e-9)
