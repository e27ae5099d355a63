import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elastocal.procedure.derive.tool import UnloadedWrenches, estimate_tool

GRAVITY = np.array([0.0, 0.0, -9.80665])


def change(at: int, step: float, count: int = 12, seed: int = 0, drift: float = 0.01):
    """Return what is found of a step of the mass, in kg, at a reading."""
    rng = np.random.default_rng(seed)
    turns = rng.uniform(-0.4, 0.4, (count, 3)) + np.array([np.pi, 0.0, 0.0])
    R = Rotation.from_euler("xyz", turns).as_matrix()
    mass = 60.0 + step * (np.arange(count) >= at)
    time = 60.0 * np.arange(count)
    force = mass[:, None] * (GRAVITY @ R) + drift * time[:, None]
    force += 0.5 * rng.normal(size=force.shape)
    return estimate_tool(
        UnloadedWrenches(time, force, np.zeros_like(force), R, GRAVITY), 60.0
    ).change


@pytest.mark.parametrize("at", [1, 6, 11])
def test_a_step_is_found_at_its_reading_with_its_size(at):
    found = change(at, 20.0)
    assert found.reading == at
    assert found.mass == pytest.approx(20.0, abs=1.0)


def test_noise_and_drift_are_no_step():
    assert not any(change(0, 0.0, seed=seed) for seed in range(200))


def test_a_step_of_little_weight_is_not_told():
    assert change(6, 2.0) is None


@pytest.mark.parametrize("count", [0, 1, 2])
def test_too_few_readings_show_no_step(count):
    assert change(1, 20.0, count) is None
