"""Campaigns that stop by themselves: what is quoted of them, and that it can be measured anew."""

import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from elastocal.identification import RISK

HOOKS = Path(__file__).parents[2] / "docs" / "hooks"


@pytest.fixture
def stopping(monkeypatch) -> Iterator[ModuleType]:
    """Return the module that measures and quotes them."""
    monkeypatch.syspath_prepend(str(HOOKS))
    from gallery import stopping

    yield stopping
    for name in [each for each in sys.modules if each.startswith("gallery")]:
        del sys.modules[name]


def test_the_wanted_accuracy_is_missed_no_more_often_than_the_stated_risk(stopping):
    ended = [each for each in stopping.quoted() if each.stopped]
    missed = [each for each in ended if stopping.is_missed(each)]
    # Of rare events three standard deviations more may happen by chance.
    expected = RISK * len(ended)
    assert len(missed) <= expected + 3.0 * expected**0.5


def test_most_campaigns_of_each_quoted_truth_stop_and_their_intervals_hold(stopping):
    done = stopping.quoted()
    assert {each.kind for each in done} >= {"machining"}
    for kind, preset in {(each.kind, each.preset) for each in done}:
        own = [each for each in done if (each.kind, each.preset) == (kind, preset)]
        assert sum(each.stopped for each in own) > len(own) / 2, (kind, preset)
    # The interval holds whether a campaign stopped or not.
    assert sum(each.true > each.high for each in done) <= RISK * len(done) + 2


def test_the_table_counts_every_campaign(stopping):
    rows = [line.strip("| ").split(" | ") for line in stopping.table(stopping.quoted()).split("\n")]
    counted = sum(int(row[3].split(" of ")[1]) for row in rows[2:])
    assert counted == len(stopping.quoted())


@pytest.mark.slow
@pytest.mark.parametrize("preset", ["kind", "typical", "harsh"])
def test_a_campaign_measured_anew_is_the_one_that_is_quoted(stopping, tmp_path, preset):
    (quoted,) = (
        each
        for each in stopping.quoted()
        if (each.kind, each.preset, each.seed) == ("machining", preset, 0)
    )
    example = stopping.Example(tmp_path, "machining", preset)
    found = example.campaign(0, stopping.WANTED["machining", preset])
    assert (found.stopped, found.poses) == (quoted.stopped, quoted.poses)
    assert found.high == pytest.approx(quoted.high, rel=0.05)
    assert found.true == pytest.approx(quoted.true, rel=0.05)
