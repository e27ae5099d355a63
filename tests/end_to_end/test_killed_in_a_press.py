"""A run over sockets that is killed while it presses: whatever comes next never pushes."""

import contextlib
import subprocess
import sys
import time
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

import elastocal as ec
from elastocal.errors import ProcedureError
from elastocal.procedure import RunEnd
from elastocal.workflows import Supervision, release
from elastocal.workflows._operator_and_devices import Unattended
from support.cli import ENTRY, PATIENCE
from support.fault_matrix import Lines, _Watch, begun, wired
from support.run_cells import planned_cell

pytestmark = [pytest.mark.slow, pytest.mark.end_to_end]
NOISE = 10.0
"""Force that a standing arm may seem to gain, in N."""


class UntilAnotherPress(Unattended):
    """Interrupts a run when it begins to go to the surface again."""

    def __init__(self, out):
        self.out, self.before = out, begun(out).count("approach")
        self.told = []

    def warn(self, lines):
        self.told += lines

    @contextmanager
    def supervise(self, poses):  # noqa: ARG002 - the protocol
        yield Supervision(lambda _: None, lambda: begun(self.out).count("approach") > self.before)


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    return planned_cell(tmp_path_factory.mktemp("planned"), 3)


@contextmanager
def killed(planned, folder):
    """Yield the lines, the cell and the run's folder, its process killed while it held a load."""
    found, opened = wired(planned, f"{folder.name}.yaml", by_the_wall=True)
    out, text = folder / "run", found.cell.read_text(encoding="utf-8")
    # A machine at work lets a cycle wait; what is tested here is force and place, not time.
    found.cell.write_text(f'{text}\nprocedure: {{stale: "1 s"}}\n', encoding="utf-8")
    with opened() as lines:
        words = ["run", str(found.cell), "--plan", str(found.plan), "--out", str(out), "--yes"]
        process = subprocess.Popen(
            [sys.executable, "-c", ENTRY, *words], stderr=subprocess.PIPE, stdout=subprocess.PIPE
        )
        end = time.monotonic() + PATIENCE
        while "hold" not in begun(out):
            assert process.poll() is None, process.communicate()[1].decode()
            assert time.monotonic() < end
            time.sleep(0.05)
        time.sleep(2.0)
        # Where it goes on by itself it does so for a hundred hours without an answer.
        lines.robot._context = replace(lines.robot._context, timeout=10**8)
        process.kill()
        process.communicate()
        yield lines, found, out


def restart(lines: Lines) -> None:
    """Start the program anew where the arm stands, as an operator does after a stop."""
    lines.robot.inject("restart")
    time.sleep(1.0)


def force(lines: Lines) -> float:
    return float(np.linalg.norm(lines.live.press().force))


@contextlib.contextmanager
def never_pushed(lines: Lines):
    before = force(lines)
    assert before > 300.0
    watch = _Watch(lines.live)
    with watch.watching():
        yield
    after = [float(np.linalg.norm(each.force)) for each in watch.seen]
    assert max(after) <= before + NOISE


@pytest.mark.parametrize("restarted", [False, True], ids=["still running", "restarted"])
def test_a_resume_after_a_kill_leaves_the_surface_and_never_pushes(planned, tmp_path, restarted):
    with killed(planned, tmp_path) as (lines, found, out):
        if restarted:
            restart(lines)
        operator = UntilAnotherPress(out)
        with never_pushed(lines):
            result = ec.run(
                found.cell,
                plan=found.plan,
                out=out,
                resume=True,
                confirmed=True,
                operator=operator,
            )
        assert result.end is RunEnd.INTERRUPTED
        assert not any("not in contact" in line for line in operator.told)
        assert force(lines) == 0.0


def test_a_run_into_a_new_folder_is_refused_while_the_tool_presses(planned, tmp_path):
    with killed(planned, tmp_path) as (lines, found, _):
        restart(lines)
        before = force(lines)
        with (
            never_pushed(lines),
            pytest.raises(ProcedureError, match=r"N press on the tool.*release CELL --arm"),
        ):
            ec.run(found.cell, plan=found.plan, out=tmp_path / "another", confirmed=True)
        assert force(lines) == pytest.approx(before, abs=NOISE)


@pytest.mark.parametrize("box", [True, False], ids=["with F/T", "without F/T"])
def test_release_frees_the_tool(planned, tmp_path, box):
    with killed(planned, tmp_path) as (lines, found, _):
        restart(lines)
        if not box:
            lines.calibration.go()
        with never_pushed(lines):
            said = release(found.cell)
            assert not said.figures.moved
            assert force(lines) > 300.0
            figures = release(found.cell, arm=True, confirmed=True).figures
        assert figures.moved
        assert figures.message.startswith("retracted by ")
        assert force(lines) == 0.0
        assert (figures.force_before is not None) is box
        if box:
            assert figures.force_before > figures.free_air > figures.force_after
        else:
            assert "not known" in figures.message
