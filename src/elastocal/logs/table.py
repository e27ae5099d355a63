"""Logs of other people's instruments, each read into one table of named columns.

Text files of any delimiter, with decimal points or commas, with a header (and a row of units under
it, as PolyWorks and data loggers have) or without one (columns are then called by their number,
from 1); SpatialAnalyzer's point lists (``//`` comments, ``Collection Group Target x y z``). They
are read line by line and kept packed. Workbooks and recordings of middleware are read by
`elastocal.logs.recordings`. The map (`elastocal.logs.map`) states the meaning of the columns.
"""

import codecs
import csv
import math
import re
from collections import Counter, deque
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, date, datetime
from functools import partial
from io import BytesIO, TextIOWrapper
from itertools import chain, islice
from pathlib import Path
from typing import BinaryIO

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import LogError, nearest
from elastocal.files import Limit, readable, require_size
from elastocal.results import brief_repr
from elastocal.tables import PackedColumn, TableError, bounded_lines, plain_numbers
from elastocal.units import parse_number

_MOST_TEXT = Limit("ELASTOCAL_MAX_TEXT_LOG_MB", 256, "MB")
"""Two hours of twelve columns at 250 Hz."""
_MOST_COLUMNS = Limit("ELASTOCAL_MAX_LOG_COLUMNS", 10_000, "columns")
_CELLS_AT_A_TIME = 200_000
_COMMENTS = ("#", "//", "%", "!")
_DELIMITERS = ";\t,|"
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+(?:[eE][-+]?\d+)?", re.ASCII)
_DAY_FIRST = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})(?!\d)", re.ASCII)
_YEAR_FIRST = re.compile(r"^(\d{4})/(\d\d)/(\d\d)", re.ASCII)
"""Dates that are read alike everywhere, unlike 11/12/2026."""
_SLASHED = re.compile(r"(\d{1,2})/(\d{1,2})/(\d{4})(?!\d)", re.ASCII)
_DATED = re.compile(r"\s*(?:\d{4}[-/]\d\d[-/]\d\d|\d{1,2}([./])\d{1,2}\1\d{4})[ T]+\d.*", re.ASCII)
_HOUR = re.compile(r"(?i)(?<!\d)(\d{1,2})(:\d\d:\d\d(?:[.,]\d+)?)(?:\s*([ap])m)?$", re.ASCII)
_NUMBER = re.compile(r"\s*[-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?\s*", re.ASCII)
_UNIT = re.compile(
    r"[\[(]?\s*(?:mm|m|[uµ]m|in|s|sec|ms|us|deg|°|rad|k?N|N[*·]?m|N[*·]?mm|°C|mbar|hPa|%)\s*[\])]?"
)
_NOT_FINITE = ("", "nan", "-", "n/a", "null", "none", "-nan", "inf", "-inf")
_CLOCK = re.compile(r"(\d{1,2}):(\d{2}):(\d{2}(?:[.,]\d+)?)", re.ASCII)
_MEGABYTE = 1_000_000
_OLD_CODE_PAGE = "cp1252"
_LOOKED_AT = 200
"""Number of lines from which the form of a text is determined."""


@brief_repr
@dataclass(frozen=True, eq=False)
class LogTable:
    """A log: its columns as in the file."""

    name: str
    """File, and the topic of a recording, for messages."""
    header: tuple[str, ...]
    """Name of each column; ``1``, ``2`` … where the file names none."""
    cells: tuple[Collection[object], ...]
    """Cells of each column: texts, numbers, times."""
    decimal_comma: bool = False
    """Whether numbers in texts have one."""
    above: str = ""
    """The first lines that a program wrote above the header: units, scales."""

    @classmethod
    def from_rows(cls, name: str, rows: Sequence[Sequence[object]]) -> "LogTable":
        """Return rows as a table; the first holds the names, unless it holds data.

        Raises
        ------
        LogError
            If there are none.
        """
        rows = [row for row in rows if any(cell is not None for cell in row)]
        if not rows:
            raise LogError(f"{name}: there are no rows in it")
        head = [_as_text(cell) for cell in rows[0]]
        names = _named([""] * len(head) if _is_data(head) else head)
        body = rows if _is_data(head) else rows[1:]
        return cls(name, names, tuple(zip(*body, strict=True)) or ((),) * len(head))

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.cells[0]) if self.cells else 0

    def column(self, name: str) -> Collection[object]:
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

        Dates with a time of day (ISO 8601, ``27.11.2026``, ``2026/11/27`` or ``11/27/2026``) count
        from 1970 UTC, times of day from midnight and go on beyond 24 h when midnight passes. Of
        two numbers between slashes the first is the month, unless the day first lets the log be
        of dates, or shorter.

        Raises
        ------
        LogError
            If there is no such column, or a cell is no time.
        """
        problem = "is no date and time, no time of day and no number"
        first = next((c.strip() for c in self.column(name) if isinstance(c, str) and c.strip()), "")
        if _SLASHED.match(first):
            return self._slashed(name, f"{problem} (dates: 2026-11-27, 27.11.2026 or 11/27/2026)")
        times = self._read(name, self._time, problem)
        if any(isinstance(c, str) and _CLOCK.fullmatch(c.strip()) for c in self.column(name)):
            times = times + 86400.0 * np.cumsum(np.diff(times, prepend=times[:1]) < -43200.0)
        return times

    def _slashed(self, name: str, problem: str) -> FloatArray:
        """Return the times of dates whose first number is the month or the day."""
        try:
            american = self._read(name, self._time, problem)
        except LogError:
            american = None
        try:
            other = self._read(name, partial(self._time, day_first=True), problem)
        except LogError:
            if american is None:
                raise
            return american
        return other if american is None or np.ptp(other) < np.ptp(american) else american

    def texts(self, name: str) -> tuple[str, ...]:
        """Return the cells of a column as texts without blanks around them, shape (row,)."""
        # Most words occur in many rows: each is kept once.
        known: dict[str, str] = {}
        return tuple(known.setdefault(t, t) for t in map(_as_text, self.column(name)))

    def _read(self, name: str, parse: Callable[[object], float], problem: str) -> FloatArray:
        cells = self.column(name)
        if isinstance(cells, np.ndarray):
            return np.asarray(cells, dtype=float)
        comma, values, row = "," if self.decimal_comma else "", np.empty(len(cells)), 0
        for piece in cells.pieces() if isinstance(cells, PackedColumn) else [[*cells]]:
            if (plain := plain_numbers(piece, comma)) is not None:
                values[row : row + len(piece)] = plain
                row += len(piece)
                continue
            for cell in piece:
                try:
                    values[row] = parse(cell)
                except (ValueError, TypeError, OverflowError) as error:
                    raise LogError(
                        f"{self.name}: row {row + 1} of the data, column {name!r}: {cell!r}"
                        f" {problem}"
                    ) from error
                row += 1
        return values

    def _number(self, cell: object) -> float:
        if isinstance(cell, str):
            text = cell.strip()
            if text.lower() in _NOT_FINITE:
                return math.nan
            if not _NUMBER.fullmatch(text):
                raise ValueError(text)
            return parse_number(text.replace(",", ".") if self.decimal_comma else text)
        return math.nan if cell is None else float(cell)  # type: ignore[arg-type]

    def _time(self, cell: object, *, day_first: bool = False) -> float:
        if isinstance(cell, datetime):
            return (cell if cell.tzinfo else cell.replace(tzinfo=UTC)).timestamp()
        text = _HOUR.sub(_of_a_day, cell.strip()) if isinstance(cell, str) else ""
        if clock := _CLOCK.fullmatch(text):
            hours, minutes, seconds = clock.groups()
            return 3600.0 * int(hours) + 60.0 * int(minutes) + float(seconds.replace(",", "."))
        if text and not _NUMBER.fullmatch(text):
            found = datetime.fromisoformat(_as_iso(text.replace(",", "."), day_first))
            return (found if found.tzinfo else found.replace(tzinfo=UTC)).timestamp()
        return self._number(cell)


def _of_a_day(clock: re.Match[str]) -> str:
    """Return a time of day with two digits of the hour, from 0 to 23.

    >>> _HOUR.sub(_of_a_day, "9:41:38.4"), _HOUR.sub(_of_a_day, "12:41:38 am")
    ('09:41:38.4', '00:41:38')
    """
    hour, rest, half = clock.groups()
    if half is None:
        return f"{hour:0>2}{rest}"
    return f"{int(hour) % 12 + 12 * (half in 'pP'):02d}{rest}"


def _as_iso(text: str, day_first: bool = False) -> str:
    """Return a date as ISO 8601 writes it, whatever it is written like.

    >>> _as_iso("27.11.2026 09:41:38.4"), _as_iso("2026/11/27 09:41:38")
    ('2026-11-27 09:41:38.4', '2026-11-27 09:41:38')
    >>> _as_iso("11/12/2026 09:41:38"), _as_iso("11/12/2026 09:41:38", day_first=True)
    ('2026-11-12 09:41:38', '2026-12-11 09:41:38')
    """
    if match := _DAY_FIRST.match(text) or _SLASHED.match(text):
        day, month, year = match.groups()
        if "/" in match[0] and not day_first:
            day, month = month, day
        return f"{year}-{month:0>2}-{day:0>2}{text[match.end() :]}"
    return _YEAR_FIRST.sub(r"\1-\2-\3", text, count=1)


def read_text_log(path: Path) -> LogTable:
    """Return a text file as a table.

    Raises
    ------
    LogError
        If it has no rows of equal length, or quotes that do not match.
    FileAccessError
        If it cannot be read.
    SchemaError
        If it is too large.
    """
    text = _LogText.of(path)
    some = list(islice(text.lines(), _LOOKED_AT))
    if not some:
        raise LogError(f"{path}: there are no rows in it")
    delimiter = _delimiter(some)
    width, start = _Body.read(text.rows(some, delimiter), 0).usual_width, None
    while True:
        body = _Body.read(text.rows(text.lines(), delimiter), width, start)
        if width == body.usual_width and body.start is not None:
            break
        # Rarely: later rows have another width, or none holds a number.
        width, start = body.usual_width, 1 if width == body.usual_width else None
    if body.uneven is not None:
        row, count = body.uneven
        raise LogError(
            f"{path}: row {row + 1} of the data has {count} cells, the others {width}: is the file"
            " cut off, or a text unquoted?"
        )
    # Lines of another program may precede the header, which is directly above the data.
    header = _header(body.above, width) or _named([""] * width)
    first = chain.from_iterable(islice(column, _LOOKED_AT) for column in body.columns)
    comma = delimiter != "," and any(_DECIMAL_COMMA.fullmatch(cell.strip()) for cell in first)
    above = some[: max(body.start or 0, 1) - 1]
    return LogTable(str(path), header, body.columns, comma, "\n".join(above))


@dataclass
class _Body:
    """The rows of a text, packed by columns if they have the width that was expected."""

    width: int
    start: int | None
    """The row where the data begin; None: nowhere."""
    columns: tuple[PackedColumn, ...]
    widths: Counter[int] = field(default_factory=Counter)
    above: deque[list[str]] = field(default_factory=lambda: deque(maxlen=2))
    """The last rows above the data."""
    uneven: tuple[int, int] | None = None
    """The first row of another width, counted from 0 in the data, and its cells."""

    @property
    def usual_width(self) -> int:
        """The width of most rows."""
        return self.widths.most_common(1)[0][0]

    @classmethod
    def read(cls, rows: Iterator[list[str]], width: int, start: int | None = None) -> "_Body":
        """Take all rows; those without ``start`` begin with the first of numbers or times."""
        body = cls(width, start, tuple(PackedColumn() for _ in range(width)))
        for number, row in enumerate(rows):
            if start is None and len(row) == width and _is_data(row):
                body.start = number
            if number == body.start:
                body._take_data(chain([row], rows))
                break
            body.widths[len(row)] += 1
            body.above.append(row)
        return body

    def _take_data(self, rows: Iterator[list[str]]) -> None:
        at, size = 0, _CELLS_AT_A_TIME // self.width + 1
        while some := list(islice(rows, size)):
            widths = [len(row) for row in some]
            self.widths.update(widths)
            whole = some
            if widths.count(self.width) != len(some):
                first = next(n for n, width in enumerate(widths) if width != self.width)
                self.uneven = self.uneven or (at + first, widths[first])
                whole = [row for row in some if len(row) == self.width]
            for column, cells in zip(self.columns, zip(*whole, strict=True), strict=False):
                column.append(cells)
            at += len(some)


@dataclass(frozen=True)
class _LogText:
    """A text in UTF-8, UTF-16 with its mark, or a code page of Windows."""

    path: Path
    opened: Callable[[], BinaryIO]
    """Return the delimiter of a text; empty where blanks separate the cells."""
    encoding: str

    @classmethod
    def of(cls, path: Path) -> "_LogText":
        with readable(path):
            require_size(path, _MOST_TEXT)
            piped = None if path.is_file() or path.is_dir() else path.read_bytes()

            def opened() -> BinaryIO:
                return path.open("rb") if piped is None else BytesIO(piped)

            with opened() as file:
                return cls(path, opened, _encoding(path, file))

    def lines(self) -> Iterator[str]:
        """Return whether every comma of a text is within a number between blanks."""
        errors = "replace" if self.encoding == _OLD_CODE_PAGE else "strict"
        try:
            with (
                readable(self.path),
                TextIOWrapper(self.opened(), self.encoding, errors) as file,
            ):
                for whole in bounded_lines(file):
                    for line in whole.splitlines():
                        text = line.strip()
                        if text and not text.startswith(_COMMENTS):
                            yield line
        except TableError as error:
            raise LogError(f"{self.path}: {error}") from error
        except UnicodeDecodeError as error:
            raise LogError(f"{self.path} has changed while it was read") from error

    def rows(self, lines: Iterable[str], delimiter: str) -> Iterator[list[str]]:
        """Yield the cells of each line."""
        cut = csv.reader(lines, delimiter=delimiter) if delimiter else map(_split, lines)
        most = _MOST_COLUMNS.most
        try:
            for row in cut:
                if len(row) > most:
                    raise LogError(f"{self.path}: {len(row)} cells {_MOST_COLUMNS.exceeded}")
                yield row
        except csv.Error as error:
            raise LogError(f"{self.path}: {error}") from error


def _encoding(path: Path, file: BinaryIO) -> str:
    begin = file.read(4096)
    marked = begin[:2] in (b"\xff\xfe", b"\xfe\xff")
    if b"\0" in begin and not marked:
        raise LogError(f"{path} is no text: logs are CSV or text, Excel, MCAP or ROS bags")
    encoding = "utf-16" if marked else "utf-8-sig"
    decoder = codecs.getincrementaldecoder(encoding)()
    try:
        for piece in chain([begin], iter(partial(file.read, _MEGABYTE), b"")):
            decoder.decode(piece)
        decoder.decode(b"", final=True)
    except UnicodeDecodeError:
        return _OLD_CODE_PAGE
    return encoding


def _delimiter(lines: Sequence[str]) -> str:
    """Return the delimiter of a text; empty if blanks separate the cells."""
    for delimiter in _DELIMITERS:
        counts = Counter(line.count(delimiter) for line in lines)
        most, times = counts.most_common(1)[0]
        if most and times >= 0.6 * len(lines) and not _all_decimal(lines, delimiter):
            return delimiter
    return ""


def _all_decimal(lines: Sequence[str], delimiter: str) -> bool:
    """Return whether every comma of a text is within a number between blanks."""
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
    times = (_NUMBER, _CLOCK, _DATED)
    return 2 * sum(any(each.fullmatch(c.strip()) for each in times) for c in row) >= len(row)


def _header(above: Sequence[Sequence[str]], width: int) -> tuple[str, ...] | None:
    """Return the names of the columns by the rows above the data; None where there are none.

    A row of units may be between names and data: the names then end in them, as ``X [mm]``.
    """
    if not above or len(above[-1]) != width:
        return None
    if len(above) > 1 and len(above[-2]) == width and _are_units(above[-1]):
        units = [cell.strip().strip("[]()").strip() for cell in above[-1]]
        names = _named(above[-2])
        return tuple(f"{n} [{u}]" if u else n for n, u in zip(names, units, strict=True))
    return _named(above[-1])


def _are_units(row: Sequence[str]) -> bool:
    cells = [cell for cell in row if cell.strip()]
    return len(cells) > 1 and all(_UNIT.fullmatch(cell.strip()) for cell in cells)


def _named(row: Sequence[str]) -> tuple[str, ...]:
    """Return the names of columns; those without one have their number."""
    return tuple(cell.strip() or str(number) for number, cell in enumerate(row, 1))


def _as_text(cell: object) -> str:
    if cell is None:
        return ""
    if isinstance(cell, float | np.floating) and float(cell).is_integer():
        return str(int(cell))
    return cell.isoformat() if isinstance(cell, datetime | date) else str(cell).strip()
