"""Live view of a run: one line that changes on a terminal, a line a reading elsewhere."""

import contextlib
import time
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.live import Live
from rich.text import Text

from elastocal.procedure.progress import Progress

REFRESH = 0.1
"""Shortest time between two changes of the line, in s of the wall."""
_BAR = 20


def progress_text(said: Progress) -> str:
    """Return a progress report as one line.

    >>> from elastocal.procedure.steps import Step
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

    Parameters
    ----------
    console : Console
        Where; a line is rewritten only where it is a terminal.
    count : int
        Number of poses.
    """
    if not console.is_terminal:
        yield _Lines(console)
        return
    with Live(console=console, transient=True, auto_refresh=False) as live:
        shown = 0.0

        def show(said: Progress) -> None:
            nonlocal shown
            now = time.monotonic()
            if now - shown >= REFRESH:
                shown = now
                done = said.number if said.pose is None else said.number - 1
                live.update(Text(f"{_bar(done, count)} {progress_text(said)}"), refresh=True)

        yield show


class _Lines:
    """Prints a line whenever another pose is begun."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._last: tuple[int | None, int] | None = None

    def __call__(self, said: Progress) -> None:
        if (said.pose, said.attempt) != self._last:
            self._last = (said.pose, said.attempt)
            self._console.print(progress_text(said), soft_wrap=True, markup=False)


def _bar(done: int, count: int) -> str:
    filled = _BAR * done // max(count, 1)
    return f"[{'#' * filled}{'.' * (_BAR - filled)}]"


def _duration(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60:02d} min"
