"""Live view of a run: one line that changes on a terminal, a line a reading elsewhere."""

import abc
import contextlib
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.live import Live
from rich.text import Text

from elastocal.procedure import Progress

REFRESH = 0.1
"""Shortest time between two changes of the line, in s of the wall."""
PATIENCE = 2.0
"""How long the end of a run waits for its view to be written, in s of the wall."""
_BAR = 20


def progress_text(said: Progress) -> str:
    """Return a progress report as one line.

    >>> from elastocal.procedure.run import Step
    >>> progress_text(Progress(1.0, 3, 31, 2, 1, Step.SETTLE, "north", 1135.2, 4e-5, 754.0))
    'pose 3 of 31  settle north  1135 N  slip 0.04 mm  13 min left'
    """
    where = f"pose {said.number} of {said.count}" if said.pose is not None else "to HOME"
    again = f" (attempt {said.attempt})" if said.attempt > 1 else ""
    what = f"{said.step.value} {said.load_case or ''}".rstrip()
    return (
        f"{where}{again}  {what}  {said.force:.0f} N  slip {said.slip * 1e3:.2f} mm"
        f"  {_duration(said.left)} left"
    )


@contextlib.contextmanager
def watching(console: Console, count: int) -> Iterator[Callable[[Progress], None]]:
    """Yield a function that shows progress reports.

    It returns at once: a thread of its own does the writing, as a terminal that takes nothing
    would stop whoever writes to it, and with it the watchdog. One that is gone is left alone.

    Parameters
    ----------
    console : Console
        Where; a line is rewritten only where it is a terminal.
    count : int
        Number of poses.
    """
    screen = _screen(console, count)
    screen.start()
    try:
        yield screen.tell
    finally:
        screen.close()


def _screen(console: Console, count: int) -> "_Screen":
    return _Terminal(console, count) if console.is_terminal else _Lines(console)


class _Screen(threading.Thread, abc.ABC):
    """Writes reports that wait to be written.

    Parameters
    ----------
    console : Console
        Where.
    most : int
        Reports that wait at most; older ones are dropped.
    """

    def __init__(self, console: Console, most: int) -> None:
        super().__init__(name="view of the run", daemon=True)
        self._console = console
        self._waiting: deque[Progress] = deque(maxlen=most)
        self._news, self._closed = threading.Event(), False

    def tell(self, said: Progress) -> None:
        """Take a report; called by the run."""
        self._waiting.append(said)
        self._news.set()

    def close(self) -> None:
        """Write what waits, if that can be done within `PATIENCE`."""
        self._closed = True
        self._news.set()
        self.join(PATIENCE)

    def run(self) -> None:
        """Write reports until closed, or until they cannot be written."""
        # Rich ends the program, SystemExit, when nobody reads a pipe any more, and before that
        # it cuts standard output off, which may still be asked for data.
        self._console.on_broken_pipe = _leave_off  # type: ignore[method-assign]
        with contextlib.suppress(OSError, ValueError):
            self.write()

    def write(self) -> None:
        """Write reports until closed."""
        for said in self.reports():
            self.show(said)

    def reports(self) -> Iterator[Progress]:
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
    def show(self, said: Progress) -> None:
        """Write one report."""


class _Terminal(_Screen):
    """One line that changes."""

    def __init__(self, console: Console, count: int) -> None:
        super().__init__(console, most=1)
        self._count, self._live = count, Live(console=console, transient=True, auto_refresh=False)

    def write(self) -> None:
        with self._live:
            super().write()

    def show(self, said: Progress) -> None:
        done = said.number if said.pose is None else said.number - 1
        line = Text(f"{_bar(done, self._count)} {progress_text(said)}")
        self._live.update(line, refresh=True)
        time.sleep(0.0 if self._closed else REFRESH)


class _Lines(_Screen):
    """A line whenever another pose is begun."""

    def __init__(self, console: Console) -> None:
        super().__init__(console, most=1000)
        self._last: tuple[int | None, int] | None = None

    def tell(self, said: Progress) -> None:
        if (said.pose, said.attempt) != self._last:
            self._last = (said.pose, said.attempt)
            super().tell(said)

    def show(self, said: Progress) -> None:
        self._console.print(progress_text(said), soft_wrap=True, markup=False)


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
