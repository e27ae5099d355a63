"""Saturation on planted curves."""

import numpy as np
import pytest

from elastocal.codec import Tolerance
from elastocal.codec.saturation import find_saturation, median_draws
from elastocal.errors import CodecError
from elastocal.identification import Overlap

CURVE = np.array([900.0, 400.0, 200.0, 110.0, 104.0, 101.0, 100.0, 100.0]) * 1e-6


def verdict(errors, overlap=None, tolerance=None):
    overlap = overlap or Overlap(len(errors), 0.3)
    return find_saturation("x", errors, tolerance or Tolerance(), overlap, np.random.default_rng(0))


def spread(curve, sigma, sets=31):
    """Return sets whose errors are a curve times a factor of their own at each size."""
    return curve * np.exp(sigma * np.random.default_rng(1).normal(size=(sets, len(curve))))


def test_the_first_error_within_five_per_cent_of_the_last_is_saturation():
    found = verdict(np.tile(CURVE, (31, 1)))
    assert (found.n_train, found.low, found.high, found.last) == (5, 5, 5, 8)
    assert found.error == pytest.approx(104e-6)
    assert found.last_error == pytest.approx(100e-6)
    assert found.settled


@pytest.mark.parametrize(
    ("relative", "floor", "n"),
    [(0.15, 0.0, 4), (0.0, 0.0, 7), (0.0, 12e-6, 4), (0.99, 0.0, 4), (0.0, 1e-3, 1)],
)
def test_the_larger_of_part_and_floor_decides(relative, floor, n):
    assert verdict(np.tile(CURVE, (9, 1)), tolerance=Tolerance(relative, floor)).n_train == n


def test_an_error_that_rises_again_is_told_and_never_settled():
    found = verdict(np.tile([300e-6, 50e-6, 90e-6, 100e-6, 100e-6, 100e-6], (4, 1)))
    assert (found.n_train, found.least, found.rises, found.settled) == (2, 2, True, False)
    assert found.least_error == pytest.approx(50e-6)


def test_an_error_that_leaves_the_tolerance_again_stays_from_later_on():
    found = verdict(np.tile([300e-6, 101e-6, 150e-6, 102e-6, 100e-6, 100e-6], (4, 1)))
    assert (found.n_train, found.stays, found.rises) == (2, 4, False)


def test_a_curve_that_still_falls_is_not_settled():
    found = verdict(np.tile(np.linspace(1e-3, 1e-4, 10), (31, 1)))
    assert found.n_train == 10
    assert not found.settled


def test_the_interval_holds_the_estimate_and_grows_with_scatter_and_with_fewer_sets():
    quiet, loud = verdict(spread(CURVE, 0.005)), verdict(spread(CURVE, 0.1))
    few = verdict(spread(CURVE, 0.005, sets=4))
    for found in (quiet, loud, few):
        assert found.low <= found.n_train <= found.high
    assert loud.high - loud.low > quiet.high - quiet.low
    assert few.high - few.low >= quiet.high - quiet.low


def test_one_set_has_no_interval():
    found = verdict(CURVE[None], Overlap(1, 1.0))
    assert (found.low, found.high, found.settled) == (None, None, False)


@pytest.mark.parametrize(
    ("relative", "floor"), [(-0.1, 0.0), (np.nan, 0.0), (1.0, 0.0), (5.0, 0.0), (0.1, np.inf)]
)
def test_a_tolerance_that_is_none_is_refused(relative, floor):
    with pytest.raises(CodecError, match="tolerance"):
        Tolerance(relative, floor)


def test_springs_that_leave_more_than_half_of_the_zero_model_are_not_saturated():
    overlap, errors = Overlap(31, 0.3), np.tile(CURVE, (31, 1))
    rng = np.random.default_rng(0)
    found = find_saturation("x", errors, Tolerance(), overlap, rng, np.full(31, 160e-6))
    assert found.unexplained == pytest.approx(100 / 160)
    assert not found.explains
    assert not found.settled
    said = found.sentence(Tolerance(), errors, "here")
    assert "not saturated" in said
    assert "62 % of what no model at all leaves" in said
    good = find_saturation("x", errors, Tolerance(), overlap, rng, np.full(31, 1000e-6))
    assert good.explains
    assert good.settled


def test_draws_of_the_median_have_the_corrected_spread_and_stay_positive():
    values = np.exp(0.3 * np.random.default_rng(0).normal(size=(400, 1)))
    loose, tied = (
        np.log(median_draws(values, Overlap(400, rho), np.random.default_rng(1)))
        for rho in (0.0, 0.4)
    )
    median_sigma = 0.3 * np.sqrt(np.pi / 2 / 400)
    assert loose.std() == pytest.approx(median_sigma, rel=0.3)
    widened = np.sqrt((1 / 400 + 0.4 / 0.6) / (1 / 400))
    assert tied.std() / loose.std() == pytest.approx(widened, rel=1e-6)


def test_sets_without_spread_have_no_draws():
    values = np.ones((5, 2))
    assert median_draws(values, Overlap(5, 1.0), np.random.default_rng(0)).shape == (0, 2)
