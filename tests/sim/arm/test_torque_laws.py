import numpy as np
import pytest

from elastocal.errors import SpringError
from elastocal.sim.arm import Linear
from elastocal.sim.arm.gears import StiffeningGear

LAWS = [Linear(2e6), StiffeningGear(1e6, 0.3, 5e-4)]
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


def test_a_stiffening_gear_goes_from_k1_to_k3():
    law = StiffeningGear(7e5, 0.3, 5e-4)
    stiffness = law.evaluate(np.array([0.0, 5e-4, 1.0]))[2]
    np.testing.assert_allclose(stiffness, [7e5, 8.5e5, 1e6], rtol=1e-6)


def test_a_gear_that_stiffens_beyond_all_bounds_is_refused():
    with pytest.raises(SpringError, match="growth from 0 to below 1"):
        StiffeningGear(1e6, 1.0, 5e-4)


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_a_stiffness_that_is_not_positive_and_finite_is_refused(value):
    with pytest.raises(SpringError, match=r"Linear k is .*must be positive and finite"):
        Linear(value)
