import numpy as np
import pytest

from elastocal.sim.arm import BalancerSpring, GearLaws, RobotSprings
from elastocal.sim.truth import Gears

K = np.array([2e6, 1e6, 5e5])
ENTRY = Gears()
BALANCER = BalancerSpring(5e4, 0.3, 0.6, 0.18, -1.5)
STEP = 1e-8


def springs(entry=ENTRY, balancer=None, joint_angle=0.4):
    laws = GearLaws.of(entry, np.array([0, 2]), K[[0, 2]])
    return RobotSprings(K, laws, None, balancer, 0, joint_angle)


def torque(bank, twist):
    return bank.evaluate(np.array([[twist, 0.0, 0.0]]))[1][0, 0]


def follow(bank, twists):
    """Torque of the first gear along a way, with its memory."""
    found = []
    for twist in twists:
        found.append(torque(bank, twist))
        bank = bank.drawn_along(np.array([twist, 0.0, 0.0]))
    return np.array(found)


def loop(amplitude, steps=200):
    up = np.linspace(-amplitude, amplitude, steps)
    return np.concatenate([np.linspace(0, amplitude, steps), up[::-1], up])


@pytest.mark.parametrize("balancer", [None, BALANCER])
@pytest.mark.parametrize("slider", [None, 3e-5])
def test_torque_and_stiffness_are_derivatives_of_the_energy(balancer, slider):
    bank = springs(balancer=balancer)
    if slider is not None:
        bank = bank.relaxed(np.full(3, slider))
    theta = np.random.default_rng(2).uniform(-4e-4, 4e-4, (6, 3))
    _, torques, stiffness = bank.evaluate(theta)
    for k, step in enumerate(STEP * np.eye(3)):
        high, low = bank.evaluate(theta + step), bank.evaluate(theta - step)
        np.testing.assert_allclose(torques[:, k], (high[0] - low[0]) / (2 * STEP), atol=0.3)
        np.testing.assert_allclose(
            stiffness[:, k], (high[1][:, k] - low[1][:, k]) / (2 * STEP), rtol=1e-5
        )


def test_a_gear_stiffens_with_torque():
    _, _, stiffness = springs().evaluate(np.array([[0.0] * 3, [1e-3] * 3]))
    soft, stiff = stiffness[:, 0] / K[0]
    assert soft == pytest.approx(0.2, abs=0.01)
    assert 0.95 < stiff < 1.0


def test_a_torque_and_its_opposite_are_the_backlash_further_apart():
    entry = Gears(growth=0.0, hysteresis=0.0, backlash="0.1 mrad".replace("0.1 m", "1e-4 "))
    found = torque(springs(entry), 1e-3)
    assert 2.0 * (1e-3 - found / K[0]) == pytest.approx(1e-4, rel=0.03)


def test_without_backlash_growth_and_friction_a_gear_is_hookes_spring():
    entry = Gears(growth=0.0, hysteresis=0.0, backlash="0 rad")
    bank = springs(entry)
    assert torque(bank, 4e-4) == pytest.approx(4e-4 * K[0])
    assert follow(bank, [2e-4, -2e-4])[1] == pytest.approx(-2e-4 * K[0])


def test_the_loop_closes_and_is_as_high_as_stated():
    bank = springs().relaxed(np.zeros(3))
    found = follow(bank, loop(6e-4))
    there, back = found[200:400], found[400:]
    np.testing.assert_allclose(back[-1], there[0], rtol=1e-12)
    height = (back - there[::-1])[len(back) // 2]
    friction = ENTRY.hysteresis * ENTRY.reference_angle * K[0]
    assert bank.gears.friction[0] == pytest.approx(friction)
    assert height == pytest.approx(2.0 * friction, rel=1e-9)


def test_loading_and_unloading_costs_energy():
    twists = loop(6e-4)
    found = follow(springs().relaxed(np.zeros(3)), twists)
    cycle = slice(200, 600)
    assert np.trapezoid(found[cycle], twists[cycle]) > 0.01


def test_the_memory_is_that_of_the_last_turning_points_not_of_the_steps():
    bank = springs().relaxed(np.zeros(3))
    coarse = follow(bank, [5e-4, -2e-4, 1e-4])[-1]
    ways = [np.linspace(a, b, 40) for a, b in ((0, 5e-4), (5e-4, -2e-4), (-2e-4, 1e-4))]
    assert follow(bank, np.concatenate(ways))[-1] == pytest.approx(coarse, rel=1e-9)


def test_a_relaxed_gear_has_no_friction_where_it_stands():
    bank = springs()
    theta = np.array([3e-4, 0.0, 1e-4])
    np.testing.assert_allclose(
        bank.relaxed(theta).evaluate(theta[None])[1], bank.evaluate(theta[None])[1], rtol=1e-12
    )


def test_a_balancer_without_free_length_is_a_sine():
    spring = BalancerSpring(1e4, 0.0, 0.6, 0.2, 0.3)
    angle = np.linspace(-2, 2, 9)
    _, moment, rate = spring.evaluate(angle)
    np.testing.assert_allclose(moment, 1e4 * 0.12 * np.sin(angle - 0.3), atol=1e-9)
    np.testing.assert_allclose(rate, 1e4 * 0.12 * np.cos(angle - 0.3), atol=1e-9)


def test_the_stiffness_of_a_balancer_depends_on_the_angle():
    _, _, rate = BALANCER.evaluate(BALANCER.upright + np.array([0.1, 0.8, 1.5]))
    assert np.ptp(rate) > 1e3
