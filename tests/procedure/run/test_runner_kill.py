"""Killed at any moment, a run goes on to what an undisturbed run gives."""

import os
from functools import cache
from itertools import count

import numpy as np
import pytest

from elastocal.cell import Motion
from elastocal.procedure import Event, RunEnd, RunFolder, read_journal
from elastocal.procedure.record import read_commits
from support.fake_devices import FakeCell
from support.fake_runs import FakeRun, MemoryRecorder


class KillRunError(BaseException):
    """Stands for kill -9: after it no device and no file takes anything any more."""


class Killer:
    """Counts entries that reach the disk and kills at one of them."""

    def __init__(self, at: int, torn: bool = False) -> None:
        self.at, self.torn, self.seen, self.dead = at, torn, 0, False

    def __call__(self, file: int) -> None:
        if not self.dead and self.seen == self.at:
            self.dead = True
            if self.torn:
                os.ftruncate(file, os.fstat(file).st_size - 7)
        self.live()
        self.seen += 1

    def live(self) -> None:
        if self.dead:
            raise KillRunError

    def guard(self, cell: FakeCell) -> None:
        """Let the clock, through which all go, die with the run."""
        now, sleep = cell.world.clock.now, cell.world.clock.sleep

        def dying_now() -> float:
            self.live()
            return now()

        def dying_sleep(seconds: float) -> None:
            self.live()
            sleep(seconds)

        cell.world.clock.now = dying_now
        cell.world.clock.sleep = dying_sleep


@cache
def undisturbed(folder):
    run = FakeRun(folder / "undisturbed")
    assert run.start().end is RunEnd.DONE
    return run.readings(), len(read_journal(run.journal))


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return undisturbed(tmp_path_factory.mktemp("runs"))


ENTRIES = 44
"""Of a run with two poses and two load cases; `test_the_boundaries_are_all_there` holds it."""


def test_the_boundaries_are_all_there(whole):
    assert whole[1] == ENTRIES


def kill(path, killer):
    run = FakeRun(path)
    with pytest.raises(KillRunError):
        run.start(killer.guard, sync=killer)
    return run


def committed(run):
    return [log.pose for log in read_commits(run.journal)]


def _some_now(cases):
    """Return every other place to be killed at; the others are tried every night."""
    return [pytest.param(*each, marks=[pytest.mark.slow] * (k % 2)) for k, each in enumerate(cases)]


@pytest.mark.parametrize(
    ("boundary", "torn"),
    _some_now([(n, False) for n in range(1, ENTRIES)] + [(n, True) for n in range(1, ENTRIES, 4)]),
)
def test_a_killed_run_goes_on_to_the_same_readings(tmp_path, whole, boundary, torn):
    run = kill(tmp_path / "run", Killer(boundary, torn))
    before = committed(run)
    assert run.resume().end is RunEnd.DONE
    assert committed(run)[: len(before)] == before
    assert sorted(committed(run)) == [0, 1]
    readings = run.readings()
    assert readings.keys() == whole[0].keys()
    for key, values in whole[0].items():
        np.testing.assert_allclose(readings[key], values, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("boundary", "goes_on"),
    _some_now([(n, False) for n in range(3, ENTRIES - 3)] + [(n, True) for n in range(3, 20)]),
)
def test_an_arm_that_stands_where_it_was_finds_the_way_back(tmp_path, boundary, goes_on):
    """As on a real machine: the program dies, the arm keeps its place and its contact."""
    killer = Killer(boundary)
    run = kill(tmp_path / "run", killer)
    cell, before = run.cell, committed(run)
    killer.dead = False
    world = cell.world
    if not goes_on:
        # A controller that drops the force control and the release when its client is gone.
        world.motion = Motion.DISARMED
    world.commands.clear()
    assert run.resume(cell=cell).end is RunEnd.DONE
    assert sorted(committed(run)) == [0, 1]
    assert committed(run)[: len(before)] == before
    touched = world.in_contact or world.q[2] <= 0.0
    assert not touched
    first = [command for command in world.commands if command != "enable"][:1]
    assert first != ["approach"]


def test_killed_twice_it_still_goes_on(tmp_path, whole):
    run = kill(tmp_path / "run", Killer(12))
    killer = Killer(9)
    with pytest.raises(KillRunError):
        run.resume(killer.guard, sync=killer)
    assert run.resume().end is RunEnd.DONE
    for key, values in whole[0].items():
        np.testing.assert_allclose(run.readings()[key], values, rtol=0, atol=1e-9)


def test_a_pose_that_is_done_again_gets_another_number_of_attempt(tmp_path):
    run = kill(tmp_path / "run", Killer(12))
    run.resume()
    assert [(log.pose, log.attempt) for log in read_commits(run.journal)] == [(0, 2), (1, 1)]


def test_a_run_that_is_complete_only_says_so_again(tmp_path):
    run = FakeRun(tmp_path / "run")
    run.start()
    assert run.resume().end is RunEnd.DONE
    assert run.cell.world.commands == ["enable", "disable"]
    assert read_journal(run.journal)[-1].event is Event.FINISH


RECORDINGS = count()


class FileRecorder(MemoryRecorder):
    """Writes a file beside, as the recorder of a real run does."""

    def save(self, path):
        super().save(path)
        path.parent.mkdir(exist_ok=True)
        path.write_text(f"recording {next(RECORDINGS)}")


@pytest.mark.parametrize("entries", [1, 2, 12, 30])
def test_a_run_goes_on_behind_a_journal_that_was_cut_and_overwrites_no_recording(tmp_path, entries):
    """A journal put back from a copy of before knows nothing of what was recorded since."""
    run = FakeRun(tmp_path / "run")
    run.recorder = lambda: FileRecorder(run.kept)
    run.start()
    streams = RunFolder(run.path).streams
    before = {path.name: path.read_text() for path in streams.iterdir()}
    assert sorted(before) == ["pose_0000_1.mcap", "pose_0001_1.mcap"]
    lines = run.journal.read_bytes().splitlines(keepends=True)
    run.journal.write_bytes(b"".join(lines[:entries]))
    assert run.resume().end is RunEnd.DONE
    assert {name: (streams / name).read_text() for name in before} == before
    logs = {log.pose: log.streams for log in read_commits(run.journal)}
    assert sorted(logs) == [0, 1]
    assert logs[1] == "pose_0001_2.mcap"
    assert len(list(streams.iterdir())) == (3 if entries == 30 else 4)
