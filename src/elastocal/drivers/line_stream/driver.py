"""Tracker stations that send text lines over TCP, as client or server.

Verified against the simulator (`elastocal.sim.wire`) and clients of a few lines, not hardware.

The lines of a stream: a header that names columns and units, points, beam, frame, fault.

Example:

    t[s],x[mm],y[mm],z[mm],sigma[mm]
    frame 2026-11-22T08:00 setup 3
    12.345,2412.071,-310.442,1203.118,0.012
    beam broken
    beam locked

A line beginning with ``#`` is a comment, unless what follows is a header. Cells are separated by
commas, semicolons, tabs or blanks; except with commas, numbers may have a decimal comma.
"""

import math
import re
import socket
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.cell import (
    LOOPBACK,
    Cell,
    Clock,
    DevicePlace,
    DeviceSet,
    DeviceSettings,
    LocalPort,
    Name,
    Point,
    PositiveTime,
    RigContext,
    SampleRate,
)
from elastocal.drivers.stations import (
    WAKE,
    StationFeed,
    StationLink,
    StationsMetrology,
    metrology_set,
    require_station,
    require_trackers,
)
from elastocal.errors import DeviceError, UnitError, of_kind
from elastocal.records import StrictModel
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
"""Largest deviation of the length of a quaternion from 1."""


@dataclass(frozen=True)
class Column:
    """One column of the points."""

    name: str
    unit: str | None
    """Unit of time and lengths."""

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
    """State of the beam of a station; of the only station if none is named."""

    locked: bool
    station: str | None


@dataclass(frozen=True)
class FrameLine:
    """A name of the frame that points are in; another one than before is another frame."""

    name: str


@dataclass(frozen=True)
class AdapterFault:
    """Fault that the adapter reports in words."""

    text: str


Event = MarkerPoint | BeamLine | FrameLine | AdapterFault


def columns_of(texts: Sequence[str]) -> tuple[Column, ...]:
    """Return columns by texts such as ``x[mm]``.

    Raises
    ------
    DeviceError
        If a name or unit is not known, a unit or a coordinate is missing, a name is repeated.
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
    """Reader of events from the bytes of a stream; keeps no more than one line.

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
            If a line is invalid or too long.
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
        # A comma may be decimal: the number of cells shows which character separates them.
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


_Port = Annotated[int, Field(ge=0, le=65535)]


class StationLine(StrictModel):
    """Address of one station that has a line of its own."""

    address: str = LOOPBACK
    port: _Port


class LineStreamSettings(DeviceSettings):
    """Keys beside ``driver: line_stream``."""

    role: Literal["client", "server"] = "client"
    """Whether we connect to the adapter, or it connects to us."""
    address: str = LOOPBACK
    """Address of the adapter; as server, the one that we bind to."""
    port: _Port = 0
    """Port of the one line that all stations share."""
    peer: str = LOOPBACK
    """In server mode, the only address that may connect."""
    stations: dict[Name, StationLine] = Field(default_factory=dict)
    """A line for each station, in place of ``port``."""
    columns: tuple[str, ...] = ()
    """Columns of a stream without a header: ``[t[s], x[mm], y[mm], z[mm]]``."""
    rate: SampleRate = 100.0
    """Points a second."""
    point: Point = (0.0, 0.0, 0.0)
    """Point of a 6D marker: the point that counts, in the marker's own frame, in m."""
    silence: PositiveTime = 0.2
    """Without a line for longer the beam counts as broken, in s."""
    patience: PositiveTime = 10.0
    """Largest time without a connection before a fault, in s."""
    own_frame: bool = True
    """Whether points are in the station's own frame: their distance is then checked against the
    range of the station, so that mm taken for m are found."""

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if (not self.port and self.role == "client") == (not self.stations):
            raise ValueError("give port, or stations with a port each")
        try:
            self.parsed_columns  # noqa: B018 - refused here, where the file is known
        except DeviceError as error:
            raise ValueError(str(error)) from error
        return self

    @property
    def addresses(self) -> list["_Address"]:
        """Addresses of the lines, each with its station."""
        each = [_Address(line.address, line.port, name) for name, line in self.stations.items()]
        return each or [_Address(self.address, self.port, None)]

    def device_places(self) -> tuple[DevicePlace, ...]:
        """Return the addresses of the adapters; in server mode, the ports that they connect to."""
        if self.role == "server":
            return tuple(DevicePlace(self.peer, line.port) for line in self.addresses)
        return super().device_places()

    def own_ports(self) -> tuple[LocalPort, ...]:
        """Return the ports that adapters come to."""
        served = self.addresses if self.role == "server" else ()
        return tuple(LocalPort("tcp", line.host, line.port) for line in served)

    @property
    def parsed_columns(self) -> tuple[Column, ...]:
        """Columns of a stream without a header."""
        return columns_of(self.columns) if self.columns else ()


@dataclass(frozen=True)
class _Address:
    """Address of a line and its station."""

    host: str
    port: int
    station: str | None
    """None: all stations use it."""


class _Line(StationLink):
    """One connection; fills the feeds of its stations."""

    def __init__(
        self,
        address: _Address,
        settings: LineStreamSettings,
        feeds: Mapping[str, StationFeed],
        clock: Clock,
        listener: socket.socket | None,
    ) -> None:
        own = list(feeds.values()) if address.station is None else [feeds[address.station]]
        name = f"line_stream {address.host}:{address.port}"
        super().__init__(name, own, clock, settings.patience)
        self._address, self._settings, self._feeds = address, settings, feeds
        self._frame: str | None = None
        self._looked = next(iter(feeds)) if address.station is None else address.station
        self._to_look = threading.Event()
        self._listener = listener
        self.port = address.port
        """The port that was taken or is connected to."""
        if listener is not None:
            listener.settimeout(WAKE)
            self.port = int(listener.getsockname()[1])

    @property
    def station(self) -> str | None:
        """Station of the line; None: all stations use it."""
        return self._address.station

    def look(self, station: str) -> None:
        """Tell the adapter which station is to find the marker."""
        self._looked = station
        self._to_look.set()

    def close(self) -> None:
        """End the thread, and give the port back."""
        super().close()
        if self._listener is not None:
            self._listener.close()

    def hear(self) -> bool:
        """Connect and receive."""
        connection = self._connect()
        if connection is None:
            return False
        with connection:
            self._receive(connection)
        return True

    def _connect(self) -> socket.socket | None:
        """Return a connection; None while there is none."""
        if self._listener is None:
            place = (self._address.host, self._address.port)
            return socket.create_connection(place, timeout=1.0)
        try:
            connection, (host, *_) = self._listener.accept()
        except TimeoutError:
            return None
        if host != self._settings.peer:
            connection.close()
            return None
        return connection

    def _receive(self, connection: socket.socket) -> None:
        """Receive until the connection ends, or is silent for too long."""
        connection.settimeout(WAKE)
        reader, first = LineReader(self._settings.parsed_columns), True
        heard = self.clock.now()
        self._to_look.set()
        while not self.done.is_set() and self.clock.now() - heard <= self._settings.patience:
            if self._to_look.is_set():
                self._to_look.clear()
                connection.sendall(f"look {self._looked}\n".encode())
            data = self.receive(connection)
            if data is None:
                continue
            if not data:
                return
            heard = self.clock.now()
            if first and reader.columns:
                # Without a header the first line may be the end of one.
                data = data.partition(b"\n")[2]
            first = False
            for event in reader.feed(data):
                self._take(event, reader.columns)

    def _take(self, event: Event, columns: tuple[Column, ...]) -> None:
        if isinstance(event, AdapterFault):
            raise DeviceError(f"the adapter says: {event.text}")
        if isinstance(event, FrameLine):
            if self._frame is not None and event.name != self._frame:
                raise DeviceError(
                    f"its frame was {self._frame!r} and is {event.name!r} now: the station was"
                    " started or placed anew, and readings before and after do not go together"
                )
            self._frame = event.name
            return
        feed = self._feed(event.station)
        if isinstance(event, BeamLine):
            if not event.locked:
                feed.beam_broken("the adapter says that the beam is broken")
            return
        feed.unit = next(str(column.unit) for column in columns if column.name == "x")
        position = event.position
        if any(self._settings.point):
            position = _at_point(position, event.R, self._settings.point)
        feed.point(position, event.sigma, event.stamp)

    def _feed(self, station: str | None) -> StationFeed:
        name = station or self._address.station
        if name is None:
            if len(self._feeds) > 1:
                raise DeviceError(
                    f"{', '.join(self._feeds)} share a line that does not say whose its points"
                    " are: it needs a column 'station', or each a port of its own (key 'stations')"
                )
            name = next(iter(self._feeds))
        require_station(name, tuple(self._feeds))
        return self._feeds[name]


def _at_point(position: FloatArray, R: FloatArray | None, point: tuple[float, ...]) -> FloatArray:
    """Return a point of a 6D marker, shape (3,), in m of the station's frame."""
    if R is None:
        raise DeviceError("a point in the marker's frame needs its orientation: qx, qy, qz, qw")
    there: FloatArray = position + R @ np.array(point)
    return there


class LineMetrology(StationsMetrology):
    """Stations by their lines; fulfils `elastocal.cell.Metrology`."""

    def __init__(
        self, feeds: Mapping[str, StationFeed], rate: float, lines: Sequence[_Line]
    ) -> None:
        super().__init__(feeds, rate, self._tell)
        self._lines = lines

    @property
    def ports(self) -> tuple[int, ...]:
        """The ports that were taken or are connected to, in the order of the lines."""
        return tuple(line.port for line in self._lines)

    def _tell(self, station: str) -> None:
        for line in self._lines:
            if line.station in (None, station):
                line.look(station)


class LineStreamDriver:
    """Makes metrology of line streams; see `elastocal.cell.Driver`."""

    kinds = frozenset({"metrology"})
    real = False

    def settings(self, kind: str) -> type[DeviceSettings]:  # noqa: ARG002 - the protocol's form
        """Return `LineStreamSettings`."""
        return LineStreamSettings

    def connect(
        self, cell: Cell, wanted: Mapping[str, DeviceSettings], context: RigContext
    ) -> DeviceSet:
        """Begin to connect; whether it succeeds is seen by `read`.

        Raises
        ------
        DeviceError
            If the cell has no such station, or a port cannot be bound.
        """
        settings = of_kind(wanted["metrology"], LineStreamSettings, "settings")
        trackers = {tracker.name: tracker for tracker in require_trackers(cell)}
        for name in settings.stations:
            require_station(name, tuple(trackers))
        addresses, ports = settings.addresses, settings.own_ports()
        listeners = [context.listener(port) for port in ports]
        where = ", ".join(f"{each.host}:{each.port}" for each in addresses)
        names = tuple(settings.stations) or tuple(trackers)
        feeds = {
            name: StationFeed(
                trackers[name],
                f"line_stream {where}",
                context.clock,
                silence=settings.silence,
                own_frame=settings.own_frame,
            )
            for name in names
        }
        lines = [
            _Line(address, settings, feeds, context.clock, listener)
            for address, listener in zip_longest(addresses, listeners)
        ]
        return metrology_set(LineMetrology(feeds, settings.rate, lines), lines, context)


DRIVER = LineStreamDriver()
"""The driver that cell files name; see `LineStreamDriver`."""
