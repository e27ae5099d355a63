"""The lines of a stream: a header that names columns and units, points, beam, frame, fault.

Example::

    t[s],x[mm],y[mm],z[mm],sigma[mm]
    frame 2026-11-22T08:00 setup 3
    12.345,2412.071,-310.442,1203.118,0.012
    beam broken
    beam locked

A line beginning with ``#`` is a comment, unless what follows is a header. Cells stand between
commas, semicolons, tabs or blanks; between others than commas a number may have a decimal comma.
"""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.errors import DeviceError, UnitError
from elastocal.results import brief_repr
from elastocal.units import factor

LONGEST_LINE = 1024
"""In bytes; a point has about a hundred."""
_LENGTHS = ("x", "y", "z", "sigma", "sigma_x", "sigma_y", "sigma_z", "u95")
_TURNS = ("qx", "qy", "qz", "qw")
_NAMES = ("t", *_LENGTHS, *_TURNS, "station")
_COLUMN = re.compile(r"\s*([A-Za-z_0-9]+)\s*(?:\[\s*([^\]]*?)\s*\])?\s*")
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_NO_NUMBER = frozenset({"", "nan", "-", "null"})
_SEPARATORS = (";", "\t", ",", None)
"""None: blanks."""
_ABOUT_ONE = 0.02
"""How far the length of a quaternion may be from 1."""


@dataclass(frozen=True)
class Column:
    """One column of the points."""

    name: str
    unit: str | None
    """Of time and lengths."""

    @property
    def scale(self) -> float:
        """SI over the column's unit."""
        if self.unit is None:
            return 1.0
        return factor(self.unit, "time" if self.name == "t" else "length")


@brief_repr
@dataclass(frozen=True, eq=False)
class MarkerPoint:
    """A marker as a line has it."""

    position: FloatArray
    """Shape (3,), in m."""
    sigma: FloatArray
    """Shape (3,), in m; NaN where it is not known."""
    stamp: float | None
    """In s of the adapter's clock."""
    R: FloatArray | None
    """Orientation of a 6D marker, shape (3, 3)."""
    station: str | None


@dataclass(frozen=True)
class BeamLine:
    """The beam of a station, of the only one where none is named."""

    locked: bool
    station: str | None


@dataclass(frozen=True)
class FrameLine:
    """A name of the frame that points are in; another one than before is another frame."""

    name: str


@dataclass(frozen=True)
class AdapterFault:
    """A fault that the adapter tells in words."""

    text: str


Event = MarkerPoint | BeamLine | FrameLine | AdapterFault


def columns_of(texts: Sequence[str]) -> tuple[Column, ...]:
    """Return columns by texts such as ``x[mm]``.

    Raises
    ------
    DeviceError
        If a name or unit is not known, a unit or a coordinate is missing, a name stands twice.
    """
    columns = tuple(map(_column, texts))
    names = [column.name for column in columns]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise DeviceError(f"column {twice!r} of the stream is there twice")
    for group in (("x", "y", "z"), _TURNS, ("sigma_x", "sigma_y", "sigma_z")):
        missing = [name for name in group if name not in names]
        if missing and (group[0] == "x" or len(missing) < len(group)):
            raise DeviceError(f"the stream has no column {', '.join(missing)}")
    if sum(name in names for name in ("sigma", "sigma_x", "u95")) > 1:
        raise DeviceError("the stream states its uncertainty twice: sigma, sigma_x or u95, one")
    return columns


def _column(text: str) -> Column:
    match = _COLUMN.fullmatch(text)
    name = match.group(1).lower() if match else text
    if match is None or name not in _NAMES:
        raise DeviceError(f"column {text!r} of the stream is none of {', '.join(_NAMES)}")
    unit = match.group(2)
    if name in _TURNS or name == "station":
        return Column(name, None)
    if not unit:
        raise DeviceError(f"column {name!r} of the stream has no unit: {name}[mm], t[s]")
    try:
        return _checked(Column(name, unit))
    except UnitError as error:
        raise DeviceError(f"column {text!r} of the stream: {error}") from error


def _checked(column: Column) -> Column:
    if not column.scale > 0.0:
        raise UnitError(f"its unit scales by {column.scale:g}: must be above 0")
    return column


class LineReader:
    """Turns the bytes of a stream into events; keeps no more than one line.

    Parameters
    ----------
    columns : tuple of Column, optional
        Those of a stream without a header.
    """

    def __init__(self, columns: tuple[Column, ...] = ()) -> None:
        self._columns = columns
        self._rest = b""

    @property
    def columns(self) -> tuple[Column, ...]:
        """The columns; empty before the header has come."""
        return self._columns

    def feed(self, data: bytes) -> Iterator[Event]:
        """Yield the events of the lines that are whole now.

        Raises
        ------
        DeviceError
            If a line is none of a stream's, or too long.
        """
        lines = (self._rest + data).split(b"\n")
        self._rest = lines.pop()
        for line in lines:
            yield from self.line(line)
        if len(self._rest) > LONGEST_LINE:
            self._rest = b""
            raise DeviceError(f"a line of the stream is longer than {LONGEST_LINE} bytes")

    def line(self, raw: bytes) -> Iterator[Event]:
        """Yield the event of one line, if it has one.

        Raises
        ------
        DeviceError
            As `feed`.
        """
        if len(raw) > LONGEST_LINE:
            raise DeviceError(f"a line of the stream is longer than {LONGEST_LINE} bytes")
        text = raw.decode("utf-8", errors="replace").strip("\ufeff\r\n\t ")
        bare = text.lstrip("#").strip()
        if not bare:
            return
        is_comment = text.startswith("#")
        if _is_header(bare) and ("[" in bare or not is_comment):
            self._columns = columns_of(_cells(bare))
            return
        if is_comment:
            return
        word, _, more = text.replace(",", " ").partition(" ")
        if word == "beam":
            yield _beam(text, more.split())
        elif word == "frame":
            yield FrameLine(more.strip())
        elif word == "error":
            yield AdapterFault(text.partition(" ")[2].strip() or "error")
        else:
            yield from self._point(text)

    def _point(self, text: str) -> Iterator[Event]:
        if not self._columns:
            raise DeviceError(
                f"the stream begins with {_shown(text)}, without a header that names columns and"
                " units, as t[s],x[mm],y[mm],z[mm]; nor does the cell file (key 'columns')"
            )
        # A comma may be decimal: the number of cells tells which mark stands between them.
        count = len(self._columns)
        cells = next((c for c in map(text.split, _SEPARATORS) if len(c) == count), _cells(text))
        if len(cells) != count:
            raise DeviceError(f"{_shown(text)} has {len(cells)} cells, the stream {count} columns")
        cells = [cell.strip() for cell in cells]
        found = dict(zip((column.name for column in self._columns), cells, strict=True))
        station = found.get("station")
        values = {
            column.name: _number(cell, text) * column.scale
            for column, cell in zip(self._columns, cells, strict=True)
            if column.name != "station"
        }
        position = np.array([values[name] for name in "xyz"])
        # A marker without a place is one that is not seen, as many programs write it.
        if not np.isfinite(position).all():
            yield BeamLine(False, station)
            return
        yield MarkerPoint(position, _sigma(values), _stamp(values, text), _turn(values), station)


def _is_header(text: str) -> bool:
    """Return whether a line begins as a header does: with the name of a known column."""
    match = _COLUMN.fullmatch(_cells(text)[0])
    return match is not None and match.group(1).lower() in _NAMES


def _cells(text: str) -> list[str]:
    separator = next((each for each in _SEPARATORS if each and each in text), None)
    return [cell.strip() for cell in text.split(separator)]


def _number(cell: str, line: str) -> float:
    if cell.lower() in _NO_NUMBER:
        return math.nan
    text = cell.replace(",", ".")
    if not _NUMBER.fullmatch(text):
        raise DeviceError(f"{_shown(cell)} in {_shown(line)} is no number")
    return float(text)


def _beam(text: str, words: Sequence[str]) -> BeamLine:
    if not words or words[0] not in ("broken", "locked") or len(words) > 2:
        raise DeviceError(f"{_shown(text)}: the beam is broken or locked, then a station")
    return BeamLine(words[0] == "locked", words[1] if len(words) > 1 else None)


def _stamp(values: dict[str, float], line: str) -> float | None:
    stamp = values.get("t")
    if stamp is not None and not math.isfinite(stamp):
        raise DeviceError(f"{_shown(line)} has no time")
    return stamp


def _sigma(values: dict[str, float]) -> FloatArray:
    if "sigma_x" in values:
        return np.array([values[f"sigma_{axis}"] for axis in "xyz"])
    # U95 is twice the standard deviation.
    return np.full(3, values.get("sigma", values.get("u95", math.nan) / 2.0))


def _turn(values: dict[str, float]) -> FloatArray | None:
    if "qw" not in values:
        return None
    q = np.array([values[name] for name in _TURNS])
    length = float(np.linalg.norm(q))
    if not abs(length - 1.0) <= _ABOUT_ONE:
        raise DeviceError(f"a quaternion of the stream has the length {length:.4g}, not 1")
    R: FloatArray = Rotation.from_quat(q).as_matrix()
    return R


def _shown(text: str) -> str:
    """Return a text as a message can hold it."""
    return ascii(text if len(text) <= 60 else f"{text[:57]}...")
