from dataclasses import replace

import numpy as np
import pytest

from elastocal.identification import build, factor, screen, solve
from elastocal.identification.suspicious import BLUNDER_SCORE, leverage
from elastocal.sim.arm import (
    Blunder,
)
from support.cells import Cell, linear_truth
from support.problems import campaign, elastic, made_up, planted

POSE, CASE = 12, "north"


def screened(size, springs="bearing"):
    blunder = Blunder(POSE, CASE, (0.0, size, 0.0))
    readings = Cell(linear_truth(), blunders=(blunder,)).readings()
    at = int(np.flatnonzero((readings.pose == POSE) & (readings.load_case == CASE))[0])
    return screen(build(elastic(springs), readings)), at


@pytest.mark.parametrize("springs", ["actuated", "bearing"])
@pytest.mark.parametrize("size", [3e-3, -0.5])
def test_a_blunder_is_named_alone_and_set_aside(springs, size):
    screening, at = screened(size, springs)
    assert screening.score.argmax() == at
    assert np.flatnonzero(screening.blunder).tolist() == [at]
    assert screening.suspicious[at]
    assert np.count_nonzero(screening.suspicious) <= 2
    assert screening.residual[at] == pytest.approx(abs(size), rel=0.1)


def test_a_doubtful_reading_is_named_and_kept():
    """0.3 mm could still be stick-slip: it is for the engineer to judge."""
    screening, at = screened(3e-4)
    assert screening.score.argmax() == at
    assert screening.suspicious[at]
    assert not np.any(screening.blunder)


def test_clean_data_name_nothing():
    screening, _ = screened(0.0)
    assert not np.any(screening.suspicious)


def test_a_large_score_with_a_small_residual_is_no_blunder():
    """Without noise, a micrometre is many standard deviations."""
    problem, _ = planted(sigma=1e-8)
    d = problem.d.copy()
    d[7] += 1e-5
    screening = screen(replace(problem, d=d))
    assert screening.score[7] > BLUNDER_SCORE
    assert not np.any(screening.blunder)


def test_a_bad_campaign_is_not_made_good_by_leaving_readings_out():
    problem, _ = planted(sigma=1e-5)
    d = problem.d.copy()
    bad = np.random.default_rng(0).choice(155, 30, replace=False)
    d[bad] += 0.1
    screening = screen(replace(problem, d=d))
    assert not np.any(screening.blunder)
    assert np.all(screening.suspicious[bad])


def test_one_reading_in_ten_may_be_set_aside():
    problem, _ = planted(sigma=1e-5)
    d = problem.d.copy()
    bad = np.random.default_rng(0).choice(155, 15, replace=False)
    d[bad] += 0.1
    np.testing.assert_array_equal(
        np.flatnonzero(screen(replace(problem, d=d)).blunder), sorted(bad)
    )


@pytest.mark.slow
@pytest.mark.parametrize(("springs", "blocks"), [(5, 3), (5, 10), (16, 10), (16, 40)])
def test_normal_noise_names_a_reading_in_few_of_a_hundred_campaigns(springs, blocks):
    """The fit takes up to half of the noise away: leverage and scale make up for it."""
    rng = np.random.default_rng(springs + blocks)
    alarms = []
    for _ in range(60):
        O = rng.normal(size=(4 * blocks, 3, springs))  # noqa: E741
        problem, _ = made_up(rng, blocks, springs, O=O, d=rng.normal(size=(4 * blocks, 3)))
        free = replace(problem, lower=np.full(springs, -np.inf))
        alarms.append(bool(np.any(screen(free).suspicious)))
    assert np.mean(alarms) <= 0.05


def test_leverage_is_the_mean_diagonal_of_the_hat_matrix():
    problem, _ = made_up(np.random.default_rng(0))
    problem = problem.reweighted(np.random.default_rng(1).uniform(0.2, 2.0, 32))
    rows = (problem.O * problem.weight[..., None]).reshape(-1, 5)
    hat = rows @ np.linalg.pinv(rows)
    expected = np.diag(hat).reshape(32, 3).mean(axis=1)
    np.testing.assert_allclose(leverage(problem, solve(problem)), expected, rtol=1e-9)


def test_a_score_makes_up_for_what_the_reading_took_from_its_residual():
    problem, _ = planted(sigma=1e-5, poses=6)
    screening = screen(problem)
    plain = screening.residual / np.sqrt(1.0 - screening.leverage)
    np.testing.assert_allclose(screening.score / plain, screening.score[0] / plain[0])
    assert np.ptp(screening.leverage) > 0.02


def test_leverages_add_up_to_what_is_observable():
    problem = build(elastic(), campaign())
    assert 3.0 * leverage(problem, solve(problem)).sum() == pytest.approx(15.0, abs=1e-6)
    assert np.linalg.matrix_rank(factor(problem).s[:, None] * factor(problem).Vt, tol=1e-5) == 15


def test_a_reading_that_alone_decides_a_spring_has_full_leverage():
    problem, _ = made_up(np.random.default_rng(0))
    problem.O[..., 4] = 0.0
    problem.O[3, :, 4] = [1e4, 1e4, 1e4]
    found = leverage(problem, solve(problem))
    assert found.argmax() == 3
    assert found[3] > 1.0 / 3.0
    assert np.all((found > 0.0) & (found <= 0.99))


def test_exact_data_are_screened():
    problem, _ = planted()
    screening = screen(problem)
    assert np.all(np.isfinite(screening.score))
    assert not np.any(screening.blunder)
