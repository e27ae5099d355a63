from dataclasses import replace

import numpy as np
import pytest

from elastocal.identification import interval, solve
from elastocal.identification.solve import PoseGrams
from elastocal.identification.uncertainty import bootstrap
from support.problems import made_up, planted


@pytest.fixture(scope="module")
def problem():
    return planted(sigma=2e-5)[0]


@pytest.fixture(scope="module")
def grams(problem):
    return PoseGrams.of(problem)


def test_draws_are_reproducible_by_seed_and_differ_for_another(grams):
    draws = [bootstrap(grams, 50, np.random.default_rng(seed)) for seed in (1, 1, 2)]
    assert draws[0].shape == (50, 6)
    np.testing.assert_array_equal(draws[0], draws[1])
    assert not np.any(draws[0] == draws[2])


def test_a_draw_is_a_fit_of_whole_poses_drawn_with_replacement(problem, grams):
    draw = bootstrap(grams, 1, np.random.default_rng(5))[0]
    chosen = np.random.default_rng(5).integers(31, size=31)
    rows = np.concatenate([np.flatnonzero(problem.block == block) for block in chosen])
    np.testing.assert_allclose(draw, solve(problem.take(rows)).compliance, rtol=1e-6)


def test_a_spring_that_no_pose_turns_spreads_as_far_as_its_prior_leaves_it_to():
    """Draws that all expect what the prior expects most would be sure of what nobody measured."""
    rng = np.random.default_rng(0)
    problem, _ = made_up(rng, blocks=40)
    problem.O[:] *= np.array([1e-3, 1.0, 1.0, 1.0, 1.0]) / np.logspace(0, 4, 5)
    d = np.einsum("rin,n->ri", problem.O, np.ones(5)) + rng.normal(0.0, 0.1, problem.d.shape)
    rows = (0.1 / 0.5) * np.column_stack([np.eye(5), np.full(5, 2.0)])
    grams = PoseGrams.of(replace(problem, d=d, prior_rows=rows))
    told, untold = (
        bootstrap(grams, 400, rng, each).std(axis=0) for each in (np.full(5, 0.1), None)
    )
    assert told[0] == pytest.approx(0.5, rel=0.15)
    assert untold[0] < 0.1
    # What the poses determine hardly spreads further.
    np.testing.assert_allclose(told[1:] / untold[1:], 1.0, atol=0.2)


def test_the_spread_is_that_of_repeated_campaigns():
    rng = np.random.default_rng(0)
    problem, _ = made_up(rng, blocks=40)
    campaigns = [
        replace(problem, d=problem.d + rng.normal(0.0, 0.1, problem.d.shape)) for _ in range(200)
    ]
    repeated = np.std([solve(campaign).compliance for campaign in campaigns], axis=0)
    draws = [bootstrap(PoseGrams.of(campaign), 100, rng) for campaign in campaigns[:5]]
    spread = np.mean([np.std(draw, axis=0) for draw in draws], axis=0)
    np.testing.assert_allclose(spread / repeated, 1.0, atol=0.25)


def test_poses_that_share_an_error_spread_more_than_independent_readings():
    """What resampling single readings would miss."""
    rng = np.random.default_rng(0)
    problem, _ = made_up(rng, blocks=40)
    problem.O[:] = problem.O[::4].repeat(4, axis=0)
    problem = replace(problem, d=np.einsum("rin,n->ri", problem.O, np.ones(5)))
    shared = rng.normal(0.0, 0.1, (40, 3)).repeat(4, axis=0)
    single = rng.normal(0.0, 0.1, (160, 3))
    spread = [
        np.std(bootstrap(PoseGrams.of(replace(problem, d=problem.d + e)), 100, rng), axis=0)
        for e in (shared, single)
    ]
    assert np.all(spread[0] > 1.4 * spread[1])


def test_draws_keep_the_bounds():
    problem, truth = planted(sigma=2e-4)
    box = replace(problem, lower=0.9 * truth, upper=1.1 * truth)
    draws = bootstrap(PoseGrams.of(box), 50, np.random.default_rng(0))
    assert np.all((draws >= 0.9 * truth * (1 - 1e-12)) & (draws <= 1.1 * truth * (1 + 1e-12)))


def test_the_interval_holds_19_of_20_draws_in_order():
    draws = np.random.default_rng(0).permutation(np.arange(1.0, 200.0))[:, None] * [1.0, -2.0]
    low, high = interval(draws)
    np.testing.assert_allclose(low, [5.0, -390.0])
    np.testing.assert_allclose(high, [195.0, -10.0])


def test_between_the_ends_of_few_draws_lies_95_percent_in_the_mean():
    """Of 40 draws NumPy's default ends hold 90.7 %."""
    ends = interval(np.random.default_rng(0).uniform(size=(40, 20000)))
    assert np.mean(ends[1] - ends[0]) == pytest.approx(0.95, abs=1e-3)


def test_an_interval_of_arrays_keeps_their_shape():
    low, high = interval(np.random.default_rng(0).normal(size=(60, 7, 3)))
    assert low.shape == high.shape == (7, 3)
    assert np.all(low < high)
