"""Lost messages, lost answers, jumps and restarts: what the controller takes, by its own log."""

import contextlib
import json
import shutil
import signal
import subprocess
import threading

import numpy as np
import pytest

from elastocal import workflows
from support.exported import SANITIZED, needs_gcc
from support.live_on_wire import LiveFiles, served
from support.waiting import until

SPEED = 0.003
"""Fastest correction, in m/s."""
STEP = 1e3 * SPEED * 0.004
"""Largest step, in mm."""
PATIENCE = 40.0
ROUNDED = 2e-6
"""What six decimals may add to it, in mm."""
WRAP = 2**32


def largest_steps(taken):
    """Return the correction before each answer, and the step to it, in mm; sessions begin at 0."""
    before, steps, session = np.zeros(3), [], -1
    for each in taken:
        here = np.zeros(3) if each.session != session else before
        steps.append((np.linalg.norm(before), np.linalg.norm(np.array(each.correction) - here)))
        before, session = np.array(each.correction), each.session
    return np.array(steps)


def walk(robot):
    """Let everything happen to a line, one after the other; return where in the log each began."""
    marks = {}

    def settle(cycles=110):
        here = robot.statistics.answered
        until(lambda: robot.statistics.answered > here + cycles)

    def happen(name, *faults):
        marks[name] = len(robot.taken)
        robot.inject(*faults)
        settle()

    settle(30)
    happen("nine answers lost while the force rises", *["deaf"] * 9)
    happen("jump of IPOC", "ipoc_jump")
    happen("20 messages lost", *["lost"] * 20)
    happen("restart", "restart")
    happen("restart 100 cycles lower", "restart_nearby")
    happen("restart on the way", "restart")
    robot.inject(*["deaf"] * 4, "ipoc_jump", *["lost"] * 12, "restart")
    settle(40)
    return marks


def check(robot, marks):
    """Hold the controller's own log against the limit."""
    taken = list(robot.taken)
    steps = largest_steps(taken)
    wrapped = next(
        k for k in range(1, len(taken))
        if taken[k].session == taken[k - 1].session and taken[k].ipoc < taken[k - 1].ipoc - WRAP / 2
    )  # fmt: skip
    assert steps[wrapped, 0] > 5 * STEP, "there was something to take back"
    for name, place in marks.items():
        assert steps[place, 0] > 3 * STEP, name
        window = steps[place : place + 100, 1]
        assert window.max() <= STEP + ROUNDED, name
    assert steps[:, 1].max() <= STEP + ROUNDED
    assert max(each.session for each in taken) == 4


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("continuity")
    return LiveFiles.written(folder, 2500.0, correction_speed=f"{SPEED} m/s", timeout=10)


@contextlib.contextmanager
def line(files):
    with served(files, patience=0.05, first_ipoc=WRAP - 4 * 120) as (robot, _box):
        yield robot


@pytest.mark.end_to_end
def test_live_takes_no_larger_step_whatever_happens_to_the_line(files):
    ended, results = threading.Event(), []

    def run():
        results.append(
            workflows.live(
                files.cell, model=files.model, tool=files.tool, arm=True, interrupted=ended.is_set
            )
        )

    with line(files) as robot:
        thread = threading.Thread(target=run)
        thread.start()
        try:
            marks = walk(robot)
        finally:
            ended.set()
            thread.join(PATIENCE)
        check(robot, marks)
    (result,) = results
    assert result.problem is None
    assert result.loop.restarts == 5
    assert 1e3 * result.line.largest_step == pytest.approx(
        largest_steps(robot.taken)[:, 1].max(), abs=STEP
    )
    assert 1e3 * result.line.largest_step <= STEP + ROUNDED


@pytest.fixture(scope="module")
def program(files, tmp_path_factory):
    """The C program under the sanitizers."""
    folder = tmp_path_factory.mktemp("c") / "c"
    workflows.export(files.model, out=folder, platform="linux", cell=files.cell, tool=files.tool)
    words = [f"CFLAGS={' '.join(['-O1', *SANITIZED])}", f"LDFLAGS={' '.join(SANITIZED)}"]
    subprocess.run(["make", "-s", "-C", folder, "check", *words], check=True)
    return folder / "elastocal_live"


@contextlib.contextmanager
def running(program):
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen([program, "--arm"], **pipes) as process:
        try:
            yield process
        finally:
            process.kill()


@pytest.mark.slow
@pytest.mark.end_to_end
@needs_gcc
@pytest.mark.skipif(shutil.which("make") is None, reason="make is not on this machine")
def test_the_c_program_takes_no_larger_step_whatever_happens_to_the_line(files, program):
    with line(files) as robot, running(program) as process:
        marks = walk(robot)
        check(robot, marks)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, err.decode()
    found = json.loads(out)
    assert found["restarts"] == 5
    assert 1e3 * found["largest_step"] <= STEP + ROUNDED


@pytest.mark.slow
@pytest.mark.end_to_end
@needs_gcc
@pytest.mark.skipif(shutil.which("make") is None, reason="make is not on this machine")
def test_a_program_that_is_killed_and_started_again_takes_no_correction_back(files, program):
    with line(files) as robot:
        with running(program):
            until(lambda: robot.statistics.answered > 80)
        here, cycles = len(robot.taken), robot.statistics.cycles
        with running(program) as process:
            until(lambda: robot.statistics.cycles > cycles + 10)
            process.send_signal(signal.SIGINT)
            _, err = process.communicate(timeout=PATIENCE)
        assert "a correction that is not of this program" in err.decode()
        assert len(robot.taken) <= here + 1
        assert largest_steps(robot.taken)[:, 1].max() <= STEP + ROUNDED
