"""Refits through triangles equal the fit itself."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import nnls

from elastocal.errors import IdentificationError
from elastocal.identification import FitOptions, PoseTriangles, solve
from support.problems import made_up, planted


@pytest.mark.parametrize(
    "options", [FitOptions(), FitOptions(lower=-np.inf), FitOptions(upper=1e-6)]
)
def test_refits_equal_solve_on_the_same_poses(options):
    problem, _ = planted(sigma=2e-5, poses=14, options=options)
    order = np.random.default_rng(0).permutation(14)
    choices = [order[:n] for n in range(1, 15)] + [order[3:7], order[3:8], order[:1]]
    found = PoseTriangles.of(problem, np.arange(14)).fit(choices)
    for compliance, choice in zip(found, choices, strict=True):
        wanted = solve(problem.take(np.isin(problem.block, choice))).compliance
        np.testing.assert_allclose(compliance, wanted, rtol=0, atol=1e-12 * np.abs(wanted).max())


def test_refits_have_the_prior_of_the_problem():
    problem, _ = planted(sigma=2e-5, poses=8, options=FitOptions())
    prior = np.append(2.0 * problem.scaled().scale, 1e-3)[None]
    problem = replace(problem, prior_rows=prior)
    triangles = PoseTriangles.of(problem, np.arange(8))
    choices = [np.arange(3), np.arange(5), np.arange(2, 8)]
    for compliance, choice in zip(triangles.fit(choices), choices, strict=True):
        part = problem.take(np.isin(problem.block, choice))
        wanted = solve(part).compliance
        scale = 1e-10 * np.abs(wanted).max()
        np.testing.assert_allclose(compliance, wanted, rtol=0, atol=scale)
        assert np.abs(compliance - solve(part.without_prior()).compliance).max() > 1e3 * scale
        (triangle,) = triangles.grown([choice])
        rows = np.vstack([part.weighted().reshape(-1, triangle.shape[1]), prior])
        np.testing.assert_allclose(triangle.T @ triangle, rows.T @ rows, rtol=1e-9, atol=1e-20)


def test_a_full_rank_refit_is_that_of_plain_nnls():
    problem, _ = made_up(np.random.default_rng(2))
    found = PoseTriangles.of(problem, np.arange(8)).fit([np.arange(8)])[0]
    scale = np.linalg.norm(problem.O, axis=(0, 1))
    rows = (problem.O / scale).reshape(-1, problem.columns) * problem.weight.ravel()[:, None]
    wanted = nnls(rows, (problem.d * problem.weight).ravel())[0] / scale
    np.testing.assert_allclose(found * scale, wanted * scale, atol=1e-10)


def test_a_choice_that_determines_nothing_is_refused():
    problem, _ = planted(poses=5)
    triangles = PoseTriangles.of(problem.take(problem.block != 2), np.arange(5))
    with pytest.raises(IdentificationError, match="nothing can be identified"):
        triangles.fit([np.array([2])])
