"""Connections to Leica trackers, a thread each, and the driver."""

import socket
import threading
from collections.abc import Callable, Mapping

from elastocal.cell import Cell, Clock, DeviceSet, DeviceSettings, RigContext, Tracker
from elastocal.drivers.emscon.dialogue import Dialogue, EmsconSettings, EmsconStation
from elastocal.drivers.emscon.packets import Code, PacketReader, command
from elastocal.drivers.stations import (
    StationFeed,
    StationsMetrology,
    require_station,
    require_trackers,
)
from elastocal.errors import DeviceError

_RECEIVED = 65536
"""Bytes that are read at once."""
_WAKE = 0.05
"""How often a thread looks whether it is to end, in s of the wall."""


class _Station(threading.Thread):
    """One tracker: keeps a connection up until it is closed; fills its feed."""

    def __init__(
        self, place: EmsconStation, settings: EmsconSettings, feed: StationFeed, clock: Clock
    ) -> None:
        super().__init__(name=f"emscon {place.address}:{place.port}", daemon=True)
        self._place, self._settings, self._feed, self._clock = place, settings, feed, clock
        self._done, self._to_look = threading.Event(), threading.Event()
        self._fresh = True

    def look(self) -> None:
        """Let the marker be found again."""
        self._to_look.set()

    def close(self) -> None:
        """End the thread."""
        self._done.set()
        if self.is_alive():
            self.join()

    def run(self) -> None:
        """Connect, talk, connect again."""
        gone = self._clock.now()
        while not self._done.is_set():
            try:
                with socket.create_connection(
                    (self._place.address, self._place.port), timeout=1.0
                ) as connection:
                    self._talk(connection)
                    gone = self._clock.now()
                self._feed.beam_broken("the connection has ended")
            except DeviceError as error:
                self._feed.fail(str(error))
                return
            except OSError as error:
                self._feed.beam_broken(f"no connection: {error.strerror or error}")
            if not self._clock.now() - gone <= self._settings.patience:
                self._feed.fail(f"no connection for {self._clock.now() - gone:.0f} s")
                return
            self._done.wait(_WAKE)

    def _talk(self, connection: socket.socket) -> None:
        connection.settimeout(_WAKE)
        reader = PacketReader()
        dialogue = Dialogue(self._settings, self._feed, self._clock, fresh=self._fresh)
        while not self._done.is_set():
            if self._to_look.is_set():
                self._to_look.clear()
                dialogue.look()
            connection.sendall(dialogue.due())
            try:
                data = connection.recv(_RECEIVED)
            except TimeoutError:
                continue
            if not data:
                return
            for packet in reader.feed(data):
                dialogue.take(packet)
            self._fresh = self._fresh and not dialogue.ready
        connection.sendall(command(Code.STOP_MEASUREMENT))


class EmsconDriver:
    """Makes metrology of Leica trackers; see `elastocal.cell.Driver`."""

    kinds = frozenset({"metrology"})
    real = False

    def settings(self, kind: str) -> type[DeviceSettings]:  # noqa: ARG002 - the protocol's form
        """Return `EmsconSettings`."""
        return EmsconSettings

    def connect(
        self, cell: Cell, wanted: Mapping[str, DeviceSettings], context: RigContext
    ) -> DeviceSet:
        """Begin to connect; whether it succeeds is seen by `read`.

        Raises
        ------
        DeviceError
            If stations and settings do not match.
        """
        settings = wanted["metrology"]
        assert isinstance(settings, EmsconSettings)
        places = _places(require_trackers(cell), settings)
        feeds = {
            tracker.name: StationFeed(
                tracker,
                f"emScon {place.address}:{place.port}",
                context.clock,
                silence=settings.silence,
            )
            for tracker, place in places
        }
        stations = {
            tracker.name: _Station(place, settings, feeds[tracker.name], context.clock)
            for tracker, place in places
        }
        for station in stations.values():
            station.start()
        metrology = StationsMetrology(feeds, settings.rate, lambda name: stations[name].look())
        return DeviceSet(metrology=metrology, close=_closing(stations), lines=metrology.lines)


def _places(
    trackers: tuple[Tracker, ...], settings: EmsconSettings
) -> list[tuple[Tracker, EmsconStation]]:
    """Return where the controller of each station is."""
    known = {tracker.name: tracker for tracker in trackers}
    for name in settings.stations:
        require_station(name, tuple(known))
    if settings.stations:
        return [(known[name], place) for name, place in settings.stations.items()]
    if len(trackers) > 1:
        raise DeviceError(
            f"the cell has stations {', '.join(known)}: emScon needs an address for each"
            " (key 'stations')"
        )
    return [(trackers[0], EmsconStation(address=settings.address, port=settings.port))]


def _closing(stations: Mapping[str, _Station]) -> Callable[[], None]:
    def close() -> None:
        for station in stations.values():
            station.close()

    return close


DRIVER = EmsconDriver()
