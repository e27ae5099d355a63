"""A person stacks disks between two poses: the arm is at HOME and disarmed, or nobody is asked."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from elastocal.cell import Motion
from elastocal.errors import DeviceError
from elastocal.planning.plan_result import MoveRecord
from elastocal.procedure import Event, RunEnd, read_commits, read_journal
from elastocal.procedure.record import Action
from elastocal.procedure.run.routes import HOME_AT_START, route, stop_joints
from elastocal.procedure.run.steps import ArmLocation, Step
from support.fake_devices import FakeCell
from support.fake_runs import HOME, FakeRun, plan

SINGLE = plan(3)
POSES = (*SINGLE.poses[:2], replace(SINGLE.poses[2], doubles=0))
PLAIN = replace(SINGLE, poses=POSES)
"""No leg leads over HOME before the press on two disks."""
OVER = replace(SINGLE.moves[2], via=((0.2, 0.1, 0.3), HOME, (0.3, 0.1, 0.3)))
BY_HOME = replace(PLAIN, moves=(*SINGLE.moves[:2], OVER, SINGLE.moves[3]))


def targets(run):
    """Return the joint positions that the arm was sent to, in order."""
    return [
        entry.target
        for entry in read_journal(run.journal)
        if entry.event is Event.BEGIN and entry.action is Action.MOVE
    ]


def checked(of):
    """Return the legs of a plan, forwards and backwards."""
    legs = set()
    for stop in range(len(of.poses) + 1):
        way = [stop_joints(of, stop - 1), *of.moves[stop].via, stop_joints(of, stop)]
        legs |= set(pairwise(way)) | set(pairwise(way[::-1]))
    return legs


@pytest.mark.parametrize("of", [PLAIN, BY_HOME], ids=["plain", "by HOME"])
def test_the_arm_goes_home_and_on_by_legs_of_the_plan_alone(tmp_path, of):
    run = FakeRun(tmp_path / "run", plan=of)
    seen = []

    def stack(disks):
        world = run.cell.world
        seen.append((disks, tuple(world.q.tolist()), world.motion))
        return lambda: True

    run.stack = stack
    assert run.start().end is RunEnd.DONE
    assert seen == [(2, pytest.approx(HOME), Motion.DISARMED)]
    assert [log.pose for log in read_commits(run.journal)] == [0, 1, 2]
    passed = [HOME, *targets(run)]
    assert set(pairwise(passed)) <= checked(of)
    assert route(of, HOME_AT_START, 2)[-1] in passed


class Deaf:
    """An arm that does not take a command."""

    def __init__(self, arm, at):
        self._arm, self._at = arm, at

    def __getattr__(self, name):
        return getattr(self._arm, name)

    def disable(self):
        if np.allclose(self._arm.world.q, self._at):
            raise DeviceError("arm: disable is refused")
        self._arm.disable()


def test_nobody_is_asked_into_the_cell_of_an_arm_that_is_not_disarmed(tmp_path):
    run, asked = FakeRun(tmp_path / "run", plan=BY_HOME), []
    run.stack = lambda disks: asked.append(disks) or (lambda: True)

    def prepare(cell: FakeCell) -> None:
        cell.arm = Deaf(cell.arm, HOME)

    result = run.start(prepare)
    assert asked == []
    assert result.end is RunEnd.STOPPED
    assert "it does not say that it is disarmed" in result.message


def test_asked_to_stop_the_arm_is_not_enabled_again_whatever_the_answer(tmp_path):
    run, stopped = FakeRun(tmp_path / "run", plan=BY_HOME), []

    def stack(_):
        stopped.append(len(run.cell.world.commands))
        return lambda: True

    run.stack, run.interrupted = stack, lambda: bool(stopped)
    result = run.start()
    assert (result.end, result.location) == (RunEnd.INTERRUPTED, ArmLocation.HOME)
    assert not {"enable", "move"} & set(run.cell.world.commands[stopped[0] :])


def doubled_plan():
    """Return two places, of which the second is the first once more, on two disks."""
    found = plan(2)
    single, again = found.poses
    home = MoveRecord(start=0, end=1, via=(HOME,), duration=1.0)
    return replace(
        found,
        poses=(single, replace(again, doubles=0)),
        moves=(found.moves[0], home, found.moves[2]),
    )


class Person:
    """Notes how the arm stands when asked, and answers at the fifth look; or wants to stop."""

    def __init__(self, run, answers=True):
        self._run, self._answers, self.wants_to_stop = run, answers, False
        self.asked, self.looks = [], 0

    def ask(self, disks):
        arm = self._run.cell.arm.state()
        self.asked.append((disks, arm.motion, tuple(arm.q)))
        self.looks = 0
        return self._looked

    def _looked(self):
        self.looks += 1
        self.wants_to_stop = not self._answers and self.looks == 3
        return self._answers and self.looks == 5


def begun(path, answers=True):
    run = FakeRun(path, plan=doubled_plan())
    person = Person(run, answers)
    run.stack, run.interrupted = person.ask, lambda: person.wants_to_stop
    return run, person


def heard(run):
    return [e.event for e in read_journal(run.journal) if e.event in (Event.ASKED, Event.HANDLED)]


def test_the_arm_waits_at_home_disarmed_until_somebody_says_that_it_is_done(tmp_path):
    run, person = begun(tmp_path / "run")
    result = run.start()
    assert result.end is RunEnd.DONE
    ((disks, motion, q),) = person.asked
    assert (disks, motion, person.looks) == (2, Motion.DISARMED, 5)
    assert q == pytest.approx(HOME)
    asked, handled = (
        e for e in read_journal(run.journal) if e.event in (Event.ASKED, Event.HANDLED)
    )
    assert handled.text == "2 disks"
    cycles = run.settings.procedure.cycle
    assert handled.time - asked.time == pytest.approx(4 * cycles, abs=1e-6)
    assert [log.pose for log in read_commits(run.journal)] == [0, 1]


@pytest.mark.slow
def test_a_person_who_takes_long_is_nothing_that_a_watchdog_minds(tmp_path):
    run, person = begun(tmp_path / "run")
    late = person._looked
    run.stack = lambda disks: (person.ask(disks), run.cell.devices.clock.sleep(3600.0), late)[-1]
    assert run.start().end is RunEnd.DONE


def test_a_run_is_stopped_while_it_waits_and_asks_once_more_when_it_goes_on(tmp_path):
    run, _ = begun(tmp_path / "run", answers=False)
    result = run.start()
    assert (result.end, result.location) == (RunEnd.INTERRUPTED, ArmLocation.HOME)
    assert heard(run) == [Event.ASKED]
    again, person = begun(run.path)
    again.kept = run.kept
    assert again.resume().end is RunEnd.DONE
    assert [disks for disks, *_ in person.asked] == [2]
    assert [log.pose for log in read_commits(run.journal)] == [0, 1]


def test_a_run_that_goes_on_before_the_second_disk_asks_for_one_alone(tmp_path):
    """Nobody knows what an earlier session has left on the tool."""
    run, _ = begun(tmp_path / "run")
    run.interrupted = lambda: True
    assert run.start().end is RunEnd.INTERRUPTED
    again, person = begun(run.path)
    assert again.resume().end is RunEnd.DONE
    assert [disks for disks, *_ in person.asked] == [1, 2]


def test_on_the_way_home_the_weight_of_the_tool_is_not_shown_as_a_force(tmp_path):
    run, _ = begun(tmp_path / "run")
    told = []
    run.tell = told.append
    run.start()
    assert max(each.force for each in told if each.step in (Step.MOVE, Step.DONE)) == 0.0
    assert any(each.step is Step.DONE for each in told)
