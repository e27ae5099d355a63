"""Where output goes: people read standard error, programs read standard output.

Rich is imported when something is printed: help does without most of it.
"""

import json
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from elastocal.progress import Progress

if TYPE_CHECKING:
    from rich.console import Console


def console() -> "Console":
    """Return the console that people read; standard output stays free for data."""
    from rich.console import Console

    return Console(stderr=True, highlight=False, soft_wrap=False)


def print_json(data: object) -> None:
    """Print a record as one JSON object on standard output, and nothing else there."""
    from elastocal.records import to_data

    sys.stdout.write(json.dumps(to_data(data), allow_nan=False) + "\n")
    # A disk that is full is to be known now, not when Python ends.
    sys.stdout.flush()


def print_lines(lines: Iterable[str]) -> None:
    """Print lines on standard output, for programs."""
    sys.stdout.writelines(f"{line}\n" for line in lines)
    sys.stdout.flush()


def print_remarks(console: "Console", label: str, texts: Iterable[str]) -> None:
    """Print warnings or notes, a line each; many of one kind are one line with their number."""
    from rich.text import Text

    from elastocal.results import counted_alike

    for text in counted_alike(texts):
        console.print(Text.assemble((f"{label}:", "yellow"), f" {text}"), soft_wrap=True)


@contextmanager
def progress_bars() -> Iterator[Progress]:
    """Yield a function that shows progress; nothing is shown where no person looks."""
    from rich import progress

    screen = console()
    bars = progress.Progress(
        progress.TextColumn("{task.description}"),
        progress.BarColumn(),
        progress.MofNCompleteColumn(),
        progress.TimeElapsedColumn(),
        console=screen,
        disable=not screen.is_terminal,
    )
    tasks = {}

    def report(stage: str, done: int, total: int) -> None:
        if stage not in tasks:
            tasks[stage] = bars.add_task(stage, total=total)
        bars.update(tasks[stage], completed=done, total=total)

    with bars:
        yield report
