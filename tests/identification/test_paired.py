"""Judgements over held-out sets that share poses."""

import numpy as np
import pytest
from scipy.stats import t

from elastocal.identification import Overlap, corrected_mean, judge_models


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


def test_sets_of_one_pose_each_count_that_their_refits_share_all_other_poses():
    assert Overlap.leaving_one_out(31).variance == pytest.approx(1 / 31 + 1 / 30)
    assert Overlap.of(np.arange(31)[:, None], 31).variance == pytest.approx(1 / 31 + 1 / 30)


def errors(*means: float) -> np.ndarray:
    """Return errors of 31 sets with these means in µm, and 2 µm of scatter in each."""
    scatter = rng().normal(size=(31, len(means)))
    return 1e-6 * (np.array(means) + 2.0 * (scatter - scatter.mean(axis=0)))


ANY = np.ones(3, dtype=bool)


def test_a_model_within_one_standard_error_is_near_the_best_and_not_the_best():
    judged = judge_models(errors(60.0, 50.4, 50.0), ANY, Overlap.leaving_one_out(31))
    assert judged.best == 2
    assert judged.near.tolist() == [1, 2]
    assert judged.difference.low[0] > 0.0 > judged.difference.low[1]


def test_no_model_is_near_one_that_is_far_better_however_rich():
    judged = judge_models(errors(60.0, 55.0, 50.0), ANY, Overlap.leaving_one_out(31))
    assert judged.near.tolist() == [2]


def test_of_equal_models_the_simplest_is_the_best():
    assert judge_models(np.ones((31, 3)), ANY, Overlap.leaving_one_out(31)).best == 0


@pytest.mark.parametrize(("lower", "best"), [(0.9995, 0), (0.998, 1)])
def test_a_richer_model_must_err_by_a_thousandth_less_to_be_the_best(lower, best):
    errors = rng().uniform(1e-5, 2e-5, (20, 1)) * [1.0, lower]
    judged = judge_models(errors, np.ones(2, dtype=bool), Overlap.leaving_one_out(20))
    assert judged.best == best


def test_a_model_that_is_not_allowed_is_judged_and_not_the_best():
    judged = judge_models(errors(60.0, 50.0, 55.0), ~ANY | [True, False, False], Overlap(31, 0.4))
    assert judged.best == 0
    assert judged.difference.high[1] < 0.0


def test_one_set_tells_no_standard_error_and_a_best_model():
    judged = judge_models(errors(60.0, 50.0, 55.0)[:1], ANY, Overlap(1, 1.0))
    assert judged.best == 1
    assert np.isnan(judged.difference.low).all()
