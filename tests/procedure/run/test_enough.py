"""A run that has enough poses before its plan ends, and the order that lets it have them early."""

from dataclasses import replace

import pytest

from elastocal.procedure import (
    RunEnd,
    itinerary,
    read_commits,
    read_journal,
    visits_in_rounds,
    why_enough,
)
from elastocal.procedure.run.routes import HOME_AT_START, home_stop, remaining_times
from elastocal.procedure.run.steps import ArmLocation
from support.fake_runs import HOME, FakeRun, plan, settings

PLAN = plan(5)


@pytest.fixture(scope="module")
def stopped(tmp_path_factory):
    """Return a run that had enough after its third pose."""
    run = FakeRun(tmp_path_factory.mktemp("enough") / "run", plan=PLAN, order=(1, 3, 2, 0, 4))
    run.enough = lambda log: "good enough" if log.pose == 2 else ""
    return run, run.start()


def test_it_stops_at_home_after_the_pose_with_which_there_are_enough(stopped):
    run, result = stopped
    assert (result.end, result.enough, result.message) == (RunEnd.DONE, True, "good enough")
    assert [log.pose for log in read_commits(run.journal)] == [1, 3, 2]
    assert result.location is ArmLocation.HOME
    assert run.cell.arm.state().q == pytest.approx(HOME)
    assert why_enough(read_journal(run.journal)) == "good enough"


def test_a_run_that_goes_on_has_not_enough(stopped):
    run, _ = stopped
    again = FakeRun(run.path, plan=PLAN, order=run.order, kept=run.kept)
    assert again.resume().enough is False
    assert [log.pose for log in read_commits(run.journal)] == [1, 3, 2, 0, 4]
    assert why_enough(read_journal(run.journal)) == ""


def test_rounds_take_the_first_of_the_search_first_and_go_to_and_fro():
    searched = replace(PLAN, search=replace(PLAN.search, order=(3, 0, 1, 4, 2)))
    assert visits_in_rounds(searched, 2, 2) == (0, 3, 4, 1, 2)
    assert visits_in_rounds(searched, 8, 4) == (0, 1, 2, 3, 4)


def test_the_arm_goes_home_by_the_shorter_way():
    assert home_stop(PLAN, 1) == HOME_AT_START
    assert home_stop(PLAN, 4) == 5


def test_what_remains_falls_in_the_order_of_the_visits():
    order, of = (1, 3, 2, 0, 4), settings(PLAN)
    left = remaining_times(PLAN, of, order)
    assert left[1] == pytest.approx(sum(step.seconds for step in itinerary(PLAN, of, order)))
    assert left[1] > left[3] > left[2] > left[0] > left[4] > left[-1] > 0.0
