from dataclasses import replace

import numpy as np
import pytest

from elastocal.identification import leave_poses_out, solve
from elastocal.identification.uncertainty import MOST_FOLDS
from support.problems import made_up, planted


def noisy(blocks, seed=0, sigma=0.1):
    problem, truth = made_up(np.random.default_rng(seed), blocks=blocks)
    noise = np.random.default_rng(seed + 1).normal(0.0, sigma, problem.d.shape)
    return replace(problem, d=problem.d + noise), truth


def test_leaving_poses_out_is_a_loop_of_refits():
    problem, _ = planted(sigma=2e-5)
    found = leave_poses_out(problem)
    assert found.folds == 31
    for block in range(31):
        out = problem.block == block
        refit = solve(problem.take(~out)).compliance
        expected = np.linalg.norm(problem.residuals(refit)[out], axis=1)
        np.testing.assert_allclose(found.error[out], expected, rtol=1e-5, atol=1e-12)


def test_each_reading_is_predicted_by_a_fit_without_its_pose():
    problem, _ = noisy(blocks=8)
    found = leave_poses_out(problem)
    predicted = np.einsum("rin,rn->ri", problem.O, found.compliance[found.fold])
    np.testing.assert_allclose(np.linalg.norm(predicted - problem.d, axis=1), found.error)
    spoiled = replace(problem, d=np.where((problem.block == 3)[:, None], 1e3, problem.d))
    again = leave_poses_out(spoiled)
    fold = int(found.fold[problem.block == 3][0])
    np.testing.assert_allclose(again.compliance[fold], found.compliance[fold], rtol=1e-9)


def test_many_poses_are_left_out_together():
    problem, _ = noisy(blocks=MOST_FOLDS + 30)
    found = leave_poses_out(problem)
    assert found.folds == MOST_FOLDS
    together = found.fold == 0
    assert set(problem.block[together]) == {0, MOST_FOLDS}
    refit = solve(problem.take(~together)).compliance
    np.testing.assert_allclose(found.compliance[0], refit, rtol=1e-6)


def test_held_out_errors_exceed_those_of_the_fit():
    problem, _ = noisy(blocks=4)
    fit = np.linalg.norm(problem.residuals(solve(problem).compliance), axis=1).mean()
    assert leave_poses_out(problem).mean > fit


def test_the_misfit_is_what_95_percent_of_the_errors_along_an_axis_stay_below():
    problem, _ = noisy(blocks=8)
    found = leave_poses_out(problem)
    predicted = np.einsum("rin,rn->ri", problem.O, found.compliance[found.fold])
    shares = [
        abs(value) / np.sqrt(sum(predicted[row] ** 2))
        for row in range(len(predicted))
        for value in predicted[row] - problem.d[row]
    ]
    above = sum(share > found.misfit for share in shares)
    assert above / len(shares) < 0.05
    assert (above + 2) / (len(shares) + 1) > 0.05
    assert any(share == pytest.approx(found.misfit, rel=1e-12) for share in shares)


def test_the_misfit_of_too_few_errors_is_not_known():
    found = leave_poses_out(noisy(blocks=8)[0])
    assert np.isnan(replace(found, share=found.share[:6]).misfit)


def test_the_misfit_where_nothing_is_predicted_is_not_known():
    found = leave_poses_out(noisy(blocks=8)[0])
    assert np.isnan(replace(found, share=np.full_like(found.share, np.inf)).misfit)


def test_the_share_of_a_reading_that_no_spring_deflects_is_infinite():
    problem, _ = noisy(blocks=8)
    problem.O[5] = 0.0
    share = leave_poses_out(problem).share
    assert np.all(np.isinf(share[5]))
    assert np.all(np.isfinite(np.delete(share, 5, axis=0)))


def test_mean_and_max_are_those_of_the_errors():
    found = leave_poses_out(noisy(blocks=4)[0])
    assert (found.mean, found.max) == (found.error.mean(), found.error.max())
