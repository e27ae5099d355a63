"""The view of a run never makes it wait, and never ends it."""

import io
import threading

import pytest
from rich.console import Console

from elastocal.cli import _operator as run_view
from elastocal.cli._operator import watching
from elastocal.procedure import Progress
from elastocal.procedure.run import Step


def report(pose, attempt=1):
    return Progress(1.0, pose + 1, 9, pose, attempt, Step.SETTLE, "north", 100.0, 0.0, 60.0)


class Clogged(io.StringIO):
    """Takes nothing until it is told to."""

    def __init__(self):
        super().__init__()
        self.clear = threading.Event()

    def write(self, text):
        self.clear.wait()
        return super().write(text)


class Gone(io.StringIO):
    """A pipe that nobody reads any more."""

    def write(self, text):
        raise BrokenPipeError(32, f"Broken pipe: {text!r}")


def test_each_pose_has_its_line():
    text = io.StringIO()
    with watching(Console(file=text), 9) as tell:
        for pose in (0, 0, 1, 2, 2):
            tell(report(pose))
        tell(report(2, attempt=2))
    lines = text.getvalue().splitlines()
    assert [line[:15] for line in lines] == [
        *("pose 0 (1 of 9)", "pose 1 (2 of 9)"),
        *["pose 2 (3 of 9)"] * 2,
    ]


def test_a_terminal_shows_the_newest_report():
    text = io.StringIO()
    with watching(Console(file=text, force_terminal=True, width=100), 9) as tell:
        for pose in range(9):
            tell(report(pose))
    assert "pose 8 (9 of 9)" in text.getvalue()


@pytest.mark.parametrize("terminal", [True, False])
def test_what_takes_nothing_does_not_make_the_run_wait(monkeypatch, terminal):
    monkeypatch.setattr(run_view, "PATIENCE", 0.01)
    file = Clogged()
    with watching(Console(file=file, force_terminal=terminal), 9) as tell:
        for pose in range(5000):
            tell(report(pose))
        file.clear.set()


@pytest.mark.parametrize("terminal", [True, False])
def test_what_is_gone_is_left_alone(capfd, terminal):
    with watching(Console(file=Gone(), force_terminal=terminal), 9) as tell:
        for pose in range(9):
            tell(report(pose))
    # Standard output is still there for data.
    print("data")
    assert capfd.readouterr().out == "data\n"
