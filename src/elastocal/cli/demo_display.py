"""One display for a story of many commands; what they print themselves goes into a log."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from elastocal.cli.demo_story import Chapter
from elastocal.cli.output import printing_to
from elastocal.cli.progress import Overheard
from elastocal.errors import FileAccessError

_WIDTH = 100
"""Columns of the log."""


@contextmanager
def display(
    console: Console, log: Path, story: Sequence[Chapter]
) -> Iterator[Callable[[Chapter], int]]:
    """Yield a function that carries a chapter out and returns its exit code.

    Parameters
    ----------
    console : Console
        On a terminal it shows bars, elsewhere a line a chapter.
    log : Path
        Takes every command and what it prints.
    story : sequence of Chapter
        What is to come.

    Raises
    ------
    FileAccessError
        If the log cannot be written.
    """
    try:
        file = log.open("w", encoding="utf-8")
    except OSError as error:
        raise FileAccessError(f"cannot write {log}: {error.strerror or error}") from error
    with file:
        if console.is_terminal:
            with _Bars(console, story) as bars:
                yield lambda chapter: bars.show(chapter, file)
        else:
            yield lambda chapter: _line(console, story, chapter, file)


class _Bars:
    """A bar a chapter; the one at work moves with what its command reports."""

    def __init__(self, console: Console, story: Sequence[Chapter]) -> None:
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=24),
            TimeElapsedColumn(),
            TextColumn("[dim]{task.fields[stage]}"),
            console=console,
        )
        self._tasks: dict[str, TaskID] = {
            chapter.title: self._progress.add_task(chapter.title, start=False, total=1.0, stage="")
            for chapter in story
        }

    def __enter__(self) -> "_Bars":
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def show(self, chapter: Chapter, log: TextIO) -> int:
        task = self._tasks[chapter.title]
        self._progress.start_task(task)
        self._progress.update(task, total=None, stage=chapter.words[0])

        def report(stage: str, done: int, total: int) -> None:
            self._progress.update(task, completed=done, total=total, stage=stage)

        code = _carry_out(chapter, log, report)
        mark = "" if code == 0 else "not done"
        self._progress.update(task, completed=1.0, total=1.0, stage=mark)
        self._progress.stop_task(task)
        return code


def _line(console: Console, story: Sequence[Chapter], chapter: Chapter, log: TextIO) -> int:
    number = list(story).index(chapter) + 1
    head = f"{number} of {len(story)}  {chapter.title}: {chapter.line}"
    console.print(head, soft_wrap=True, markup=False)
    began = time.monotonic()
    code = _carry_out(chapter, log, lambda _stage, _done, _total: None)
    console.print(f"    {time.monotonic() - began:.1f} s", markup=False)
    return code


def _carry_out(chapter: Chapter, log: TextIO, report: Callable[[str, int, int], None]) -> int:
    """Run a command as the command line would, and return its exit code."""
    from elastocal.cli.main import app  # which knows this command, too

    log.write(f"$ {chapter.line}\n")
    listener = Overheard(report, file=log, width=_WIDTH)
    with printing_to(listener):
        code = app(list(chapter.words), standalone_mode=False)
    log.write("\n")
    log.flush()
    return int(code or 0)
