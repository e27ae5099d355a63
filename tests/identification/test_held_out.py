from dataclasses import replace

import numpy as np
import pytest

from elastocal.identification import leave_poses_out, solve
from elastocal.identification.uncertainty import MOST_FOLDS, Misfit
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
    over = found.axis_error / found.misfit.error(found.size)[:, None]
    above = np.sum(over > 1.0 + 1e-12)
    assert above / over.size < 0.05
    assert (above + 2) / (over.size + 1) > 0.05
    assert np.isclose(over, 1.0, rtol=1e-12).any()


def test_the_misfit_of_too_few_errors_is_not_known():
    found = leave_poses_out(noisy(blocks=8)[0])
    assert not Misfit.of(found.axis_error[:6], found.size[:6]).is_known


def test_the_misfit_where_nothing_is_predicted_is_not_known():
    found = leave_poses_out(noisy(blocks=8)[0])
    assert not Misfit.of(found.axis_error, np.zeros_like(found.size)).is_known


@pytest.mark.parametrize(("noise", "share"), [(20e-6, 0.0), (0.0, 0.05), (20e-6, 0.05)])
def test_noise_and_what_grows_with_the_load_are_told_from_one_another(noise, share):
    rng = np.random.default_rng(5)
    size = rng.uniform(0.1e-3, 2e-3, 2000)
    spread = np.hypot(noise, share * size)[:, None]
    found = Misfit.of(np.abs(spread * rng.normal(size=(2000, 3))), size)
    assert found.floor == pytest.approx(1.96 * noise, rel=0.1, abs=4e-6)
    assert found.share == pytest.approx(1.96 * share, rel=0.1, abs=6e-3)


def test_of_deflections_that_are_alike_all_of_the_misfit_grows_with_them():
    rng = np.random.default_rng(6)
    size = rng.uniform(1.0e-3, 1.2e-3, 500)
    found = Misfit.of(np.abs(20e-6 * rng.normal(size=(500, 3))), size)
    assert found.floor == 0.0
    assert found.share == pytest.approx(1.96 * 20e-6 / 1.1e-3, rel=0.15)


def test_the_interval_of_a_measurement_holds_at_every_load():
    """Noise of 20 µm and a law that springs do not express: 4 % of each deflection."""
    rng, inside = np.random.default_rng(7), []
    for _ in range(40):
        size = np.tile([0.2e-3, 0.5e-3, 1e-3, 2e-3], 30)
        error = np.abs(np.hypot(20e-6, 0.04 * size)[:, None] * rng.normal(size=(120, 3)))
        found = Misfit.of(error[:60], size[:60])
        inside.append((error[60:] <= found.error(size[60:])[:, None]).reshape(15, 4, 3))
    by_load = np.mean(inside, axis=(0, 1, 3))
    assert np.all(np.abs(by_load - 0.95) < 0.03)


def test_mean_and_max_are_those_of_the_errors():
    found = leave_poses_out(noisy(blocks=4)[0])
    assert (found.mean, found.max) == (found.error.mean(), found.error.max())
