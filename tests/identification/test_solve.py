from dataclasses import replace

import numpy as np
import pytest

from elastocal.errors import IdentificationError
from elastocal.identification import LOSSES, FitOptions, Prior, build, factor, solve
from elastocal.identification.solve import normalised_residuals
from support.problems import elastic, linear_readings, made_up, planted


def test_exact_data_give_the_planted_compliances_of_six_springs():
    problem, truth = planted()
    solution = solve(problem)
    np.testing.assert_allclose(solution.compliance, truth, rtol=1e-11)
    np.testing.assert_array_equal(solution.reading_weight, 1.0)
    assert solution.kkt_violation < 1e-9


def test_exact_data_of_eighteen_springs_are_explained_though_fourteen_are_seen():
    readings, truth = linear_readings()
    problem = build(elastic(), readings)
    solution = solve(problem)
    assert np.abs(problem.residuals(solution.compliance)).max() < 1e-11
    assert np.abs(solution.compliance - truth).max() > 1e-8


def test_the_factored_system_has_the_residuals_of_the_whole():
    problem, _ = planted(sigma=1e-5)
    system = factor(problem)
    rng = np.random.default_rng(0)
    cost = []
    for _ in range(2):
        c = rng.uniform(0.0, 1e-6, 6)
        small = system.s * (system.Vt @ (c * system.scale)) - system.y
        cost.append(np.sum(problem.residuals(c) ** 2) - np.sum(small**2))
    assert cost[0] == pytest.approx(cost[1], rel=1e-9)


def test_fewer_rows_than_springs_are_solved():
    problem, _ = made_up(np.random.default_rng(0), springs=5)
    part = problem.take([0])
    found = solve(part).compliance
    np.testing.assert_allclose(part.residuals(found), 0.0, atol=1e-4)


def test_the_scale_of_a_column_does_not_matter():
    problem, _ = made_up(np.random.default_rng(0))
    noisy = replace(problem, d=problem.d + np.random.default_rng(1).normal(0, 0.1, (32, 3)))
    by = np.array([30.0, 0.1, 5.0, 1e-2, 0.2])
    np.testing.assert_allclose(
        solve(replace(noisy, O=noisy.O * by)).compliance * by, solve(noisy).compliance, rtol=1e-9
    )


@pytest.mark.parametrize("seed", range(8))
def test_bounds_on_both_sides_are_kept_exactly(seed):
    rng = np.random.default_rng(seed)
    lower = rng.uniform(0.0, 1e-6, 18)
    upper = lower + rng.uniform(1e-8, 5e-7, 18) * rng.integers(0, 2, 18)
    readings, _ = linear_readings(sigma=2e-5)
    solution = solve(build(elastic(), readings, FitOptions(lower=lower, upper=upper)))
    assert np.all((lower <= solution.compliance) & (solution.compliance <= upper))
    assert np.any(solution.compliance == lower)


def test_a_fixed_spring_keeps_its_value_and_the_others_make_up_for_it():
    readings, truth = linear_readings("actuated", 1e-5)
    lower, upper = np.zeros(6), np.full(6, np.inf)
    lower[1] = upper[1] = held = 1.01 * truth[1]
    problem = build(elastic("actuated"), readings, FitOptions(lower=lower, upper=upper))
    found = solve(problem).compliance
    others = [0, 2, 3, 4, 5]
    rest = (problem.d - problem.O[..., 1] * held).ravel()
    expected = np.linalg.lstsq(problem.O[..., others].reshape(-1, 5), rest)[0]
    assert found[1] == held
    np.testing.assert_allclose(found[others], expected, rtol=1e-9)


def test_weights_are_those_of_the_inverse_variances():
    readings, _ = linear_readings("actuated", 1e-4)
    sigma = np.random.default_rng(3).uniform(1e-5, 1e-4, (155, 3))
    problem = build(
        elastic("actuated"), replace(readings, marker_sigma=sigma), FitOptions(weights="sigma")
    )
    rows, d, w = problem.O.reshape(-1, 6), problem.d.ravel(), 1.0 / sigma.ravel() ** 2
    expected = np.linalg.solve((rows.T * w) @ rows, (rows.T * w) @ d)
    np.testing.assert_allclose(solve(problem).compliance, expected, rtol=1e-8)


def prior_fit(sigma, noise=2e-5):
    readings, truth = linear_readings("actuated", 2e-5)
    prior = Prior(mean=2.0 * truth, sigma=np.full(6, sigma), noise=noise)
    free = solve(build(elastic("actuated"), readings)).compliance
    found = solve(build(elastic("actuated"), readings, FitOptions(prior=prior))).compliance
    return found, free, 2.0 * truth


def test_a_vague_prior_changes_nothing_and_a_sharp_one_decides():
    found, free, _ = prior_fit(sigma=1.0)
    np.testing.assert_allclose(found, free, rtol=1e-9)
    found, _, mean = prior_fit(sigma=1e-14)
    np.testing.assert_allclose(found, mean, rtol=1e-5)


def test_a_prior_between_pulls_each_spring_towards_its_mean():
    found, free, mean = prior_fit(sigma=1e-8)
    shrunk = (found - free) / (mean - free)
    assert shrunk.max() > 0.01
    assert np.all(np.abs(shrunk) < 1.0)


def test_a_prior_is_bayes_rule():
    readings, _ = linear_readings("actuated", 2e-5)
    mean, sigma = np.full(6, 1e-6), np.logspace(-9, -6, 6)
    problem = build(elastic("actuated"), readings, FitOptions(prior=Prior(mean, sigma, 2e-5)))
    rows = problem.O.reshape(-1, 6)
    precision = rows.T @ rows / 2e-5**2 + np.diag(1.0 / sigma**2)
    expected = np.linalg.solve(precision, rows.T @ problem.d.ravel() / 2e-5**2 + mean / sigma**2)
    np.testing.assert_allclose(solve(problem).compliance, expected, rtol=1e-9)


def test_a_prior_holds_springs_that_the_data_do_not_see():
    readings, truth = linear_readings(sigma=1e-6)
    prior = Prior(mean=truth, sigma=np.full(18, 1e-7), noise=1e-6)
    found = solve(build(elastic(), readings, FitOptions(prior=prior))).compliance
    np.testing.assert_allclose(found, truth, atol=3e-7)


@pytest.mark.parametrize("loss", ["huber", "cauchy"])
def test_a_robust_loss_is_hardly_pulled_by_a_blunder(loss):
    problem, truth = planted(sigma=1e-5)
    spoiled = problem.d.copy()
    spoiled[[20, 77]] += [0.0, 0.5, 0.0]
    spoiled = replace(problem, d=spoiled)
    robust, plain = solve(spoiled, loss), solve(spoiled)
    clean = np.linalg.norm(problem.residuals(robust.compliance), axis=1).mean()
    assert clean < 2e-5
    assert np.linalg.norm(problem.residuals(plain.compliance), axis=1).mean() > 1e-4
    assert np.argsort(robust.reading_weight)[:2].tolist() in ([20, 77], [77, 20])
    assert np.linalg.norm(robust.compliance - truth) < np.linalg.norm(plain.compliance - truth)


def test_the_robust_scale_is_the_standard_deviation_of_normal_noise():
    problem, truth = planted(sigma=3e-5, poses=31)
    scaled = normalised_residuals(problem, replace(solve(problem), compliance=truth))
    norms = np.linalg.norm(problem.residuals(truth), axis=1)
    assert float(np.median(norms / scaled)) == pytest.approx(3e-5, rel=0.1)


def test_an_unknown_loss_is_refused():
    problem, _ = made_up(np.random.default_rng(0))
    with pytest.raises(IdentificationError, match="unknown loss 'median'"):
        solve(problem, "median")


@pytest.mark.parametrize("loss", ["linear", "huber"])
def test_forces_of_zero_are_refused(loss):
    problem, _ = made_up(np.random.default_rng(0))
    with pytest.raises(IdentificationError, match="load no spring"):
        solve(replace(problem, O=0.0 * problem.O), loss)


def test_reweighting_that_does_not_settle_says_so(monkeypatch):
    problem, _ = planted(sigma=1e-5)
    turns = iter(range(1000))

    def restless(u):
        return np.where(np.arange(len(u)) % 2 == next(turns) % 2, 1.0, 0.3)

    monkeypatch.setitem(LOSSES.own, "restless", restless)
    assert not solve(problem, "restless").settled
    assert solve(problem, "huber").settled
    assert solve(problem).settled


def test_exact_data_settle_though_their_weights_follow_round_off():
    problem, _ = made_up(np.random.default_rng(0))
    assert solve(problem, "huber").settled
