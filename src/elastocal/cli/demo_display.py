"""One display for a story of many commands; what they print themselves goes into a log."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
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


Command = Callable[[list[str]], int | None]
"""Carries out a command by its words, as the command line does; returns its exit code."""


@contextmanager
def display(
    console: Console, log: Path, story: Sequence[Chapter], command: Command
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
    command : callable
        Carries a chapter's words out.

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
        stage = _Stage(file, command)
        if console.is_terminal:
            with _Bars(console, story, stage) as bars:
                yield bars.show
        else:
            yield lambda chapter: _line(console, story, chapter, stage)


@dataclass(frozen=True)
class _Stage:
    """Where commands are carried out: what they print goes into the log."""

    log: TextIO
    command: Command

    def carry_out(self, chapter: Chapter, report: Callable[[str, int, int], None]) -> int:
        self.log.write(f"$ {chapter.line}\n")
        with printing_to(Overheard(report, file=self.log, width=_WIDTH)):
            code = self.command(list(chapter.words))
        self.log.write("\n")
        self.log.flush()
        return int(code or 0)


class _Bars:
    """A bar a chapter; the one at work moves with what its command reports."""

    def __init__(self, console: Console, story: Sequence[Chapter], stage: _Stage) -> None:
        self._stage = stage
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

    def show(self, chapter: Chapter) -> int:
        task = self._tasks[chapter.title]
        self._progress.start_task(task)
        self._progress.update(task, total=None, stage=chapter.words[0])

        def report(stage: str, done: int, total: int) -> None:
            self._progress.update(task, completed=done, total=total, stage=stage)

        code = self._stage.carry_out(chapter, report)
        mark = "" if code == 0 else "not done"
        self._progress.update(task, completed=1.0, total=1.0, stage=mark)
        self._progress.stop_task(task)
        return code


def _line(console: Console, story: Sequence[Chapter], chapter: Chapter, stage: _Stage) -> int:
    number = list(story).index(chapter) + 1
    head = f"{number} of {len(story)}  {chapter.title}: {chapter.line}"
    console.print(head, soft_wrap=True, markup=False)
    began = time.monotonic()
    code = stage.carry_out(chapter, lambda _stage, _done, _total: None)
    console.print(f"    {time.monotonic() - began:.1f} s", markup=False)
    return code
