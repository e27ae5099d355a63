from dataclasses import replace

import numpy as np
import pytest

from elastocal.identification.recertification.comparison import Spread, compare_springs, critical
from support.recertified import made_up


def changes(old, new):
    return compare_springs(old, new, Spread.of(old, new))


def test_a_planted_change_of_five_standard_errors_is_the_only_one_that_moved():
    truth = np.full(6, 1e-6)
    moved = truth + 7e-8 * (np.arange(6) == 2)
    found = changes(made_up(0, compliance=truth), made_up(1, compliance=moved))
    assert [each.name for each in found if each.moved] == ["joint_3.axial"]
    assert 7e-8 in found[2].difference


def test_the_interval_for_all_springs_at_once_is_wider_than_that_of_one():
    for each in changes(made_up(0), made_up(1)):
        alone = each.difference.high - each.difference.low
        together = each.together.high - each.together.low
        assert 1.05 * alone < together < 2.0 * alone
        assert each.old.low < each.old.value < each.old.high
        assert each.difference.value == pytest.approx(each.new.value - each.old.value)


def test_the_critical_value_of_independent_normal_noise_is_sidaks():
    noise = np.random.default_rng(0).standard_normal((40_000, 14))
    # Sidak: (1 - p)^14 = 0.95, so that |z| = 2.906.
    assert critical(noise) == pytest.approx(2.906, abs=0.03)


def test_a_spring_that_both_calibrations_hold_at_its_bound_has_not_moved():
    old, new = made_up(0), made_up(1)
    held = [_at_zero(each) for each in (old, new)]
    found = changes(*held)
    assert (found[1].difference.low, found[1].difference.high) == (0.0, 0.0)
    assert not found[1].moved
    assert np.isnan(found[1].relative)


def test_a_percentage_needs_a_base_that_is_surely_not_zero():
    """A compliance of nearly nothing was said to have moved by -64357 %."""
    (known, *_) = changes(made_up(0), made_up(1))
    assert known.relative == pytest.approx(known.difference.value / known.old.value)
    doubtful = replace(known, old=replace(known.old, low=0.0))
    assert np.isnan(doubtful.relative)
    assert doubtful.label == known.name


def _at_zero(calibrated):
    compliance, draws = calibrated.compliance.copy(), calibrated.draws.copy()
    compliance[1], draws[:, 1] = 0.0, 0.0
    return replace(calibrated, compliance=compliance, draws=draws)


def test_without_control_every_fourth_unchanged_pair_would_name_a_spring():
    """Six springs at 5 % each: 1 - 0.95^6 = 26 %."""
    pairs = [changes(made_up(2 * n), made_up(2 * n + 1)) for n in range(120)]
    alone = np.mean([any(0.0 not in each.difference for each in found) for found in pairs])
    together = np.mean([any(each.moved for each in found) for found in pairs])
    assert 0.15 < alone < 0.4
    assert together <= 0.09
