from dataclasses import replace

import numpy as np
import pytest

from elastocal.identification.recertification import ComparedRows, Estimate, Verdict
from elastocal.identification.recertification.comparison import Spread, _judge, compare_rows
from support.problems import campaign
from support.recertified import made_up


@pytest.fixture(scope="module")
def change():
    """A largest change of 0.2 mm, 0.1 to 0.3 mm."""
    old, new = made_up(0), made_up(1)
    loads = campaign()
    rows = ComparedRows(loads.joint_position[:2], loads.force[:2])
    found = compare_rows(old, new, Spread.of(old, new), rows)
    return replace(found, largest=Estimate(2e-4, 1e-4, 3e-4))


@pytest.mark.parametrize(
    ("limit", "verdict"),
    [
        (0.5e-4, Verdict.FAIL),
        (0.999e-4, Verdict.FAIL),
        (1e-4, Verdict.UNDECIDED),
        (2e-4, Verdict.UNDECIDED),
        (2.99e-4, Verdict.UNDECIDED),
        (3e-4, Verdict.PASS),
        (1.0, Verdict.PASS),
    ],
)
def test_the_interval_against_the_limit_is_the_verdict(change, limit, verdict):
    found, reason = _judge(change, limit)
    assert found is verdict
    assert f"limit of {1e3 * limit:g} mm" in reason
    assert "0.200 mm (0.100 to 0.300 mm, 95 %)" in reason


def test_an_open_verdict_says_how_many_poses_would_decide_it(change):
    """Half-width 0.1 mm, to be 0.08 mm: variance 0.64 = 0.2 + 0.8 / times, so 1.8 times."""
    shared = replace(change, old_share=np.full(2, 0.2))
    assert "about 1.9 times as many poses in the new calibration" in _judge(shared, 2.8e-4)[1]
    assert "about 1.9 times as many poses in the new calibration" in _judge(shared, 1.2e-4)[1]


def test_an_open_verdict_says_when_the_old_calibration_forbids_one(change):
    """It cannot be repeated: variance 0.04 is wanted and 0.2 is the old one's alone."""
    reason = _judge(replace(change, old_share=np.full(2, 0.2)), 2.2e-4)[1]
    assert "will hardly decide it" in reason
    assert "limits of 0.300 mm and more would pass, limits below 0.100 mm fail" in reason


def test_a_lower_end_of_zero_fails_at_no_limit(change):
    reason = _judge(replace(change, largest=Estimate(2e-4, 0.0, 3e-4)), 2.5e-4)[1]
    assert reason.endswith("limits of 0.300 mm and more would pass")


def test_without_limit_or_rows_there_is_no_verdict(change):
    assert _judge(change, None) == (None, "no limit was given")
    verdict, reason = _judge(None, 1e-4)
    assert verdict is None
    assert "no rows were given" in reason
