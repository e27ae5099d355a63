"""The person at a terminal: sees a run live, agrees before it moves, and stops it by Ctrl-C.

The view is one line that changes on a terminal, a line a pose elsewhere. Signals that would end
the program ask the run to stop instead: the arm is brought to safety first.
"""

import abc
import contextlib
import math
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from types import FrameType
from typing import Generic, TypeVar

import typer
from rich.console import Console, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from elastocal.asking import HELP, ask_in_turn
from elastocal.cell import DeviceReading, read_statements
from elastocal.cli import output
from elastocal.errors import ProcedureError
from elastocal.procedure import Progress
from elastocal.units import quantity
from elastocal.workflows import LiveReport, Supervision, WatchResult

REFRESH = 0.1
"""Shortest time between two changes of the line, in s of the wall."""
PATIENCE = 2.0
"""Largest time that the end of a run waits for its view to be written, in s of wall time."""
_BAR = 20
_LIVE_LINES = 10.0
"""Between two lines of a live compensation where no terminal is, in s."""


def progress_text(step: Progress) -> str:
    """Return a progress report as one line.

    >>> from elastocal.procedure.run.steps import Step
    >>> progress_text(Progress(1.0, 3, 31, 2, 1, Step.SETTLE, "north", 1135.2, 4e-5, 754.0))
    'pose 2 (3 of 31)  settle north  1135 N  slip 0.04 mm  13 min left'
    """
    where = "to HOME"
    if step.pose is not None:
        where = f"pose {step.pose} ({step.number} of {step.count})"
    again = f" (attempt {step.attempt})" if step.attempt > 1 else ""
    what = f"{step.step.value} {step.load_case or ''}".rstrip()
    return (
        f"{where}{again}  {what}  {step.force:.0f} N  slip {quantity(step.slip, 'mm', '.2f')}"
        f"  {_duration(step.left)} left"
    )


@contextlib.contextmanager
def watching(console: Console, count: int) -> Iterator[Callable[[Progress], None]]:
    """Yield a function that shows progress reports.

    It returns at once, since a separate thread writes: a terminal that accepts no output blocks the
    writer, which must not be the watchdog. A terminal that was closed is ignored.

    Parameters
    ----------
    console : Console
        Where; a line is rewritten only where it is a terminal.
    count : int
        Number of poses.
    """
    with _Terminal(console, count) if console.is_terminal else _Lines(console) as tell:
        yield tell


def following_live(console: Console) -> AbstractContextManager[Callable[[LiveReport], None]]:
    """Show how a live compensation is going, as `watching` does: a line each 10 s elsewhere."""
    return _LiveTerminal(console, 1) if console.is_terminal else _LiveLines(console, 1000)


def following_devices(console: Console) -> AbstractContextManager[Callable[[WatchResult], None]]:
    """Show the devices of a cell, as `watching` does; nothing where there is no terminal."""
    if not console.is_terminal:
        return contextlib.nullcontext(lambda _: None)
    return _DevicesTable(console, 1)


Report = TypeVar("Report")


class _Screen(threading.Thread, abc.ABC, Generic[Report]):
    """Writes reports that wait to be written; entered, it gives the function that takes them.

    Parameters
    ----------
    console : Console
        Where.
    most : int
        Reports that wait at most; older ones are dropped.
    """

    def __init__(self, console: Console, most: int) -> None:
        super().__init__(name="view", daemon=True)
        self._console = console
        self._waiting: deque[Report] = deque(maxlen=most)
        self._news, self._closed = threading.Event(), False

    def tell(self, report: Report) -> None:
        """Take a report; it returns at once."""
        self._waiting.append(report)
        self._news.set()

    def __enter__(self) -> Callable[[Report], None]:
        self.start()
        return self.tell

    def __exit__(self, *_: object) -> None:
        """Write what waits, if that can be done within `PATIENCE`."""
        self._closed = True
        self._news.set()
        self.join(PATIENCE)

    def run(self) -> None:
        """Write reports until closed, or until they cannot be written."""
        # Rich raises SystemExit when nobody reads a pipe any more, after it has closed standard
        # output, which may still be needed for data.
        self._console.on_broken_pipe = _leave_off  # type: ignore[method-assign]
        with contextlib.suppress(OSError, ValueError):
            self.write()

    def write(self) -> None:
        """Write reports until closed."""
        for report in self.reports():
            self.show(report)

    def reports(self) -> Iterator[Report]:
        """Yield reports until closed."""
        while True:
            self._news.wait()
            self._news.clear()
            closed = self._closed
            while self._waiting:
                yield self._waiting.popleft()
            if closed:
                return

    @abc.abstractmethod
    def show(self, report: Report) -> None:
        """Write one report."""


class _InPlace(_Screen[Report]):
    """Something that changes in place."""

    def write(self) -> None:
        self._live = Live(console=self._console, transient=True, auto_refresh=False)
        with self._live:
            super().write()

    def show(self, report: Report) -> None:
        self._live.update(self.shown(report), refresh=True)
        time.sleep(0.0 if self._closed else REFRESH)

    @abc.abstractmethod
    def shown(self, report: Report) -> RenderableType:
        """Return what a report looks like."""


class _Terminal(_InPlace[Progress]):
    """One line that changes."""

    def __init__(self, console: Console, count: int) -> None:
        super().__init__(console, most=1)
        self._count = count

    def shown(self, report: Progress) -> Text:
        done = report.number if report.pose is None else report.number - 1
        return Text(f"{_bar(done, self._count)} {progress_text(report)}")


class _Lines(_Screen[Progress]):
    """A line whenever another pose is begun."""

    def __init__(self, console: Console) -> None:
        super().__init__(console, most=1000)
        self._last: tuple[int | None, int] | None = None

    def tell(self, report: Progress) -> None:
        if (report.pose, report.attempt) != self._last:
            self._last = (report.pose, report.attempt)
            super().tell(report)

    def show(self, report: Progress) -> None:
        self._console.print(progress_text(report), soft_wrap=True)


class _LiveTerminal(_InPlace[LiveReport]):
    """One line that changes."""

    def shown(self, report: LiveReport) -> Text:
        return Text(report.sentence())


class _LiveLines(_Screen[LiveReport]):
    """A line each 10 s."""

    _last = -math.inf

    def tell(self, report: LiveReport) -> None:
        if report.seconds >= self._last + _LIVE_LINES:
            self._last = report.seconds
            super().tell(report)

    def show(self, report: LiveReport) -> None:
        self._console.print(report.sentence(), soft_wrap=True)


class _DevicesTable(_InPlace[WatchResult]):
    """A table that changes."""

    def shown(self, report: WatchResult) -> Table:
        table = Table("device", *DeviceReading.COLUMNS, expand=True)
        for each in report.figures.devices:
            mark = output.red("●") if each.problem else output.green("●")
            table.add_row(f"{mark} {each.kind} {each.device}", *each.cells())
        return table


def _leave_off() -> None:
    raise OSError("nobody reads the view any more")


def _bar(done: int, count: int) -> str:
    filled = _BAR * done // max(count, 1)
    return f"[{'#' * filled}{'.' * (_BAR - filled)}]"


def _duration(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60:02d} min"


_DONE = "done"
"""Answer that something has been done in the cell, and that it is clear."""
_DISKS = {"1": "one disk", "2": "two disks"}
"""Number of disks that can be typed, with what is said to it."""
NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP")
"""Signals by which a person, a terminal or a system ends or halts a program, which would leave the
arm pressing without supervision. Not every system has all of them."""


@contextlib.contextmanager
def interruption() -> Iterator[Callable[[], bool]]:
    """Yield a function that returns whether the run was asked to stop.

    Meanwhile the signals of `NAMES` do not interrupt a step: the runner checks the function once a
    cycle, releases the force, retracts and stops.
    """
    asked = threading.Event()

    def note(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - signal's form
        asked.set()

    if threading.current_thread() is not threading.main_thread():
        yield asked.is_set
        return
    numbers = [getattr(signal, name) for name in NAMES if hasattr(signal, name)]
    before = {number: signal.signal(number, note) for number in numbers}
    try:
        yield asked.is_set
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class TerminalOperator:
    """Operator at a terminal: answers questions, sees the progress, and stops by Ctrl-C.

    Parameters
    ----------
    console : Console
        Console of the operator.
    asks : bool
        Whether the operator is asked for missing entries of the certificate, if there is a
        terminal.
    """

    def __init__(self, console: Console, asks: bool = False) -> None:
        self._console, self._asks = console, asks

    def warn(self, lines: Sequence[str]) -> None:
        """Print what should be known before anything moves."""
        for line in lines:
            self._console.print(line, soft_wrap=True)

    @property
    def answers(self) -> bool:
        """Whether there is a terminal to answer at."""
        return sys.stdin.isatty()

    def confirm(self) -> None:
        """Ask whether the cell is clear.

        Raises
        ------
        ProcedureError
            If nobody can be asked, or the answer is no.
        """
        if not sys.stdin.isatty():
            raise ProcedureError("a person must confirm that the cell is clear: give --yes")
        question = "Has somebody looked at the cell, and may the arm move?"
        if not typer.confirm(question, err=True):
            raise ProcedureError("not confirmed: nothing was moved")

    def identify(self, missing: Sequence[str]) -> Mapping[str, str]:
        """Ask for missing entries of the certificate."""
        found: dict[str, str] = {}
        if not (missing and self._asks and sys.stdin.isatty()):
            return found
        self._console.print(f"For the certificate. {HELP}.")

        def put(name: str) -> str:
            shown = f"{missing.index(name) + 1} of {len(missing)}  {name.replace('.', ', ')}"
            return output.asked(self._console, f"  {shown}")

        def take(name: str, answer: str) -> None:
            found.pop(name, None)
            found.update(read_statements((f"{name}={answer}",)) if answer else {})

        ask_in_turn(
            missing, put, take, lambda error: self._console.print(str(error), soft_wrap=True)
        )
        return found

    @contextmanager
    def supervise(self, poses: int) -> Iterator[Supervision]:
        """Show every step; signals that end a program stop the run instead."""
        gone = threading.Event()
        with interruption() as interrupted, watching(self._console, poses) as show:
            yield Supervision(
                show, lambda: interrupted() or gone.is_set(), lambda what: self._ask(what, gone)
            )

    def _ask(self, what: str, gone: threading.Event) -> Callable[[], bool]:
        """Ask for something to be done, which a typed word says; set ``gone`` where input ends."""
        done = threading.Event()

        def listen() -> None:
            # A word rather than Enter, which somebody may have pressed long before.
            while line := sys.stdin.readline():
                if line.strip().lower() == _DONE:
                    done.set()
                    return
                self.warn([remedy])
            gone.set()

        remedy = f"type {_DONE} and Enter when it is; Ctrl-C stops the run, --resume goes on"
        self.warn([f"{what}; {remedy}"])
        threading.Thread(target=listen, name="answer", daemon=True).start()
        return done.is_set


def stack_by_hand(console: Console, stack: Callable[[int], None]) -> None:
    """Stack as many disks in a simulated cell as are typed, from now on; where there is a terminal.

    Parameters
    ----------
    console : Console
        Console of the person.
    stack : callable
        Stacks one disk or two.
    """

    def listen() -> None:
        while line := sys.stdin.readline():
            if line.strip() in _DISKS:
                stack(int(line))
            console.print(_DISKS.get(line.strip(), how))

    how = "type 1 or 2 and Enter for so many disks between tool and tooling"
    if sys.stdin.isatty():
        console.print(how)
        threading.Thread(target=listen, name="disks", daemon=True).start()
