"""A second disk is put on by a person, in the middle of a run, the arm at HOME and disarmed."""

from dataclasses import replace

import pytest

from elastocal.cell import Motion
from elastocal.planning.plan_result import MoveRecord
from elastocal.procedure import Event, RunEnd, read_commits, read_journal
from elastocal.procedure.run.steps import ArmLocation
from support.fake_runs import HOME, FakeRun, plan


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
