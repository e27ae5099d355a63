from dataclasses import replace

import numpy as np
import pytest

from elastocal.errors import IdentificationError
from elastocal.identification import FitOptions, Prior, build, solve
from elastocal.identification.solve import PoseGrams, fit_each, grams_of, least_squares_left
from support.problems import elastic, linear_readings, made_up, planted

CHOICES = np.array([[1.0] * 31, [2.0, 0.0, 3.0] + [1.0] * 28, [0.0] * 20 + [1.0] * 11])


def stacked(problem, multiplicity):
    """Return the problem with whole pose blocks repeated or left out."""
    rows = [
        np.flatnonzero(problem.block == block)
        for block, times in enumerate(multiplicity)
        for _ in range(int(times))
    ]
    return problem.take(np.concatenate(rows))


@pytest.mark.parametrize(
    "options",
    [
        FitOptions(),
        FitOptions(lower=-np.inf),
        FitOptions(lower=4e-7, upper=1e-6),
        FitOptions(prior=Prior(np.full(6, 1e-6), np.full(6, 1e-8), 2e-5)),
        FitOptions(prior=Prior(np.full(6, 1e-6), np.full(6, 1e-8), 2e-5), lower=4e-7, upper=9e-7),
    ],
    ids=["default", "free", "box", "prior", "prior in a box"],
)
def test_a_refit_is_the_solution_of_the_stacked_poses(options):
    problem, _ = planted(sigma=2e-5, options=options)
    found = PoseGrams.of(problem).refit(CHOICES)
    for compliance, choice in zip(found, CHOICES, strict=True):
        expected = solve(stacked(problem, choice)).compliance
        np.testing.assert_allclose(compliance, expected, rtol=1e-6, atol=1e-14)


def test_weights_enter_the_refit():
    problem, _ = planted(sigma=2e-5)
    weighted = problem.reweighted(np.random.default_rng(0).uniform(0.0, 2.0, 155))
    np.testing.assert_allclose(
        PoseGrams.of(weighted).refit(CHOICES[:1])[0], solve(weighted).compliance, rtol=1e-7
    )


def test_rank_deficient_refits_predict_as_the_solutions_do():
    readings, _ = linear_readings(sigma=2e-5)
    problem = build(elastic(), readings)
    for compliance, choice in zip(PoseGrams.of(problem).refit(CHOICES), CHOICES, strict=True):
        expected = solve(stacked(problem, choice)).compliance
        np.testing.assert_allclose(problem.O @ compliance, problem.O @ expected, atol=1e-8)


def test_blocks_may_have_any_numbers_in_any_order():
    problem, _ = made_up(np.random.default_rng(0), blocks=4)
    problem = replace(problem, d=problem.d + np.random.default_rng(1).normal(size=(16, 3)))
    renamed = replace(problem, block=np.array([30, 7, 12, 9])[problem.block])
    order = np.random.default_rng(2).permutation(16)
    found = PoseGrams.of(renamed.take(order)).refit(np.array([[0.0, 1.0, 1.0, 1.0]]))[0]
    # Sorted, the second block (7) comes first.
    expected = solve(problem.take(problem.block != 1)).compliance
    np.testing.assert_allclose(found, expected, rtol=1e-7)


def test_a_choice_of_one_pose_is_fitted_as_far_as_it_goes():
    problem, _ = planted()
    one = np.eye(31)[:1]
    compliance = PoseGrams.of(problem).refit(one)[0]
    np.testing.assert_allclose(problem.residuals(compliance)[problem.block == 0], 0.0, atol=1e-9)
    assert np.all(np.isfinite(compliance))


def test_a_choice_of_nothing_is_refused():
    problem, _ = planted()
    with pytest.raises(IdentificationError, match="load no spring"):
        PoseGrams.of(problem).refit(np.zeros((1, 31)))


def test_sums_of_blocks_a_few_at_a_time_are_those_of_all_at_once(monkeypatch):
    problem, _ = planted(sigma=1e-5)
    whole = PoseGrams.of(problem).refit(CHOICES)
    monkeypatch.setitem(PoseGrams._sums.__globals__, "_BLOCKS", 4)
    np.testing.assert_allclose(PoseGrams.of(problem).refit(CHOICES), whole, rtol=1e-9)


@pytest.mark.parametrize("lower", [-np.inf, 0.0, 1e-6])
def test_no_fit_leaves_less_than_least_squares(lower):
    problem, _ = planted(sigma=2e-5, options=FitOptions(lower=lower))
    turned = [replace(problem, d=problem.d * sign) for sign in ([1, 1, 1], [1, -1, 1])]
    least = least_squares_left(grams_of(turned), problem.size)
    fits = zip(turned, fit_each(turned), strict=True)
    left = np.array([np.sum(each.residuals(x) ** 2) for each, x in fits])
    assert np.all(least <= left * (1.0 + 1e-5))
    if np.isinf(lower):
        np.testing.assert_allclose(least, left, rtol=1e-5)
    else:
        assert left[1] > 1.1 * least[1]


def test_a_spring_that_nothing_loads_leaves_least_squares_as_they_are():
    problem, _ = planted(sigma=2e-5)
    dead = replace(problem, O=problem.O * (np.arange(problem.columns) > 0))
    alone = dead.with_columns(np.arange(1, problem.columns))
    each = [least_squares_left(grams_of([it]), it.size)[0] for it in (dead, alone)]
    assert each[0] == pytest.approx(each[1], rel=1e-9)
