"""Ends of intervals by the profile, held against closed forms of two springs."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.identification.problem import Problem
from elastocal.identification.solve import solve
from elastocal.identification.uncertainty import (
    NORMAL_QUANTILE,
    noise_of_a_direction,
    profile_ends,
)
from support.problems import made_up

NOISE = 0.1


def free(problem: Problem) -> Problem:
    return replace(problem, lower=np.full(5, -np.inf), upper=np.full(5, np.inf))


def two_alike(second: float, rng: np.random.Generator) -> tuple[Problem, np.ndarray]:
    """Return readings of two springs that make like deflections, and their rows.

    The first compliance is 1; ``second`` is what noise makes of the other one, which is zero.
    """
    A = rng.standard_normal((40, 3, 2))
    A[..., 1] = A[..., 0] + 0.3 * A[..., 1]
    block = np.repeat(np.arange(10), 4)
    problem = Problem(
        O=A,
        d=A @ np.array([1.0, second]),
        weight=np.ones((40, 3)),
        block=block,
        lower=np.zeros(2),
        upper=np.full(2, np.inf),
        prior_rows=np.zeros((0, 3)),
    )
    return problem, A.reshape(-1, 2)


def test_far_from_bounds_the_ends_are_those_of_linear_least_squares():
    problem = free(made_up(np.random.default_rng(0), blocks=40)[0])
    c = solve(problem).compliance
    rows = problem.weighted()[..., :-1].reshape(-1, 5)
    covariance = NOISE**2 * np.linalg.inv(rows.T @ rows)
    sums = np.vstack([np.eye(5), [1.0, -1.0, 0.5, 0.0, 2.0]])
    half = NORMAL_QUANTILE * np.sqrt(np.einsum("si,ij,sj->s", sums, covariance, sums))
    ends = profile_ends(problem, c, sums, NOISE)
    np.testing.assert_allclose(ends, (sums @ c)[:, None] + half[:, None] * [-1, 1], rtol=2e-3)


@pytest.mark.parametrize("second", [0.0, 0.01, -0.01])
def test_beside_a_spring_at_its_bound_the_upper_end_is_that_without_it(second):
    """Where the other one is zero the first is as large as one spring alone can be."""
    problem, A = two_alike(second, np.random.default_rng(1))
    c = solve(problem).compliance
    ends = profile_ends(problem, c, np.eye(2), NOISE)
    alone, d = A[:, 0], problem.d.ravel()
    left = np.sum(np.square(A @ c - d))
    found = float(alone @ d) / float(alone @ alone)
    without = float(np.sum(np.square(alone * found - d)))
    room = (NORMAL_QUANTILE * NOISE) ** 2 - (without - left)
    assert room > 0.0
    assert ends[0, 1] == pytest.approx(found + np.sqrt(room / (alone @ alone)), rel=1e-3)
    assert ends[1, 0] == pytest.approx(0.0, abs=1e-9)
    assert ends[0, 0] < c[0] < ends[0, 1]


def test_nothing_within_the_bounds_that_explains_as_well_lies_beyond_the_ends():
    rng = np.random.default_rng(2)
    problem, _ = two_alike(0.02, rng)
    c = solve(problem).compliance
    sums = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, -2.0]])
    ends = profile_ends(problem, c, sums, NOISE)
    tried = np.maximum(c + 0.1 * rng.standard_normal((20_000, 2)), 0.0)
    left = np.sum(np.square(np.einsum("rin,tn->tri", problem.O, tried) - problem.d), axis=(1, 2))
    least = np.sum(np.square(problem.residuals(c)))
    as_good = tried[left - least <= (NORMAL_QUANTILE * NOISE) ** 2] @ sums.T
    assert len(as_good) > 100
    wide = 1.01 * (ends[:, 1] - ends[:, 0]) - (ends[:, 1] - ends[:, 0])
    assert np.all(as_good >= ends[:, 0] - wide)
    assert np.all(as_good <= ends[:, 1] + wide)
    # Nor are the ends farther than what was tried.
    np.testing.assert_allclose(as_good.max(axis=0), ends[:, 1], atol=0.01)
    np.testing.assert_allclose(as_good.min(axis=0), ends[:, 0], atol=0.01)


def test_what_the_readings_leave_open_has_no_end():
    problem, _ = made_up(np.random.default_rng(0), blocks=40)
    twins = replace(problem, O=problem.O[..., [0, 0, 2, 3, 4]])
    c = solve(twins).compliance
    sums = np.array([[1.0, 0, 0, 0, 0], [1.0, 1.0, 0, 0, 0], [0, 0, 0, 0, 1.0]])
    ends = profile_ends(twins, c, sums, NOISE)
    assert np.isnan(ends[0]).all()
    assert np.isfinite(ends[1:]).all()


def test_the_noise_of_a_direction_is_that_of_independent_rows():
    """Where draws spread three times as far, rows of a pose share their errors."""
    rng = np.random.default_rng(3)
    problem = free(made_up(rng, blocks=40)[0])
    rows = problem.weighted()[..., :-1].reshape(-1, 5)
    campaigns = NOISE * rng.standard_normal((400, len(rows)))
    draws = np.linalg.lstsq(rows, campaigns.T, rcond=None)[0].T
    assert noise_of_a_direction(problem, np.zeros(5), draws) == pytest.approx(NOISE, rel=0.05)
    assert noise_of_a_direction(problem, np.zeros(5), 3.0 * draws) == pytest.approx(
        3.0 * NOISE, rel=0.05
    )
