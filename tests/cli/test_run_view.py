"""The view of a run never makes it wait, and never ends it."""

import io
import queue
import signal
import threading
import time
from types import SimpleNamespace

import pytest
from rich.console import Console

from elastocal.cli import _operator as run_view
from elastocal.cli._operator import watching
from elastocal.procedure import Progress
from elastocal.procedure.run.steps import Step


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


@pytest.mark.parametrize("terminal", [True, False])
@pytest.mark.parametrize("show", [run_view.following_live, run_view.following_devices])
def test_a_terminal_that_takes_nothing_does_not_make_the_arm_wait(monkeypatch, terminal, show):
    """`live` ends after its duration, and `watch` does, whoever has stopped its terminal."""
    monkeypatch.setattr(run_view, "PATIENCE", 0.01)
    file, told = Clogged(), []
    given = SimpleNamespace(seconds=99.0, sentence=lambda: "12 s", figures=FOUND)

    def work():
        with show(Console(file=file, force_terminal=terminal)) as tell:
            for _ in range(100):
                tell(given)
                told.append(time.monotonic())

    worker = threading.Thread(target=work, daemon=True)
    worker.start()
    worker.join(10.0)
    assert not worker.is_alive()
    assert len(told) == 100
    file.clear.set()


FOUND = SimpleNamespace(
    devices=[SimpleNamespace(problem="", kind="arm", device="x", cells=lambda: ["-"])]
)


def test_live_says_a_line_each_ten_seconds_where_no_terminal_is():
    text = io.StringIO()
    with run_view.following_live(Console(file=text)) as tell:
        for k in range(50):
            tell(SimpleNamespace(seconds=0.5 * k, sentence=lambda k=k: f"{0.5 * k} s"))
    assert text.getvalue().split("\n") == ["0.0 s", "10.0 s", "20.0 s", ""]


class Answers(io.StringIO):
    """What a person types on a terminal."""

    def isatty(self):
        return True


def identified(monkeypatch, typed, asks=True, stdin=Answers):
    monkeypatch.setattr("sys.stdin", stdin(typed))
    shown = io.StringIO()
    operator = run_view.TerminalOperator(Console(file=shown, width=100), asks)
    missing = ("operator", "robot.serial", "sensor.uncertainty")
    return operator.identify(missing), shown.getvalue()


class TestIdentify:
    """What the certificate lacks is asked for on a terminal, one line each."""

    def test_answers_are_taken_and_an_empty_line_leaves_one_out(self, monkeypatch):
        found, shown = identified(monkeypatch, "M. Weber\n\n")
        assert found == {"operator": "M. Weber"}
        assert "robot, serial: " in shown

    def test_an_answer_that_is_none_is_asked_for_again(self, monkeypatch):
        found, shown = identified(monkeypatch, "\nKR-1\nmuch\n2 N\n")
        assert found["robot.serial"] == "KR-1"
        assert shown.count("sensor, uncertainty: ") == 2

    def test_back_asks_the_entry_before_again(self, monkeypatch):
        found, shown = identified(monkeypatch, "KR-1\nback\nM. Weber\nKR-1\nskip\n")
        assert found == {"operator": "M. Weber", "robot.serial": "KR-1"}
        assert shown.count("operator: ") == 2

    @pytest.mark.parametrize(("asks", "stdin"), [(False, Answers), (True, io.StringIO)])
    def test_nobody_is_asked_without_a_terminal_or_when_told_not_to(self, monkeypatch, asks, stdin):
        assert identified(monkeypatch, "M. Weber\n", asks, stdin) == ({}, "")


class Typed(Answers):
    """What a person types, line by line, when it is time."""

    def __init__(self):
        super().__init__()
        self._lines = queue.Queue()

    def type(self, line):
        self._lines.put(line)

    def readline(self, *_):
        return self._lines.get()


class TestAskedInTheMiddle:
    """A person does something in the cell while a run waits."""

    @pytest.fixture
    def asked(self, monkeypatch):
        """Return a person at a terminal, with the supervision of a run, and what was shown."""
        stdin, shown = Typed(), io.StringIO()
        monkeypatch.setattr("sys.stdin", stdin)
        operator = run_view.TerminalOperator(Console(file=shown, width=200))
        assert operator.answers
        with operator.supervise(9) as supervision:
            stdin.type("\n")  # pressed before, for nothing
            yield stdin, supervision, supervision.ask("put the second disk on the first"), shown

    def until(self, condition):
        end = time.monotonic() + 10.0
        while not condition() and time.monotonic() < end:
            time.sleep(0.005)
        assert condition()

    def test_the_word_is_the_answer_and_enter_is_not(self, asked):
        stdin, supervision, is_done, shown = asked
        self.until(lambda: shown.getvalue().count("type done and Enter") == 2)
        assert "put the second disk on the first" in shown.getvalue()
        assert not is_done()
        stdin.type(" Done\n")
        self.until(is_done)
        assert not supervision.interrupted()

    def test_a_terminal_whose_input_ends_stops_the_run(self, asked):
        stdin, supervision, is_done, _ = asked
        stdin.type("")
        self.until(supervision.interrupted)
        assert not is_done()

    def test_ctrl_c_stops_it(self, asked):
        _, supervision, is_done, _ = asked
        signal.raise_signal(signal.SIGINT)
        assert supervision.interrupted()
        assert not is_done()


def test_the_disks_of_a_simulated_cell_are_typed(monkeypatch):
    stdin, shown, stacked = Typed(), io.StringIO(), queue.Queue()
    monkeypatch.setattr("sys.stdin", stdin)
    run_view.stack_by_hand(Console(file=shown, width=200), stacked.put)
    for line in ("three\n", "2\n", "1\n", ""):
        stdin.type(line)
    assert [stacked.get(timeout=10.0) for _ in range(2)] == [2, 1]
    assert shown.getvalue().count("type 1 or 2") == 2
