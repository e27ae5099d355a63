"""Where output goes: people read standard error, programs read standard output."""

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress as ProgressBars,
    TextColumn,
    TimeElapsedColumn,
)

from elastocal.progress import Progress
from elastocal.records import to_data


def console() -> Console:
    """Return the console that people read; standard output stays free for data."""
    return Console(stderr=True, highlight=False, soft_wrap=False)


def print_json(data: object) -> None:
    """Print a record as one JSON object on standard output, and nothing else there."""
    sys.stdout.write(json.dumps(to_data(data), allow_nan=False) + "\n")
    # A disk that is full is to be known now, not when Python ends.
    sys.stdout.flush()


@contextmanager
def progress_bars(console: Console) -> Iterator[Progress]:
    """Yield a function that shows progress; nothing is shown where no person looks.

    Parameters
    ----------
    console : Console
        Where bars are drawn when it is a terminal.
    """
    bars = ProgressBars(
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
