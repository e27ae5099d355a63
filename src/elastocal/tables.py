"""Reader and writer of all CSV tables.

A table has a header line that names each column, with its unit where it has one (``force_x[N]``);
comment and blank lines may precede it. Rows are counted as lines of the file from 1, as editors and
spreadsheets show them. This module does not know the meaning of a table: its caller checks names of
columns and lengths of rows, and words the refusals.
"""

import csv
import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import chain, islice
from pathlib import Path
from typing import TextIO

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import ElastocalError, FileAccessError
from elastocal.files import Limit, readable, replacing
from elastocal.units import parse_number

_MOST_ROW = Limit("ELASTOCAL_MAX_ROW_KB", 4_000, "kB")
_MOST_CELL = Limit("ELASTOCAL_MAX_CELL_KB", 128, "kB")
_KILOBYTE = 1_000
DELIMITERS = ",;\t"
"""Delimiters that are recognised; the first is the one that is written."""
_BETWEEN = "\x1f"
"""Between packed cells: what ASCII has for it, and no cell holds."""
_NUMBER = r"\s*[-+]?[0-9]*{}[0-9]*(?:[eE][-+]?[0-9]+)?\s*"
_POINT, _COMMA = (re.compile(_NUMBER.format(re.escape(sign))) for sign in ".,")


_FORMULA = re.compile(r"[=@\t\r]|[+-](?!(?:[0-9]*[.,]?[0-9]*(?:[eE][-+]?[0-9]+)?|inf|nan)\s*\Z)")
"""Beginnings of a cell that a spreadsheet computes; a signed number is not meant."""


class TableError(ElastocalError, ValueError):
    """A table that cannot be read: quotes that do not match, a cell that is no number."""


@dataclass(frozen=True)
class Column:
    """A column of numbers."""

    index: int
    """Position in a row."""
    name: str
    unit: str
    """The unit as the header states it; empty for a plain number."""
    scale: float
    """The SI value of one such unit."""
    dimension: str = ""
    """Physical dimension, as `elastocal.units` names it; empty for a plain number."""

    @property
    def header(self) -> str:
        """The column as the file names it."""
        return f"{self.name}[{self.unit}]" if self.unit else self.name


@dataclass(frozen=True)
class TableLayout:
    """Format of a table, so that it can be written back in the same way."""

    header: tuple[str, ...] = ()
    """Name of each column; none where there is no header."""
    preamble: tuple[str, ...] = ()
    """Comment and blank lines above the header, with their line ends."""
    delimiter: str = DELIMITERS[0]
    line_end: str = "\n"


class PackedColumn(Collection[str]):
    """Texts of a column, thousands in one: each for itself takes ten times the memory."""

    def __init__(self) -> None:
        self._pieces: list[str | tuple[str, ...]] = []
        self._length = 0

    def append(self, cells: Sequence[str]) -> None:
        """Add some cells at the end."""
        packed = _BETWEEN.join(cells)
        alone = packed.count(_BETWEEN) == len(cells) - 1
        self._pieces.append(packed if alone else tuple(cells))
        self._length += len(cells)

    def pieces(self) -> Iterator[Sequence[str]]:
        """Yield the cells as they were added."""
        for piece in self._pieces:
            yield piece.split(_BETWEEN) if isinstance(piece, str) else piece

    def __iter__(self) -> Iterator[str]:
        """Yield the cells."""
        return chain.from_iterable(self.pieces())

    def __len__(self) -> int:
        """Return the number of cells."""
        return self._length

    def __contains__(self, cell: object) -> bool:
        """Return whether a cell is this text."""
        return any(each == cell for each in self)


def plain_numbers(cells: Sequence[object], comma: str = "") -> FloatArray | None:
    """Return the numbers of texts if all are finite; None: check each cell.

    ``comma`` states that the decimal sign is a comma.
    """
    try:
        text = _BETWEEN.join(cells)  # type: ignore[arg-type]
        # What `parse_number` takes for no number, Python would read.
        if "_" in text or not text.isascii():
            return None
        pointed = text.replace(comma, ".").split(_BETWEEN) if comma else cells
        values = np.array(pointed, dtype=float)
    except (TypeError, ValueError):
        return None
    return values if len(values) == len(cells) and np.isfinite(values).all() else None


@dataclass(frozen=True)
class TableRows:
    """Some consecutive rows of a table; those that are blank are left out."""

    cells: list[list[str]]
    """Cells as in the file."""
    lines: list[int]
    """Line of the file that each row ends on."""
    delimiter: str = DELIMITERS[0]

    @cached_property
    def decimal_comma(self) -> bool:
        """Whether numbers are written ``1,5``: no comma parts the cells, and no number has a point.

        Beside points a comma may part thousands.
        """
        if self.delimiter == ",":
            return False
        cells = [cell for row in self.cells for cell in row]
        return any(map(_COMMA.fullmatch, cells)) and not any(map(_POINT.fullmatch, cells))

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.cells)

    def uneven(self, width: int) -> tuple[int, int] | None:
        """Return line and number of cells of the first row that has not ``width``, if any."""
        for line, row in zip(self.lines, self.cells, strict=True):
            if len(row) != width:
                return line, len(row)
        return None

    def numbers(self, column: Column, parse: Callable[[str], float] | None = None) -> FloatArray:
        """Return the numbers of a column in SI units, shape (row,).

        Parameters
        ----------
        parse : callable, optional
            Reads a cell that is not an ordinary number; its `ValueError` says what the cell is.
            Finite numbers only by default.

        Raises
        ------
        TableError
            If a cell cannot be read; the message names row and column.
        """
        parse = _finite_number if parse is None else parse
        cells = [row[column.index] for row in self.cells]
        values = plain_numbers(cells)
        if values is None:
            # Rarely taken: some cell is blank or not a number, and its row must be found.
            comma = "," if self.decimal_comma else ""
            pairs = zip(self.lines, cells, strict=True)
            values = np.array([_parsed(cell, comma, line, column, parse) for line, cell in pairs])
        # x * 1.0 is x, bit for bit: data in SI units pass unchanged.
        return values * column.scale


class TableReader:
    """Reads a table from its lines, once.

    Parameters
    ----------
    lines : iterable of str
        Lines of a text with their line ends. The delimiter is the one that the header uses.

    Raises
    ------
    TableError
        If quotes in the header do not match.
    """

    layout: TableLayout

    def __init__(self, lines: Iterable[str]) -> None:
        remaining = iter(lines)
        preamble: list[str] = []
        first, above, most = "", 0, _MOST_ROW.most * _KILOBYTE
        for line in remaining:
            if line.strip() and not line.startswith("#"):
                first = line
                break
            preamble.append(line)
            above += len(line)
            if above > most:
                raise TableError(f"row {len(preamble)}: what stands above it {_MOST_ROW.exceeded}")
        self._above = len(preamble)
        csv.field_size_limit(_MOST_CELL.most * _KILOBYTE)
        self._delimiter = max(DELIMITERS, key=first.count)
        self._reader = csv.reader(chain([first], remaining), delimiter=self._delimiter, strict=True)
        line_end = first[len(first.rstrip("\r\n")) :] or "\n"
        header = tuple(map(plain_text, next(self._cells(), (0, []))[1])) if first else ()
        self.layout = TableLayout(header, tuple(preamble), self._delimiter, line_end)

    def rows(self) -> TableRows:
        """Return all rows that are left.

        Raises
        ------
        TableError
            If quotes do not match; the message names the row.
        """
        return self._taken(None)

    def pieces(self, size: int) -> Iterator[TableRows]:
        """Yield the rows up to ``size`` at a time, so that a table of any length fits into memory.

        Raises
        ------
        TableError
            If quotes do not match; the message names the row.
        """
        while piece := self._taken(size):
            yield piece

    def _taken(self, size: int | None) -> TableRows:
        numbered = ((n, row) for n, row in self._cells() if any(map(str.strip, row)))
        some = list(islice(numbered, size))
        return TableRows([row for _, row in some], [line for line, _ in some], self._delimiter)

    def _cells(self) -> Iterator[tuple[int, list[str]]]:
        try:
            for row in self._reader:
                yield self._above + self._reader.line_num, row
        except csv.Error as error:
            too_long = "field limit" in str(error)
            reason = f"a cell {_MOST_CELL.exceeded}" if too_long else str(error)
            raise TableError(f"row {self._above + self._reader.line_num}: {reason}") from error


def bounded_lines(file: TextIO) -> Iterator[str]:
    """Yield the lines of a file, none of which fills the memory.

    Raises
    ------
    TableError
        If one is too long.
    """
    most = _MOST_ROW.most * _KILOBYTE
    for number, line in enumerate(iter(partial(file.readline, most), ""), start=1):
        if len(line) == most:
            raise TableError(f"row {number} {_MOST_ROW.exceeded}")
        yield line


@contextmanager
def opened_table(path: Path) -> Iterator[TableReader]:
    """Yield the reader of a table file of any length.

    Raises
    ------
    TableError
        If quotes in the header do not match.
    FileAccessError
        If the file cannot be read, or is no text; also while rows are taken.
    """
    try:
        with readable(path), Path(path).open(encoding="utf-8-sig", newline="") as file:
            yield TableReader(bounded_lines(file))
    except UnicodeDecodeError as error:
        raise FileAccessError(
            f"cannot read {path}: not a UTF-8 text file (Excel saves one as CSV UTF-8)"
        ) from error


def number_in_cell(cell: str) -> float:
    """Return the number in a cell; it may be NaN or infinite.

    Raises
    ------
    ValueError
        Saying what the cell is.
    """
    try:
        return parse_number(cell)
    except ValueError:
        hint = " (the decimal sign is a point)" if "," in cell else ""
        raise ValueError(f"is not a number{hint}") from None


def _finite_number(cell: str) -> float:
    """Return the finite number in a cell.

    Raises
    ------
    ValueError
        Saying what the cell is.
    """
    value = number_in_cell(cell)
    if not math.isfinite(value):
        raise ValueError("is not a finite number")
    return value


def plain_text(cell: str) -> str:
    """Return the text of a cell without the apostrophe that keeps a spreadsheet from computing it.

    >>> plain_text("'=1+1"), plain_text("'quoted'")
    ('=1+1', "'quoted'")
    """
    return cell[1:] if cell[:1] == "'" and _FORMULA.match(cell, 1) else cell


def _inert(cell: object) -> object:
    """Return a cell that no spreadsheet takes for a formula; numbers stay what they are."""
    if isinstance(cell, str) and _FORMULA.match(cell):
        return f"'{cell}"
    return cell


def write_table(
    path: Path,
    header: Sequence[str],
    rows: Iterable[Sequence[object]],
    preamble: Sequence[str] = (),
) -> None:
    """Write a table, whole or not at all; rows are taken one by one.

    Floating-point numbers keep all their digits. An apostrophe goes before a text that a
    spreadsheet would compute (``=``, ``+``, ``-``, ``@``); `plain_text` takes it away.

    Parameters
    ----------
    path : Path
        The file.
    header : sequence of str
        Name of each column, with its unit.
    rows : iterable of sequence
        Cells: texts and numbers.
    preamble : sequence of str
        Lines above the header, with their line ends.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    with new_table(path, TableLayout(tuple(header), tuple(preamble))) as write:
        write(rows)


@contextmanager
def new_table(
    path: Path, layout: TableLayout
) -> Iterator[Callable[[Iterable[Sequence[object]]], None]]:
    """Yield what appends rows to a table, which takes its place when the block ends without error.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        file.writelines(layout.preamble)
        writer = csv.writer(file, delimiter=layout.delimiter, lineterminator=layout.line_end)
        writer.writerow(map(_inert, layout.header))
        yield lambda rows: writer.writerows(map(_inert, row) for row in rows)


def _parsed(
    cell: str, comma: str, line: int, column: Column, parse: Callable[[str], float]
) -> float:
    try:
        return parse(cell.replace(comma, ".") if comma else cell)
    except ValueError as error:
        raise TableError(f"row {line}, column {column.header!r}: {cell!r} {error}") from error
