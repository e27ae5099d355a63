"""Data of the shape that public campaigns have: what is left is what no geometry explains."""

import numpy as np
import pytest

from elastocal.geometry import GeometryModel, GeometryProblem, geometry_model
from elastocal.geometry.ladder import climb
from elastocal.progress import silent
from support.measured_arms import Measured, kuka, measure, seven_axes, universal

FLOOR = 0.36e-3
"""Mean distance of what is no geometry, as a good fit leaves it on a public UR10."""
NOISE = FLOOR / np.sqrt(8.0 / np.pi)
SMALL = {"error": 3e-4, "noise": NOISE, "markers": 1, "stations": 1, "gears": 1e-4}


def fitted(measured: Measured, train: np.ndarray) -> GeometryModel:
    problem = GeometryProblem(measured.robot, measured.data.rows(train))
    found = climb(problem, 40, np.random.default_rng(1), silent)
    return geometry_model(problem, found, "test")


def left_out_error(measured: Measured, model: GeometryModel, rows: np.ndarray) -> float:
    data = measured.data.rows(rows)
    return float(np.linalg.norm(model.predict(data) - data.markers, axis=2).mean())


def every_fifth(count: int) -> np.ndarray:
    return np.arange(count) % 5 == 0


@pytest.mark.slow
def test_four_series_of_an_arm_with_parallel_axes_reach_the_floor():
    errors = []
    for series in range(4):
        measured = measure(universal(), 4203, seed=series, **SMALL)
        kept = every_fifth(4203)
        errors.append(left_out_error(measured, fitted(measured, ~kept), kept))
    assert np.mean(errors) < 1.03 * FLOOR


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_eight_hundred_random_poses_neither_over_nor_underfit(seed):
    measured = measure(universal(), 1000, seed=seed, **SMALL)
    train = np.arange(1000) < 800
    assert left_out_error(measured, fitted(measured, train), ~train) < 1.1 * FLOOR


@pytest.mark.slow
def test_payloads_of_a_small_arm_are_one_model_and_no_moved_station():
    """Under 0, 1.25 and 2.5 kg, one after the other, as a campaign goes."""
    payloads = tuple(np.repeat([0.0, 1.25, 2.5], 300).tolist())
    measured = measure(seven_axes(), 900, payloads=payloads, compliance=2e-5, **SMALL)
    kept = every_fifth(900)
    model = fitted(measured, ~kept)
    assert not [finding for finding in model.findings if "station" in finding]
    assert left_out_error(measured, model, kept) < 1.1 * FLOOR
    assert next(each.rung for each in model.ladder if each.chosen) in ("weight", "harmonics")


@pytest.mark.parametrize("seed", range(2))
def test_six_blunders_among_three_markers_are_named(seed):
    measured = measure(kuka(), 60, seed=seed, noise=1e-4, stations=1, gears=5e-5, blunders=6)
    assert set(fitted(measured, np.full(60, True)).blunders) == measured.blunders
