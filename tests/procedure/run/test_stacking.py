"""A person stacks disks between two poses: the arm is at HOME and disarmed, or nobody is asked."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from elastocal.cell import Motion
from elastocal.errors import DeviceError
from elastocal.procedure import Event, RunEnd, read_commits, read_journal
from elastocal.procedure.record import Action
from elastocal.procedure.run.routes import HOME_AT_START, route, stop_joints
from elastocal.procedure.run.steps import ArmLocation
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
        return ""

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
    run.stack = lambda disks: asked.append(disks) or ""

    def prepare(cell: FakeCell) -> None:
        cell.arm = Deaf(cell.arm, HOME)

    result = run.start(prepare)
    assert asked == []
    assert result.end is RunEnd.STOPPED
    assert "it does not say that it is disarmed" in result.message


@pytest.mark.parametrize("interrupts", [False, True])
def test_without_a_yes_the_arm_is_not_enabled_again(tmp_path, interrupts):
    run, stopped = FakeRun(tmp_path / "run", plan=BY_HOME), []

    def stack(disks):
        stopped.append(len(run.cell.world.commands))
        return "" if interrupts else "not confirmed"

    run.stack, run.interrupted = stack, lambda: interrupts and bool(stopped)
    result = run.start()
    assert (result.end, result.location) == (RunEnd.INTERRUPTED, ArmLocation.HOME)
    assert not {"enable", "move"} & set(run.cell.world.commands[stopped[0] :])
