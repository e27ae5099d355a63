import numpy as np
import pytest

from elastocal.sim.arm import DeadLoads, Linear, LoadedMechanism, Screws
from elastocal.sim.arm.gears import StiffeningGear

STEP = 1e-6


@pytest.fixture(params=[0, 1, 2])
def mechanism(request):
    """Seven elements, five of them springs, turning and sliding in turn, with four loads."""
    rng = np.random.default_rng(request.param)
    axis = rng.standard_normal((7, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    screws = Screws(axis, rng.standard_normal((7, 3)), rng.random(7) < 0.6)
    held = np.zeros((4, 7))
    held[:, [1, 4]] = rng.uniform(-1, 1, (4, 2))
    loads = DeadLoads(
        rng.standard_normal((4, 3)), np.array([7, 3, 5, 1]), 50 * rng.standard_normal((4, 4, 3))
    )
    laws = [Linear(200.0), StiffeningGear(150.0, 0.4, 0.3), *3 * [Linear(99)]]
    return LoadedMechanism(screws, np.array([0, 2, 3, 5, 6]), laws, held, loads)


@pytest.fixture
def theta():
    return np.random.default_rng(9).uniform(-0.5, 0.5, (4, 5))


def evaluate(mechanism, theta):
    rest = mechanism.load_points(mechanism.motions(np.zeros_like(theta)))
    return mechanism.evaluate(theta, rest)


def test_gradient_is_the_derivative_of_the_energy(mechanism, theta):
    state = evaluate(mechanism, theta)
    for k, step in enumerate(STEP * np.eye(5)):
        ahead, behind = evaluate(mechanism, theta + step), evaluate(mechanism, theta - step)
        slope = (ahead.energy - behind.energy) / (2 * STEP)
        np.testing.assert_allclose(state.gradient[:, k], slope, atol=1e-6)


def test_hessian_is_the_derivative_of_the_gradient(mechanism, theta):
    state = evaluate(mechanism, theta)
    for k, step in enumerate(STEP * np.eye(5)):
        ahead, behind = evaluate(mechanism, theta + step), evaluate(mechanism, theta - step)
        slope = (ahead.gradient - behind.gradient) / (2 * STEP)
        np.testing.assert_allclose(state.hessian[:, :, k], slope, atol=1e-5)


def test_the_loads_stiffen_or_soften_more_than_the_springs_diagonal(mechanism, theta):
    state = evaluate(mechanism, theta)
    springs = state.spring_stiffness[:, :, None] * np.eye(5)
    assert np.abs(state.hessian - springs).max() > 1.0


def test_the_undeformed_arm_has_no_energy(mechanism, theta):
    np.testing.assert_array_equal(evaluate(mechanism, np.zeros_like(theta)).energy, 0.0)
