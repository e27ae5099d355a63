"""Intervals over verification sets that share poses."""

import numpy as np
import pytest
from scipy.stats import t

from elastocal.codec import median_draws
from elastocal.identification import Overlap, corrected_mean


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


def test_overlap_counts_what_two_sets_share():
    assert Overlap.of(np.array([[0, 1], [1, 2], [3, 4]]), 8) == Overlap(3, 1 / 6, 1 / 4)
    assert Overlap.of(np.array([[0, 1], [1, 0]]), 8).rho == 1.0


def test_sets_that_share_nothing_are_no_more_independent_than_random_ones():
    disjoint = Overlap.of(np.array([[0, 1], [2, 3], [4, 5]]), 10)
    assert (disjoint.shared, disjoint.rho) == (0.0, 0.2)
    assert disjoint.variance == pytest.approx(1 / 3 + 2 / 8)


def test_random_sets_share_what_nadeau_and_bengio_expect():
    random = rng()
    sets = np.array([random.permutation(31)[:9] for _ in range(300)])
    assert Overlap.of(sets, 31).shared == pytest.approx(9 / 31, rel=0.03)


def test_sets_without_overlap_give_students_interval():
    values = rng().normal(size=(20, 3))
    found = corrected_mean(values, Overlap(20, 0.0))
    half = t.ppf(0.975, 19) * values.std(axis=0, ddof=1) / np.sqrt(20)
    np.testing.assert_allclose(found.high - found.mean, half)
    np.testing.assert_allclose(found.mean - found.low, half)


@pytest.mark.parametrize("overlap", [Overlap(1, 1.0), Overlap(5, 1.0)])
def test_without_spread_the_interval_is_unknown_and_never_zero(overlap):
    values = np.ones((overlap.sets, 2))
    found = corrected_mean(values, overlap)
    assert np.isnan(found.low).all()
    assert np.isnan(found.high).all()
    assert median_draws(values, overlap, rng()).shape == (0, 2)


def test_draws_of_the_median_have_the_corrected_spread_and_stay_positive():
    values = np.exp(0.3 * rng().normal(size=(400, 1)))
    loose, tied = (
        np.log(median_draws(values, Overlap(400, rho), np.random.default_rng(1)))
        for rho in (0.0, 0.4)
    )
    median_sigma = 0.3 * np.sqrt(np.pi / 2 / 400)
    assert loose.std() == pytest.approx(median_sigma, rel=0.3)
    widened = np.sqrt((1 / 400 + 0.4 / 0.6) / (1 / 400))
    assert tied.std() / loose.std() == pytest.approx(widened, rel=1e-6)


@pytest.mark.slow
def test_the_interval_covers_the_mean_of_sets_correlated_by_their_overlap():
    """A figure of a set is the mean of its poses' own figures: the simplest overlap there is."""
    random = np.random.default_rng(3)
    covered = []
    for _ in range(2000):
        poses = random.normal(size=31)
        sets = np.array([random.permutation(31)[:9] for _ in range(31)])
        found = corrected_mean(poses[sets].mean(axis=1)[:, None], Overlap.of(sets, 31))
        covered.append(found.low[0] <= 0.0 <= found.high[0])
    assert 0.92 <= np.mean(covered) <= 1.0
