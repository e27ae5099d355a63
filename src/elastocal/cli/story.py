"""Display of ``elastocal demo``: its chapters, and the output of their commands."""

import io
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from elastocal import workflows
from elastocal.cli import output

if TYPE_CHECKING:
    from rich.console import Console

    from elastocal.progress import Progress
    from elastocal.results import Result
    from elastocal.workflows import Chapter, DemoResult

_WIDTH = 100
"""Columns of the log."""


def shown(*, out: Path, **settings: Any) -> "DemoResult":
    """Return the result of a demo, showing each chapter while it runs.

    Parameters
    ----------
    out : Path
        Folder of the demo.
    **settings : object
        The other fields of `workflows.DemoSettings`.
    """
    screen = output.console()

    @contextmanager
    def display(log: TextIO, story: "Sequence[Chapter]") -> "Iterator[_Display]":
        if screen.is_terminal:
            with _bars(screen, story) as show:
                yield _Display(log, out, show)
        else:
            yield _Display(log, out, _lines(screen, story))

    return workflows.demo(out=out, display=display, **settings)


class _Display:
    """Shows chapters, and logs what their commands print.

    Parameters
    ----------
    log : TextIO
        The open log.
    out : Path
        Folder of the demo.
    show : callable
        Makes a context for the work of a chapter.
    """

    def __init__(self, log: TextIO, out: Path, show: Callable[..., Any]) -> None:
        from elastocal.cli._operator import TerminalOperator

        self.operator = TerminalOperator(_log_console(log))
        self.show, self._out = show, out

    def text(self, chapter: "Chapter", result: "Result") -> str:
        """Return the printed output of a chapter's command."""
        printed = io.StringIO()
        words = chapter.words
        out = words[words.index("--out") + 1] if "--out" in words else None
        output.print_result(_log_console(printed), result, out)
        return printed.getvalue()


def _log_console(file: TextIO) -> "Console":
    return output.console(file=file, stderr=False, width=_WIDTH, force_terminal=False)


@contextmanager
def _bars(console: "Console", story: "Sequence[Chapter]") -> Iterator[Callable[..., Any]]:
    """Yield contexts that show a bar for each chapter; that of the current one moves."""
    from rich.progress import BarColumn, Progress as ProgressBars, TextColumn, TimeElapsedColumn

    bars = ProgressBars(
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=24),
        TimeElapsedColumn(),
        TextColumn("{task.fields[stage]}", style="dim", markup=False),
        console=console,
    )
    tasks = {each: bars.add_task(each.title, start=False, total=1.0, stage="") for each in story}

    @contextmanager
    def show(chapter: "Chapter") -> "Iterator[Progress]":
        task, mark = tasks[chapter], "not done"
        bars.start_task(task)
        bars.update(task, total=None, stage=chapter.words[0])

        def progress(stage: str, done: int, total: int, /) -> None:
            bars.update(task, completed=done, total=total, stage=stage)

        try:
            yield progress
            mark = ""
        finally:
            bars.update(task, completed=1.0, total=1.0, stage=mark)
            bars.stop_task(task)

    with bars:
        yield show


def _lines(console: "Console", story: "Sequence[Chapter]") -> Callable[..., Any]:
    """Return contexts that print a line a chapter, and how long it took."""

    @contextmanager
    def show(chapter: "Chapter") -> "Iterator[Progress]":
        from elastocal.progress import silent

        number = list(story).index(chapter) + 1
        head = f"{number} of {len(story)}  {chapter.title}: {chapter.line}"
        console.print(head, soft_wrap=True)
        began = time.monotonic()
        yield silent
        console.print(f"    {time.monotonic() - began:.1f} s")

    return show
