import numpy as np
import pytest
from scipy.stats import chi

from elastocal.errors import IdentificationError
from elastocal.identification.options import LOSSES, MEDIAN_NORM, cauchy, huber, linear


def test_the_median_is_that_of_three_normal_components():
    assert chi(3).median() == pytest.approx(MEDIAN_NORM, rel=1e-14)


def test_linear_weighs_all_readings_alike():
    np.testing.assert_array_equal(linear(np.array([0.0, 1.0, 1e9])), 1.0)


def test_huber_keeps_nine_of_ten_normal_readings_whole():
    corner = float(chi(3).ppf(0.9))
    assert huber(np.array([0.99 * corner]))[0] == 1.0
    assert huber(np.array([1.01 * corner]))[0] < 1.0


def test_hubers_blunder_pulls_as_much_as_one_at_the_corner():
    u = np.array([2.5, 25.0, 2.5e6])
    np.testing.assert_allclose(huber(u) * u, 2.5, rtol=1e-15)


def test_cauchys_blunder_pulls_ever_less():
    u = np.array([2.5, 25.0, 2.5e6])
    assert np.all(np.diff(cauchy(u) * u) < 0.0)
    assert cauchy(u)[0] == 0.5


def test_an_unknown_loss_is_refused_with_the_nearest():
    with pytest.raises(
        IdentificationError, match=r"'couchy'; did you mean 'cauchy'.*linear, huber"
    ):
        LOSSES.named("couchy")
