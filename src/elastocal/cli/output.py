"""Output: text for people goes to standard error, data for programs to standard output.

Printed text contains names and paths from files. None of it is interpreted as markup: emphasis uses
`bold` and similar functions, and control sequences of the terminal are shown escaped.

Rich is imported when something is printed: help needs little of it.
"""

import json
import re
import sys
import textwrap
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from elastocal.asking import SKIP
from elastocal.errors import FileAccessError
from elastocal.findings import group_alike
from elastocal.progress import Progress
from elastocal.results import REMARKS, Result

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table as RichTable

    from elastocal.blocks import Block, Cell, Table


_HEADS = (80, 18, 14, 10)
"""Characters that a line of a heading may have: the first with which a table fits."""
_BETWEEN = 2
"""Spaces between columns."""
_NAME = 18
"""Characters that the name of a row is given at least."""
_STYLES = ("bold", "dim", "red", "yellow", "green")
_FIRST, _END = 0xE000, "\ue0ff"
"""Letters for private use: a style begins with that of its number, and all end with the same."""
_STARTS = {chr(_FIRST + number): style for number, style in enumerate(_STYLES)}


def _styled(style: str, text: object) -> str:
    return f"{chr(_FIRST + _STYLES.index(style))}{text}{_END}"


bold, dim, red, yellow, green = (partial(_styled, style) for style in _STYLES)
"""Return a text that `console` shows in a style."""


def console(**options: Any) -> "Console":
    """Return the console on standard error; standard output stays free for data.

    Parameters
    ----------
    **options : object
        Options of Rich's console, in place of the defaults.
    """
    from rich.console import Console
    from rich.text import Text

    class Screen(Console):
        """A console that knows no markup but ours, in lines and in tables alike."""

        def render_str(self, text: str, **options: Any) -> Text:
            """Return a text with its styles."""
            shown = Text(
                style=options.get("style", ""),
                justify=options.get("justify"),
                overflow=options.get("overflow"),
            )
            styles: list[str] = []
            for part in _PARTS.split(text):
                if part in _STARTS:
                    styles.append(_STARTS[part])
                elif part == _END:
                    styles = styles[:-1]
                else:
                    shown.append(visible(part), " ".join(styles) or None)
            return shown

    return Screen(**{"stderr": True, "highlight": False, "soft_wrap": False, **options})


def asked(screen: "Console", question: str) -> str:
    """Return the answer typed to a question; the end of input leaves out all that follow."""
    screen.print(f"{question}: ", end="", soft_wrap=True, markup=False, highlight=False)
    answer = sys.stdin.readline()
    if not answer:
        screen.print()  # the question has no end of its line
    return answer or SKIP


_PARTS = re.compile(f"([{''.join(_STARTS)}{_END}])")


def visible(text: str) -> str:
    """Return a text without what a terminal obeys, and without halves of letters."""
    if text.isprintable():
        return text
    return "".join(
        each if each.isprintable() or each in "\n\t " else ascii(each)[1:-1] for each in text
    )


def print_json(data: object) -> None:
    """Print a record as one JSON object on standard output, and nothing else there."""
    from elastocal.records import to_data

    _hand_over(json.dumps(to_data(data), allow_nan=False) + "\n")


def print_lines(lines: Iterable[str]) -> None:
    """Print lines on standard output, for programs."""
    _hand_over("".join(f"{visible(line)}\n" for line in lines))


def _hand_over(text: str) -> None:
    if sys.stdout is None:  # closed by a shell: >&-
        raise FileAccessError("cannot write output: standard output is closed")
    sys.stdout.write(text)
    # A disk that is full is to be known now, not when Python ends.
    sys.stdout.flush()


def print_remarks(screen: "Console", label: str, texts: Iterable[str]) -> None:
    """Print warnings or notes, a line each; many of one kind are one line with their number."""
    for text in group_alike(texts):
        screen.print(f"{yellow(f'{label}:')} {text}", soft_wrap=True)


def print_blocks(screen: "Console", shown: "Iterable[Block]") -> None:
    """Print blocks; pictures, scenes and what may be opened are left to pages.

    Parameters
    ----------
    screen : Console
        From `console`.
    shown : iterable of Block
        In the order in which they are read.
    """
    from elastocal.blocks import Bullets, Facts, Table

    before: Block | None = None
    for block in shown:
        if block == Facts(()) or block == Bullets(()):
            continue
        if isinstance(before, Table) or (before and isinstance(block, Table)):
            screen.print()
        before = block
        if isinstance(block, Table):
            screen.print(bold(block.caption), soft_wrap=True)
            for number, part in enumerate(_parts(block, screen.width)):
                if number:
                    screen.print()
                screen.print(table_of(part, screen.width), crop=False)
        for line in _lines(block):
            screen.print(line, soft_wrap=True)


def print_result(screen: "Console", result: Result, out: object = None) -> None:
    """Print the blocks of a result and the files that were written."""
    print_blocks(screen, result.show())
    if out is not None:
        screen.print(f"written to {bold(out)}", soft_wrap=True)


def _lines(block: "Block") -> list[str]:
    """Return the lines of a block that is no table."""
    from elastocal import blocks

    match block:
        case blocks.Paragraph(text, "sentence"):
            return [bold(text)]
        case blocks.Paragraph(text) | blocks.Verbatim(text):
            return [text]
        case blocks.Heading(text):
            return ["", bold(text)]
        case blocks.Bullets(items):
            return [f"   {item}" for item in items]
        case blocks.Facts(pairs):
            return [
                f"{yellow(f'{name}:') if name in REMARKS else f'{name}:'} {value}"
                for name, value in pairs
            ]
    return []


def _parts(block: "Table", width: int) -> "Iterator[Table]":
    """Yield a table in as many as it takes for all numbers to be seen, each with the first column.

    A number that is cut would be another number.
    """
    least = [_least(block, number) for number in range(len(block.heads))]
    groups, room = [[0]], width - least[0]
    for number, needed in enumerate(least[1:], start=1):
        room -= needed + _BETWEEN
        if room < 0 and len(groups[-1]) > 1:
            groups.append([0])
            room = width - least[0] - needed - _BETWEEN
        groups[-1].append(number)
    for group in groups:
        yield replace(
            block,
            heads=tuple(block.heads[k] for k in group),
            rows=tuple(tuple(row[k] for k in group) for row in block.rows),
            texts=sum(k < block.texts for k in group),
        )


def _least(block: "Table", column: int) -> int:
    """Return the width below which a column cannot be read."""
    from elastocal.blocks import cell_text

    longest = max((len(cell_text(row[column])) for row in block.rows), default=0)
    head = max(map(len, block.heads[column].split()), default=0)
    if column < block.texts or _are_words(block, column):
        longest = min(longest, _HEADS[-1] if column else _NAME)
    return max(longest, head)


def table_of(block: "Table", width: int = 80) -> "RichTable":
    """Return a table for a terminal: numbers whole, words folded where the terminal is narrow.

    Parameters
    ----------
    block : Table
        The table.
    width : int, optional
        Columns of the terminal. Headings are folded until the table fits, as far as that helps.
    """
    from rich.table import Table as RichTable

    from elastocal.blocks import cell_text

    columns = range(len(block.heads))
    longest = [
        max((len(visible(cell_text(row[k]))) for row in block.rows), default=0) for k in columns
    ]
    for widest in _HEADS:
        heads = [_folded(head, max(longest[k], widest)) for k, head in enumerate(block.heads)]
        widths = [max(longest[k], *map(len, lines)) for k, lines in enumerate(heads)]
        if _across(widths) <= width:
            break
    words = [number < block.texts or _are_words(block, number) for number in columns]
    # The library takes from all columns alike what is too much, and a number that is cut would be
    # another number: words alone are folded, the widest first.
    least = {k: _least(block, k) for k in columns if words[k]}
    while _across(widths) > width and (wide := [k for k in least if widths[k] > least[k]]):
        widths[max(wide, key=widths.__getitem__)] -= 1
    table = RichTable(box=None, pad_edge=False, width=_across(widths))
    for number, lines in enumerate(heads):
        table.add_column(
            "\n".join(lines),
            justify="left" if words[number] else "right",
            no_wrap=not words[number],
            width=widths[number],
            overflow="fold",
        )
    for row in block.rows:
        table.add_row(*map(_cell, row))
    return table


def _across(widths: Sequence[int]) -> int:
    """Return the width of a table with columns of such widths."""
    return sum(widths) + _BETWEEN * (len(widths) - 1)


def _folded(head: str, width: int) -> list[str]:
    """Return the lines of a heading, with the unit below the quantity."""
    parts = head.split(", ")
    found = [line for part in parts for line in textwrap.wrap(part, width, break_long_words=False)]
    return found or [""]


def _are_words(block: "Table", column: int) -> bool:
    """Return whether no cell of a column has a figure at its head."""
    from elastocal.blocks import cell_text

    texts = [cell_text(row[column]) for row in block.rows]
    return not any(text[:1].isdigit() or text[:1] in "(-+" for text in texts if text)


def _cell(value: "Cell") -> str:
    from elastocal.blocks import cell_text

    grade = {"good": green, "fair": yellow, "poor": red}.get(getattr(value, "grade", ""))
    return grade(cell_text(value)) if grade else cell_text(value)


_EVERY = 10.0
"""Seconds between lines of progress where bars cannot be drawn."""


class ProgressLines:
    """Shows progress where bars cannot be drawn, in a log or a pipe: a line every ten seconds.

    Work that takes less says nothing.

    Parameters
    ----------
    screen : Console
        From `console`.
    clock : callable, optional
        Seconds that have passed since any moment.
    """

    def __init__(self, screen: "Console", clock: Callable[[], float] = time.monotonic) -> None:
        self._screen, self._clock = screen, clock
        self._begun = self._last = clock()

    def __call__(self, stage: str, done: int, total: int, /) -> None:
        """Take note of ``done`` of ``total`` steps of a stage."""
        now = self._clock()
        if now - self._last >= _EVERY:
            self._last = now
            self._screen.print(
                f"{stage}: {done} of {total} after {now - self._begun:.0f} s", soft_wrap=True
            )


@contextmanager
def progress_bars() -> Iterator[Progress]:
    """Yield a function that shows progress: bars on a terminal, else lines."""
    from rich import progress

    screen = console()
    if not screen.is_terminal:
        yield ProgressLines(screen)
        return
    bars = progress.Progress(
        progress.TextColumn("{task.description}", markup=False),
        progress.BarColumn(),
        progress.MofNCompleteColumn(),
        progress.TimeElapsedColumn(),
        console=screen,
    )
    tasks = {}

    def report(stage: str, done: int, total: int) -> None:
        if stage not in tasks:
            tasks[stage] = bars.add_task(stage, total=total)
        bars.update(tasks[stage], completed=done, total=total)

    with bars:
        yield report
