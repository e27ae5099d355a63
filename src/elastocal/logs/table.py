"""Logs of other people's instruments, each read into one table of named columns.

Text files of any delimiter, with decimal points or commas, with a header (and a row of units under
it, as PolyWorks and data loggers have) or without one (columns are then called by their number,
from 1); SpatialAnalyzer's point lists (``//`` comments,
``Collection Group Target x y z``); Excel workbooks. Recordings of middleware are read by
`elastocal.logs.bags`. What a column means is for the map (`elastocal.logs.map`) to say.
"""

import csv
import math
import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime
from functools import partial
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import FileAccessError, LogError, nearest
from elastocal.files import Limit, read_bytes
from elastocal.logs.bounded import read_bounded
from elastocal.results import brief_repr
from elastocal.units import parse_number

_MOST_TEXT = Limit("ELASTOCAL_MAX_TEXT_LOG_MB", 256, "MB")
"""Two hours of twelve columns at 250 Hz; to read it takes twelve times as much memory."""
_COMMENTS = ("#", "//", "%", "!")
_DELIMITERS = ";\t,|"
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+(?:[eE][-+]?\d+)?", re.ASCII)
_NUMBER = re.compile(r"\s*[-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?\s*", re.ASCII)
_UNIT = re.compile(
    r"[\[(]?\s*(?:mm|m|[uµ]m|in|s|sec|ms|us|deg|°|rad|k?N|N[*·]?m|N[*·]?mm|°C|mbar|hPa|%)\s*[\])]?"
)
_CLOCK = re.compile(r"(\d{1,2}):(\d{2}):(\d{2}(?:[.,]\d+)?)", re.ASCII)
_LOOKED_AT = 200
"""Lines by which the form of a text is told."""


@brief_repr
@dataclass(frozen=True, eq=False)
class LogTable:
    """A log: its columns as they stand in the file."""

    name: str
    """File, and the topic of a recording, for messages."""
    header: tuple[str, ...]
    """Name of each column; ``1``, ``2`` … where the file names none."""
    cells: tuple[Sequence[object], ...]
    """Cells of each column: texts, numbers, times."""
    decimal_comma: bool = False
    """Whether numbers in texts have one."""
    above: str = ""
    """Lines that a program wrote above the header: units, scales."""

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.cells[0]) if self.cells else 0

    def column(self, name: str) -> Sequence[object]:
        """Return the cells of a column, named by its header or by its number from 1.

        Raises
        ------
        LogError
            If there is none, or two have that name.
        """
        found = [index for index, each in enumerate(self.header) if each == name]
        if not found and name.isascii() and name.isdigit() and 1 <= int(name) <= len(self.header):
            found = [int(name) - 1]
        if len(found) != 1:
            raise LogError(
                f"{self.name}: column {name!r} is there twice: name it by its number"
                if found
                else f"{self.name}: there is no column {name!r}{nearest(name, self.header)}"
                f" (columns: {', '.join(self.header)})"
            )
        return self.cells[found[0]]

    def numbers(self, name: str) -> FloatArray:
        """Return the numbers of a column, shape (row,); NaN where a cell is empty.

        Raises
        ------
        LogError
            If there is no such column, or a cell is no number; the message names its row.
        """
        return self._read(name, self._number, "is not a number")

    def seconds(self, name: str) -> FloatArray:
        """Return the times of a column without unit, shape (row,), in s.

        Dates with a time of day (ISO 8601) count from 1970 UTC, times of day from midnight and go
        on beyond 24 h when midnight passes.

        Raises
        ------
        LogError
            If there is no such column, or a cell is no time.
        """
        times = self._read(name, self._time, "is no date and time, no time of day and no number")
        clock = any(isinstance(c, str) and _CLOCK.fullmatch(c.strip()) for c in self.column(name))
        if clock:
            times = times + 86400.0 * np.cumsum(np.diff(times, prepend=times[:1]) < -43200.0)
        return times

    def texts(self, name: str) -> tuple[str, ...]:
        """Return the cells of a column as texts without blanks around them, shape (row,)."""
        return tuple(_as_text(cell) for cell in self.column(name))

    def _read(self, name: str, parse: Callable[[object], float], problem: str) -> FloatArray:
        cells = self.column(name)
        if isinstance(cells, np.ndarray):
            return np.asarray(cells, dtype=float)
        if (plain := self._plain(cells)) is not None:
            return plain
        values = np.empty(len(cells))
        for row, cell in enumerate(cells):
            try:
                values[row] = parse(cell)
            except (ValueError, TypeError, OverflowError) as error:
                raise LogError(
                    f"{self.name}: row {row + 1} of the data, column {name!r}: {cell!r} {problem}"
                ) from error
        return values

    def _plain(self, cells: Sequence[object]) -> FloatArray | None:
        """Return the numbers of a column of nothing but finite ones; None: look at each cell."""
        if not all(type(cell) is str for cell in cells):
            return None
        text = "\n".join(cells)  # type: ignore[arg-type]
        # What `parse_number` takes for no number, numpy would read.
        if "_" in text or not text.isascii():
            return None
        if self.decimal_comma:
            text = text.replace(",", ".")
        try:
            values = np.array(text.split("\n"), dtype=float)
        except ValueError:
            return None
        return values if np.isfinite(values).all() else None

    def _number(self, cell: object) -> float:
        if isinstance(cell, str):
            text = cell.strip()
            if not text:
                return math.nan
            if not _NUMBER.fullmatch(text):
                return _not_finite(text)
            return parse_number(text.replace(",", ".") if self.decimal_comma else text)
        return math.nan if cell is None else float(cell)  # type: ignore[arg-type]

    def _time(self, cell: object) -> float:
        if isinstance(cell, datetime):
            return (cell if cell.tzinfo else cell.replace(tzinfo=UTC)).timestamp()
        text = cell.strip() if isinstance(cell, str) else ""
        if clock := _CLOCK.fullmatch(text):
            hours, minutes, seconds = clock.groups()
            return 3600.0 * int(hours) + 60.0 * int(minutes) + float(seconds.replace(",", "."))
        if text and not _NUMBER.fullmatch(text):
            found = datetime.fromisoformat(text.replace(",", "."))
            return (found if found.tzinfo else found.replace(tzinfo=UTC)).timestamp()
        return self._number(cell)


def read_text_log(path: Path) -> LogTable:
    """Return a text file as a table.

    Raises
    ------
    LogError
        If it has no rows of equal length, or quotes that do not match.
    FileAccessError
        If it cannot be read.
    SchemaError
        If it is too large to be read whole.
    """
    lines = [
        line for line in _text(path).splitlines() if line.strip() and not _is_comment(line.strip())
    ]
    if not lines:
        raise LogError(f"{path}: there are no rows in it")
    delimiter = _delimiter(lines)
    try:
        rows = list(csv.reader(lines, delimiter=delimiter)) if delimiter else [*map(_split, lines)]
    except csv.Error as error:
        raise LogError(f"{path}: {error}") from error
    width = Counter(len(row) for row in rows).most_common(1)[0][0]
    first = next(
        (index for index, row in enumerate(rows) if len(row) == width and _is_data(row)), 1
    )
    # Lines of another program stand above the header, which stands right above the data.
    header = _header(rows[:first], width)
    body = rows[first:]
    uneven = next((n for n, row in enumerate(body) if len(row) != width), None)
    if uneven is not None:
        raise LogError(
            f"{path}: row {uneven + 1} of the data has {len(body[uneven])} cells, the others"
            f" {width}: is the file cut off, or a text unquoted?"
        )
    cells = tuple(zip(*body, strict=True)) or ((),) * width
    comma = delimiter != "," and any(
        _DECIMAL_COMMA.fullmatch(cell.strip()) for row in body[:_LOOKED_AT] for cell in row
    )
    above = "\n".join(lines[: max(first - 1, 0)])
    return LogTable(str(path), header or _numbered(width), cells, comma, above)


def read_workbook(path: Path, sheet: str | None = None) -> LogTable:
    """Return a sheet of an Excel workbook as a table, by default the first.

    Raises
    ------
    LogError
        If it is no workbook, has no such sheet, or the sheet is empty.
    FileAccessError
        If it cannot be read, or openpyxl is not installed.
    """
    try:
        import openpyxl  # noqa: F401 - here, or the child would do it anew
    except ImportError as error:
        raise FileAccessError(
            f"cannot read {path}: Excel needs openpyxl: pip install 'elastocal[logs]'"
        ) from error
    return read_bounded(path, "Excel workbook", partial(_sheet, path, sheet))


def _sheet(path: Path, sheet: str | None) -> LogTable:
    from openpyxl import load_workbook

    book = load_workbook(path, read_only=True, data_only=True)
    try:
        if sheet is not None and sheet not in book.sheetnames:
            raise LogError(f"{path}: there is no sheet {sheet!r} ({', '.join(book.sheetnames)})")
        rows = list(book[sheet or book.sheetnames[0]].iter_rows(values_only=True))
    finally:
        book.close()
    rows = [row for row in rows if any(cell is not None for cell in row)]
    if not rows:
        raise LogError(f"{path}: there are no rows in it")
    head = [_as_text(cell) for cell in rows[0]]
    names = _numbered(len(head)) if _is_data(head) else tuple(_named(head))
    body = rows if _is_data(head) else rows[1:]
    return LogTable(str(path), names, tuple(zip(*body, strict=True)) or ((),) * len(head))


def _text(path: Path) -> str:
    """Return the text of a file in UTF-8, UTF-16 with its mark, or a code page of Windows."""
    data = read_bytes(path, _MOST_TEXT)
    if b"\0" in data[:4096] and data[:2] not in (b"\xff\xfe", b"\xfe\xff"):
        raise LogError(f"{path} is no text: logs are CSV or text, Excel, MCAP or ROS bags")
    encoding = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        return data.decode(encoding)
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")


def _is_comment(line: str) -> bool:
    return line.startswith(_COMMENTS)


def _delimiter(lines: Sequence[str]) -> str:
    """Return the delimiter of a text; empty where blanks stand between the cells."""
    some = lines[:_LOOKED_AT]
    for delimiter in _DELIMITERS:
        counts = Counter(line.count(delimiter) for line in some)
        most, times = counts.most_common(1)[0]
        if most and times >= 0.6 * len(some) and not _all_decimal(some, delimiter):
            return delimiter
    return ""


def _all_decimal(lines: Sequence[str], delimiter: str) -> bool:
    """Return whether every comma of a text stands within a number between blanks."""
    if delimiter != ",":
        return False
    rows = [line.split() for line in lines if "," in line]
    return all(len(row) > 1 for row in rows) and all(
        _DECIMAL_COMMA.fullmatch(word) for row in rows for word in row if "," in word
    )


def _split(line: str) -> list[str]:
    """Return the cells of a line between blanks; quoted texts hold together."""
    return [first or second for first, second in re.findall(r'"([^"]*)"|(\S+)', line)]


def _is_data(row: Sequence[str]) -> bool:
    """Return whether half of the cells of a row are numbers or times."""
    return 2 * sum(bool(_NUMBER.fullmatch(c) or _CLOCK.fullmatch(c.strip())) for c in row) >= len(
        row
    )


def _header(above: Sequence[Sequence[str]], width: int) -> tuple[str, ...] | None:
    """Return the names of the columns by the rows above the data; None where there are none.

    A row of units may stand between names and data: the names then end in them, as ``X [mm]``.
    """
    if not above or len(above[-1]) != width:
        return None
    if len(above) > 1 and len(above[-2]) == width and _are_units(above[-1]):
        units = [cell.strip().strip("[]()").strip() for cell in above[-1]]
        names = _named(above[-2])
        return tuple(f"{n} [{u}]" if u else n for n, u in zip(names, units, strict=True))
    return tuple(_named(above[-1]))


def _are_units(row: Sequence[str]) -> bool:
    cells = [cell for cell in row if cell.strip()]
    return len(cells) > 1 and all(_UNIT.fullmatch(cell.strip()) for cell in cells)


def _numbered(width: int) -> tuple[str, ...]:
    """Return the names of columns without any: their numbers."""
    return tuple(str(number) for number in range(1, width + 1))


def _named(row: Sequence[str]) -> list[str]:
    return [cell.strip() or str(number) for number, cell in enumerate(row, 1)]


def _as_text(cell: object) -> str:
    if cell is None:
        return ""
    if isinstance(cell, float | np.floating) and float(cell).is_integer():
        return str(int(cell))
    return cell.isoformat() if isinstance(cell, datetime | date) else str(cell).strip()


def _not_finite(text: str) -> float:
    if text.lower() in ("nan", "-", "n/a", "null", "none", "-nan", "inf", "-inf"):
        return math.nan
    raise ValueError(text)
