import numpy as np
import pytest

from elastocal.errors import IdentificationError
from elastocal.identification import FitOptions, FitSettings
from elastocal.identification.options import MINIMUM_DRAWS, bounds, parse_bounds


def test_the_default_is_the_papers_bounded_least_squares():
    lower, upper = bounds(FitOptions(), 3)
    np.testing.assert_array_equal(lower, np.zeros(3))
    np.testing.assert_array_equal(upper, np.full(3, np.inf))
    options = FitOptions()
    assert (options.loss, options.weights, options.prior, options.draws) == (
        "linear",
        "none",
        None,
        200,
    )


def test_bounds_may_be_given_for_each_spring():
    lower, upper = bounds(FitOptions(lower=[0.0, -np.inf], upper=[1e-6, 2e-6]), 2)
    np.testing.assert_array_equal(lower, [0.0, -np.inf])
    np.testing.assert_array_equal(upper, [1e-6, 2e-6])


def test_equal_bounds_fix_a_spring():
    lower, upper = bounds(FitOptions(lower=1e-6, upper=1e-6), 2)
    np.testing.assert_array_equal(lower, upper)


@pytest.mark.parametrize(
    ("lower", "upper", "message"),
    [
        (1.0, 0.0, "parameter 1 of 3 would have to lie between 1 and 0"),
        ([0.0, 0.0, 2.0], 1.0, "parameter 3 of 3"),
        (np.nan, 1.0, "parameter 1 of 3"),
        (0.0, [1.0, np.nan, 1.0], "parameter 2 of 3"),
        (np.inf, np.inf, "parameter 1 of 3"),
        (-np.inf, -np.inf, "parameter 1 of 3"),
        ([0.0, 0.0], np.inf, "one number for each of the 3 parameters"),
        (np.zeros((3, 3)), np.inf, "one number for each of the 3 parameters"),
    ],
)
def test_impossible_bounds_are_refused_by_the_spring(lower, upper, message):
    with pytest.raises(IdentificationError, match=message):
        bounds(FitOptions(lower=lower, upper=upper), 3)


@pytest.mark.parametrize(
    ("choice", "message"),
    [
        ({"loss": "hubert"}, "unknown loss 'hubert'; did you mean 'huber'.*linear, huber, cauchy"),
        ({"weights": "sigmas"}, r"unknown weights 'sigmas' \(allowed: none, sigma\)"),
        ({"draws": MINIMUM_DRAWS - 1}, "39 bootstrap draws: at least 40"),
        ({"draws": np.nan}, "at least 40"),
    ],
)
def test_an_unknown_choice_is_refused_with_those_allowed(choice, message):
    with pytest.raises(IdentificationError, match=message):
        FitOptions(**choice)


def test_bounds_may_be_two_numbers_and_are_kept_as_a_text():
    settings = FitSettings(bounds=(0, 1e-5))
    assert (settings.options().lower, settings.options().upper) == (0.0, 1e-5)
    assert FitSettings(bounds=settings.bounds) == settings
    assert FitSettings(bounds=(-np.inf, np.inf)).bounds == "-inf,inf"


@pytest.mark.parametrize("wrong", [(0,), (0, 1, 2), 3.0, ("a", "b"), "0"])
def test_bounds_that_are_not_two_numbers_are_refused(wrong):
    with pytest.raises(IdentificationError, match="must be two numbers"):
        FitSettings(bounds=wrong)


@pytest.mark.parametrize("text", ["nan,1", "0, NaN"])
def test_bounds_that_are_no_number_are_refused_as_that(text):
    with pytest.raises(IdentificationError, match=r"'(nan|NaN)' is not a number"):
        parse_bounds(text)
