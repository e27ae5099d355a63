"""Intervals of 95 % hold the truth as often as they say, on three kinds of chain."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.geometry import GeometryProblem
from elastocal.geometry.determined import told_apart
from elastocal.geometry.ladder import climb
from elastocal.geometry.solve import fit, register
from elastocal.identification import interval
from elastocal.progress import silent
from support.measured_arms import ARMS, measure

CAMPAIGNS, NOISE = 100, 3e-5


@pytest.mark.slow
@pytest.mark.parametrize("arm", ARMS)
def test_95_percent_intervals_of_100_campaigns_cover_about_95_percent(arm):
    """One planted arm, measured a hundred times; the truth is what positions without noise say.

    In all three 18 to 22 numbers are free; the others are in what they go together with.
    """
    exact = measure(ARMS[arm](), 60, noise=0.0)
    problem = GeometryProblem(exact.robot, exact.data)
    start = register(problem)
    free = told_apart(problem.linearise(start)[1], problem, "geometry")
    truth = problem.values(fit(problem, free, start, np.ones(len(problem), dtype=bool)).state)
    held = []
    for campaign in range(CAMPAIGNS):
        noise = np.random.default_rng(campaign).normal(0.0, NOISE, exact.data.markers.shape)
        noisy = GeometryProblem(
            exact.robot, replace(exact.data, markers=exact.data.markers + noise)
        )
        found = climb(noisy, 200, np.random.default_rng(campaign), silent)
        low, high = interval(found.whole.draws)
        own = [i for i in free[0] if problem.unknowns[i].rung != "registration"]
        held.append((low[own] <= truth[own]) & (truth[own] <= high[own]))
    covered = np.mean(held, axis=0)
    print(f"{arm}: {covered.mean():.1%} of all, {covered.min():.0%} of the worst of {len(covered)}")
    assert 0.92 < covered.mean() < 0.98
    assert covered.min() > 0.8
