from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm, t

from elastocal.identification import leave_poses_out, solve
from elastocal.identification.solve import PoseGrams
from elastocal.identification.uncertainty import (
    bootstrap,
    distrust_factor,
    doubt,
    doubt_factor,
    widen_draws,
    widening_factor,
)
from support.problems import made_up


def stretched(blocks, seed):
    rng = np.random.default_rng(seed)
    problem, _ = made_up(rng, blocks=blocks)
    problem = replace(problem, d=problem.d + rng.normal(0.0, 0.1, problem.d.shape))
    compliance = solve(problem).compliance
    draws = bootstrap(PoseGrams.of(problem), 200, rng)
    return widening_factor(problem, compliance, draws, leave_poses_out(problem).compliance)


def test_the_factor_is_at_least_one_and_grows_as_poses_fall():
    factors = {blocks: [stretched(blocks, seed) for seed in range(8)] for blocks in (4, 8, 16, 60)}
    assert min(min(values) for values in factors.values()) >= 1.0
    medians = [float(np.median(values)) for values in factors.values()]
    assert medians == sorted(medians, reverse=True)
    assert medians[0] > 1.3
    assert medians[-1] < 1.1


def test_the_factor_is_the_ratio_of_the_deviations_times_students():
    problem, c = made_up(np.random.default_rng(0), blocks=5)
    step = np.eye(5)[0] * 1e-3
    draws = c + np.array([[1.0], [-1.0]]) * step
    left_out = c + np.array([[1.0], [-1.0], [2.0], [-2.0], [0.0]]) * step
    jackknife = 4 / 5 * (1 + 1 + 4 + 4)
    students = t.ppf(0.975, 4) / norm.ppf(0.975)
    assert widening_factor(problem, c, draws, left_out) == pytest.approx(
        students * np.sqrt(jackknife)
    )


def test_draws_that_do_not_vary_are_not_stretched():
    problem, c = made_up(np.random.default_rng(0), blocks=5)
    assert widening_factor(problem, c, np.tile(c, (40, 1)), np.tile(c, (5, 1))) == 1.0


def test_draws_are_stretched_about_the_estimate():
    problem, c = made_up(np.random.default_rng(0))
    draws = c * np.array([[0.9], [1.1], [1.0]])
    np.testing.assert_allclose(widen_draws(problem, c, draws, 3.0), c * [[0.7], [1.3], [1.0]])
    np.testing.assert_allclose(widen_draws(problem, c, draws, 1.0), draws)


def test_stretched_draws_keep_the_bounds():
    problem, c = made_up(np.random.default_rng(0))
    bounded = replace(problem, lower=0.8 * c, upper=1.2 * c)
    draws = c * np.array([[0.9], [1.1], [1.01]])
    found = widen_draws(bounded, c, draws, 10.0)
    assert np.all((found >= 0.8 * c) & (found <= 1.2 * c))
    np.testing.assert_allclose(found[2], 1.1 * c)


def test_stretching_beyond_a_bound_moves_no_prediction_that_other_springs_can_keep():
    """Two springs that nearly share a deflection: what one may not take, the other does."""
    problem, c = made_up(np.random.default_rng(0))
    alike = problem.O.copy()
    alike[..., 1] = alike[..., 0]
    problem = replace(problem, O=alike)
    step = np.array([0.6, -0.6, 0.0, 0.0, 0.0]) * c[0]
    estimate = np.concatenate([[c[0], c[0]], c[2:]])
    found = widen_draws(problem, estimate, estimate + np.array([step, -step]), 3.0)
    assert np.all(found >= problem.lower)
    predicted = (alike @ (found - estimate).T).ravel()
    np.testing.assert_allclose(predicted, 0.0, atol=1e-6 * np.abs(alike @ estimate).max())


def test_doubt_about_the_model_adds_to_the_variance():
    problem, c = made_up(np.random.default_rng(0), blocks=5)
    draws = c + np.array([[1.0], [-1.0]]) * np.eye(5)[0] * 1e-3
    spread = float(np.mean(np.sum(np.square(problem.O @ (draws[0] - c)), axis=1)))
    assert doubt_factor(problem, c, draws, 3.0 * spread) == pytest.approx(2.0)
    assert doubt_factor(problem, c, draws, 0.0) == 1.0


def test_draws_of_a_model_that_is_not_trusted_spread_as_far_as_its_errors_at_left_out_poses():
    problem, c = made_up(np.random.default_rng(0))
    noise = np.random.default_rng(1).normal(0.0, 0.3, problem.d.shape)
    held_out = leave_poses_out(replace(problem, d=problem.d + noise))
    draws = c * (1.0 + 0.01 * np.random.default_rng(2).normal(size=(40, 5)))
    by = distrust_factor(problem, c, draws, held_out)
    moved = np.einsum("rin,dn->dri", problem.O, by * (draws - c))
    spread = np.mean(np.sum(np.square(moved), axis=2))
    assert spread == pytest.approx(np.mean(np.square(held_out.error)))
    assert distrust_factor(problem, c, np.tile(c, (40, 1)), held_out) == 1.0


def test_models_that_the_poses_do_not_tell_apart_are_a_doubt_about_the_chosen_one():
    apart = np.array([0.0, 2.0])
    assert doubt(np.zeros(2), np.ones(2), apart) == pytest.approx(2.0)
    assert doubt(np.array([0.0, -9.0]), np.ones(2), apart) == pytest.approx(2.0)
    weight = norm.pdf(1.5) / norm.pdf(0.0)
    one_and_a_half = doubt(np.array([0.0, 1.5]), np.array([0.0, 1.0]), apart)
    assert one_and_a_half == pytest.approx(4.0 * weight / (1.0 + weight))
    # One that is far behind says nothing of a prediction.
    assert doubt(np.array([0.0, 9.0]), np.ones(2), apart) == pytest.approx(0.0, abs=1e-15)
    assert doubt(np.zeros(0), np.zeros(0), np.zeros(0)) == 0.0


def test_a_model_that_could_not_be_chosen_is_a_doubt_in_full():
    apart, beside = np.array([0.0, 2.0, 3.0]), np.array([False, False, True])
    assert doubt(np.zeros(3), np.ones(3), apart, beside) == pytest.approx(2.0 + 9.0)
    behind = doubt(np.array([0.0, 0.0, 9.0]), np.ones(3), apart, beside)
    assert behind == pytest.approx(2.0)
