"""Progress of long work, for people: a bar with counts for each stage."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TextIO

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

Report = Callable[[str, int, int], None]
"""Told a stage, how much of it is done and how much there is."""


class Overheard(Console):
    """A console that writes to a file while somebody else shows the progress.

    Parameters
    ----------
    report : callable
        Told what a bar would show.
    file : TextIO
        Takes what is printed.
    width : int
        Columns.
    """

    def __init__(self, report: Report, file: TextIO, width: int) -> None:
        super().__init__(file=file, width=width, highlight=False, force_terminal=False)
        self.report = report


@contextmanager
def progress_bars(console: Console) -> Iterator[Report]:
    """Yield a function that shows progress; nothing is shown where no person looks.

    Parameters
    ----------
    console : Console
        Where bars are drawn when it is a terminal.
    """
    if isinstance(console, Overheard):
        yield console.report
        return
    bars = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=console,
        disable=not console.is_terminal,
    )
    tasks = {}

    def report(stage: str, done: int, total: int) -> None:
        if stage not in tasks:
            tasks[stage] = bars.add_task(stage, total=total)
        bars.update(tasks[stage], completed=done, total=total)

    with bars:
        yield report
