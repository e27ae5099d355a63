"""Paired differences on planted arrays."""

import numpy as np
import pytest

from elastocal.codec.pairs import compare_variants
from elastocal.identification import Overlap

OVERLAP = Overlap(31, 0.4)
COMMON = 1e-3 * np.exp(np.random.default_rng(0).normal(size=(31, 6)))
"""Hard and easy sets: what pairing takes out."""
NOISE = 1e-6 * np.random.default_rng(1).normal(size=(31, 6))


def pair(gain, at=6, overlap=OVERLAP):
    return compare_variants("a", "b", COMMON + np.asarray(gain) + NOISE, COMMON, overlap, at)


def test_a_difference_far_below_the_scatter_of_the_sets_is_found_and_bracketed():
    found = pair(np.full(6, 20e-6))
    np.testing.assert_allclose(found.difference, 20e-6, atol=1e-6)
    assert np.all((found.low < 20e-6) & (found.high > 20e-6))
    assert np.all(found.low > 0.0)
    assert (found.better, found.proved_from, found.crossing) == ("b", 1, None)


def test_the_other_sign_names_the_other():
    assert pair(np.full(6, -20e-6)).better == "a"


def test_curves_that_cross_say_where():
    found = pair(np.array([-50.0, -30.0, 0.5, 10.0, 20.0, 20.0]) * 1e-6)
    assert found.better == "b"
    assert found.crossing == 3
    assert found.proved_from == 4


def test_a_pair_is_judged_where_it_is_told():
    gain = np.array([-50.0, -30.0, -20.0, 10.0, 20.0, 20.0]) * 1e-6
    assert pair(gain, at=2).better == "a"
    assert pair(gain, at=2).crossing is None


def test_noise_alone_proves_nothing():
    found = pair(np.zeros(6))
    assert found.better is None
    assert found.proved_from is None


def test_round_off_is_no_difference():
    found = compare_variants("a", "b", COMMON * (1.0 + 1e-14), COMMON, OVERLAP, 6)
    np.testing.assert_array_equal(found.difference, 0.0)
    assert (found.better, found.crossing) == (None, None)


def test_one_set_tells_no_interval():
    found = compare_variants("a", "b", 2 * COMMON[:1], COMMON[:1], Overlap(1, 1.0), 6)
    assert np.isnan(found.low).all()
    assert found.better is None
    assert found.difference == pytest.approx(COMMON[0])
