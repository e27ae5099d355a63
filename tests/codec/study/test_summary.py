import numpy as np
import pytest

from elastocal.codec.study import ConditionResult, SampleResult
from elastocal.codec.study.summary import advice, distribution, share, summarise
from support.studies import settings


def results(*errors):
    """Samples whose conditions have these mean errors."""
    return [
        SampleResult(
            number,
            tuple(ConditionResult(e, 2 * e, 1.0, np.ones(1)) for e in column),
        )
        for number, column in enumerate(zip(*errors, strict=True))
    ]


def test_the_interval_of_a_median_covers_it_in_95_of_100_studies():
    rng, hits = np.random.default_rng(0), 0
    for _ in range(2000):
        found = distribution(rng.exponential(size=30))
        hits += found.median_low <= np.log(2.0) <= found.median_high
    assert 0.94 < hits / 2000 < 0.98


def test_one_sample_has_no_spread():
    found = distribution(np.array([3.0]))
    assert found.median == found.median_low == found.median_high == 3.0


def test_a_share_has_wilsons_interval():
    # A. Agresti, B. A. Coull, The American Statistician 52, 1998: 0 of 10 and 10 of 10.
    assert share(0, 10).low == 0.0
    assert share(0, 10).high == pytest.approx(0.2775, abs=5e-4)
    assert share(10, 10).high == 1.0
    assert share(10, 10).low == pytest.approx(0.7225, abs=5e-4)


def test_the_advice_is_the_fewest_poses_that_surely_reach_the_target():
    made = settings(5, 10, 20)
    bad, good = [9e-5] * 60, [3e-5] * 60
    found = summarise(made, results(bad, good, good), 5e-5)
    assert [each.mean_reaches.share for each in found] == [0.0, 1.0, 1.0]
    assert [each.max_reaches.share for each in found] == [0.0, 0.0, 0.0]
    assert advice(found, 5e-5).startswith("10 poses are the fewest")


def test_too_few_samples_prove_nothing():
    found = summarise(settings(5), results([3e-5] * 10), 5e-5)
    assert "No condition is shown" in advice(found, 5e-5)
    assert advice(found, 5e-5).endswith("too few arms to prove it, take more --samples")
    poor = summarise(settings(5), results([9e-5] * 10), 5e-5)
    assert advice(poor, 5e-5).endswith("brings 0% of 10")


def test_without_a_target_there_is_no_share_and_no_advice():
    found = summarise(settings(5), results([3e-5] * 10), None)
    assert found[0].mean_reaches is None
    assert advice(found, None) == ""
