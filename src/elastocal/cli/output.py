"""Where output goes: people read standard error, programs read standard output.

Names and texts of other people's files pass here on their way to a terminal, which takes some
characters for commands: `printable` leaves none of them.

Rich is imported when something is printed: help does without most of it.
"""

import json
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING, Any

from elastocal.progress import Progress

if TYPE_CHECKING:
    from rich.console import Console
    from rich.segment import Segment


_CONTROLS: dict[int, int | str] = {code: 0x2400 + code for code in range(32) if code not in (9, 10)}
_CONTROLS |= {0x7F: "\u2421"} | dict.fromkeys(range(0x80, 0xA0), "\ufffd")
# What turns the direction of writing round shows a name as another.
_CONTROLS |= dict.fromkeys((*range(0x202A, 0x202F), *range(0x2066, 0x206A)), "\ufffd")


def printable(text: str) -> str:
    r"""Return a text whose control characters show as signs, so that a terminal obeys none.

    >>> printable("a\x1b[2J")
    'a␛[2J'
    """
    return text.translate(_CONTROLS)


def console(**settings: Any) -> "Console":
    """Return a console that people read; by default standard error.

    Parameters
    ----------
    **settings
        See `rich.console.Console`.
    """
    return _console_class()(**({"stderr": True, "soft_wrap": False} | settings), highlight=False)


@cache
def _console_class() -> "type[Console]":
    from rich.console import Console

    class Screen(Console):
        """Shows texts as `printable` has them; the codes for colours are its own."""

        def render(self, *given: Any, **options: Any) -> "Iterator[Segment]":
            for segment in super().render(*given, **options):
                yield segment if segment.control else segment._replace(text=printable(segment.text))

    return Screen


def print_json(data: object) -> None:
    """Print a record as one JSON object on standard output, and nothing else there."""
    from elastocal.records import to_data

    sys.stdout.write(json.dumps(to_data(data), allow_nan=False) + "\n")
    # A disk that is full is to be known now, not when Python ends.
    sys.stdout.flush()


def print_lines(lines: Iterable[str]) -> None:
    """Print lines on standard output, for programs."""
    sys.stdout.writelines(f"{printable(line)}\n" for line in lines)
    sys.stdout.flush()


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
