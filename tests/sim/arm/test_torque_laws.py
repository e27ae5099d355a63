import numpy as np
import pytest

from elastocal.errors import SpringError
from elastocal.sim.arm import (
    CubicGear,
    Linear,
    TwoSlopeGear,
)

LAWS = [Linear(2e6), CubicGear(1e6, 2e-3), TwoSlopeGear(4e5, 1.5e6, 8e-4)]
ANGLES = np.linspace(-5e-3, 5e-3, 41)
STEP = 1e-7


@pytest.mark.parametrize("law", LAWS, ids=repr)
class TestEveryTorqueLaw:
    def test_torque_is_the_derivative_of_the_energy(self, law):
        slope = (law.energy(ANGLES + STEP) - law.energy(ANGLES - STEP)) / (2 * STEP)
        np.testing.assert_allclose(law.torque(ANGLES), slope, atol=1e-5 * law.torque(ANGLES).max())

    def test_stiffness_is_the_derivative_of_the_torque(self, law):
        slope = (law.torque(ANGLES + STEP) - law.torque(ANGLES - STEP)) / (2 * STEP)
        np.testing.assert_allclose(law.stiffness(ANGLES), slope, rtol=1e-6)

    def test_rest_is_at_zero(self, law):
        assert law.energy(np.zeros(1)) == 0.0
        assert law.torque(np.zeros(1)) == 0.0

    def test_torque_is_odd(self, law):
        np.testing.assert_allclose(law.torque(-ANGLES), -law.torque(ANGLES), rtol=1e-12)

    def test_stiffness_is_positive(self, law):
        assert np.all(law.stiffness(ANGLES) > 0.0)


def test_cubic_gear_has_twice_the_linear_torque_at_its_scale():
    assert CubicGear(3e5, 1e-3).torque(np.array(1e-3)) == pytest.approx(2 * 3e5 * 1e-3)


def test_two_slope_gear_is_soft_at_rest_half_way_at_the_knee_and_stiff_beyond():
    stiffness = TwoSlopeGear(4e5, 1.6e6, 1e-3).stiffness(np.array([0.0, 1e-3, 1.0]))
    np.testing.assert_allclose(stiffness, [4e5, 1e6, 1.6e6], rtol=1e-5)


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_a_stiffness_that_is_not_positive_and_finite_is_refused(value):
    with pytest.raises(SpringError, match=r"Linear k is .*must be positive and finite"):
        Linear(value)


def test_a_two_slope_gear_that_softens_is_refused():
    with pytest.raises(SpringError, match="stiff 1 must exceed soft 2"):
        TwoSlopeGear(2.0, 1.0, 1e-3)
