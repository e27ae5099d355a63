"""Stations that speak in lines over TCP: we connect to an adapter, or it connects to us.

Verified against the simulator (`elastocal.sim.wire`) and clients of a few lines, not hardware.
"""

import socket
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

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
from elastocal.drivers.line_stream.lines import (
    AdapterFault,
    BeamLine,
    Column,
    Event,
    FrameLine,
    LineReader,
    columns_of,
)
from elastocal.drivers.station_link import WAKE, StationLink, metrology_set
from elastocal.drivers.stations import (
    StationFeed,
    StationsMetrology,
    require_station,
    require_trackers,
)
from elastocal.errors import DeviceError, of_kind
from elastocal.records import StrictModel

_Port = Annotated[int, Field(ge=0, le=65535)]


class StationLine(StrictModel):
    """Where one station is, where each has a line of its own."""

    address: str = LOOPBACK
    port: _Port


class LineStreamSettings(DeviceSettings):
    """Keys beside ``driver: line_stream``."""

    role: Literal["client", "server"] = "client"
    """Whether we connect to the adapter, or it connects to us."""
    address: str = LOOPBACK
    """Of the adapter; as server, the one that we bind to."""
    port: _Port = 0
    """Of the one line that all stations share."""
    peer: str = LOOPBACK
    """As server: the only address that may connect."""
    stations: dict[Name, StationLine] = Field(default_factory=dict)
    """A line for each station, in place of ``port``."""
    columns: tuple[str, ...] = ()
    """Of a stream without a header: ``[t[s], x[mm], y[mm], z[mm]]``."""
    rate: SampleRate = 100.0
    """Points a second."""
    point: Point = (0.0, 0.0, 0.0)
    """Of a 6D marker: the point that counts, in the marker's own frame, in m."""
    silence: PositiveTime = 0.2
    """Without a line for longer the beam counts as broken, in s."""
    patience: PositiveTime = 10.0
    """How long a connection may be gone before that is a fault, in s."""
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
        """Where the lines are, each with its station."""
        each = [_Address(line.address, line.port, name) for name, line in self.stations.items()]
        return each or [_Address(self.address, self.port, None)]

    def device_places(self) -> tuple[DevicePlace, ...]:
        """Return where the adapters are; as server, each is known by the port that it comes to."""
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
    """Where a line is, and whose."""

    host: str
    port: int
    station: str | None
    """None: all stations are on it."""


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
        """Whose line it is; None: all stations are on it."""
        return self._address.station

    def look(self, station: str) -> None:
        """Let the adapter be told which station is to find the marker."""
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
        """Return a connection; None when nobody has come yet."""
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
        """Take what comes until the connection ends, or says nothing for too long."""
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
