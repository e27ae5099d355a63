"""Mean, drift and spread of a force, and what is said about them."""

import numpy as np
import pytest

from elastocal.cell import ProcedureSettings
from elastocal.procedure.run.steps import (
    RecentSamples,
    steadiness,
    why_off,
    why_shaking,
    why_unsteady,
)

LIMITS = ProcedureSettings()
TIME = np.arange(50) / 100.0
TOOTHED = np.where(np.arange(50) % 2, 4.0, -4.0)[:, None]


def ramp(slope, sigma=0.0, mean=(0.0, 0.0, -1100.0), seed=1):
    noise = sigma * np.random.default_rng(seed).standard_normal((50, 3))
    return np.array(mean) + slope * (TIME - TIME.mean())[:, None] * [0.0, 0.0, 1.0] + noise


def test_a_straight_line_has_its_mean_its_slope_and_no_spread():
    found = steadiness(TIME, ramp(12.0))
    np.testing.assert_allclose(found.mean, [0.0, 0.0, -1100.0])
    assert found.drift == pytest.approx(12.0)
    assert found.spread == pytest.approx(0.0, abs=1e-9)


def test_the_spread_is_four_standard_deviations():
    many = [steadiness(TIME, ramp(0.0, 1.5, seed=seed)).spread for seed in range(40)]
    # The largest of three axes is above the middle of one.
    assert 6.0 < np.mean(many) < 7.0


def test_the_time_of_day_changes_no_bit():
    force = ramp(3.0, 1.0)
    ticks = np.arange(50) * 10_000
    here, later = (steadiness((ticks + start) / 1e6, force) for start in (0, 86_399_990_001))
    assert here.drift == later.drift
    assert here.spread == later.spread


@pytest.mark.parametrize(
    ("force", "target", "said"),
    [
        (ramp(0.0), -1100.0, ""),
        (ramp(0.0), -1106.0, "force is off 6.0 N, limit 5 N"),
        (ramp(6.0), -1100.0, "force drifts by 6.0 N/s, limit 5 N/s"),
        (ramp(0.0) + TOOTHED, -1100.0, "force spreads over"),
        (ramp(np.nan), -1100.0, "force is off nan N"),
    ],
)
def test_what_is_not_steady_is_said(force, target, said):
    found = steadiness(TIME, force)
    why = why_off(found, np.array([0.0, 0.0, target]), 5.0) or why_unsteady(found, LIMITS)
    assert why.startswith(said) if said else not why


def test_a_stretch_keeps_what_is_young_enough():
    stretch = RecentSamples(0.1)
    for block in range(10):
        time = block * 0.04 + np.arange(4) / 100.0
        stretch.add(time, np.full((4, 3), block))
    stretch.add(np.empty(0), np.empty((0, 3)))
    assert stretch.time[-1] - stretch.time[0] == pytest.approx(0.11)
    assert len(stretch) == len(stretch.time) == len(stretch.values)


def test_a_marker_is_shaking_by_its_worst_axis():
    positions = np.zeros((4, 3))
    positions[:, 1] = [0.0, 2e-4, 0.0, 2e-4]
    assert why_shaking(positions, 50e-6) == "marker has a sigma of 115 um, limit 50 um"
    assert why_shaking(positions, 116e-6) == ""
