import numpy as np
import pytest

from elastocal.errors import SpringError
from elastocal.sim.arm import (
    CubicGear,
    Linear,
)

LAWS = [Linear(2e6), CubicGear(1e6, 2e-3)]
ANGLES = np.linspace(-5e-3, 5e-3, 41)
STEP = 1e-7


@pytest.mark.parametrize("law", LAWS, ids=repr)
class TestEveryTorqueLaw:
    def test_torque_is_the_derivative_of_the_energy(self, law):
        slope = (law.evaluate(ANGLES + STEP)[0] - law.evaluate(ANGLES - STEP)[0]) / (2 * STEP)
        torque = law.evaluate(ANGLES)[1]
        np.testing.assert_allclose(torque, slope, atol=1e-5 * torque.max())

    def test_stiffness_is_the_derivative_of_the_torque(self, law):
        slope = (law.evaluate(ANGLES + STEP)[1] - law.evaluate(ANGLES - STEP)[1]) / (2 * STEP)
        np.testing.assert_allclose(law.evaluate(ANGLES)[2], slope, rtol=1e-6)

    def test_rest_is_at_zero(self, law):
        energy, torque, _ = law.evaluate(np.zeros(1))
        assert energy == 0.0
        assert torque == 0.0

    def test_torque_is_odd(self, law):
        np.testing.assert_allclose(law.evaluate(-ANGLES)[1], -law.evaluate(ANGLES)[1], rtol=1e-12)

    def test_stiffness_is_positive(self, law):
        assert np.all(law.evaluate(ANGLES)[2] > 0.0)


def test_cubic_gear_has_twice_the_linear_torque_at_its_scale():
    assert CubicGear(3e5, 1e-3).evaluate(np.array(1e-3))[1] == pytest.approx(2 * 3e5 * 1e-3)


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_a_stiffness_that_is_not_positive_and_finite_is_refused(value):
    with pytest.raises(SpringError, match=r"Linear k is .*must be positive and finite"):
        Linear(value)
