"""Connections to Leica trackers, a thread each, and the driver."""

import socket
import threading
from collections.abc import Mapping

from elastocal.cell import Cell, Clock, DeviceSet, DeviceSettings, RigContext, Tracker
from elastocal.drivers.emscon.dialogue import Dialogue, EmsconSettings, EmsconStation
from elastocal.drivers.emscon.packets import Code, PacketReader, command
from elastocal.drivers.station_link import WAKE, StationLink, metrology_set
from elastocal.drivers.stations import (
    StationFeed,
    StationsMetrology,
    require_station,
    require_trackers,
)
from elastocal.errors import DeviceError, of_kind


class _Station(StationLink):
    """One tracker; fills its feed."""

    def __init__(
        self, place: EmsconStation, settings: EmsconSettings, feed: StationFeed, clock: Clock
    ) -> None:
        name = f"emscon {place.address}:{place.port}"
        super().__init__(name, (feed,), clock, settings.patience)
        self._place, self._settings, self._feed = place, settings, feed
        self._to_look = threading.Event()
        self._fresh = True

    def look(self) -> None:
        """Let the marker be found again."""
        self._to_look.set()

    def hear(self) -> bool:
        """Connect and talk."""
        place = (self._place.address, self._place.port)
        with socket.create_connection(place, timeout=1.0) as connection:
            self._talk(connection)
        return True

    def _talk(self, connection: socket.socket) -> None:
        connection.settimeout(WAKE)
        reader = PacketReader()
        dialogue = Dialogue(self._settings, self._feed, self.clock, fresh=self._fresh)
        while not self.done.is_set():
            if self._to_look.is_set():
                self._to_look.clear()
                dialogue.look()
            connection.sendall(dialogue.due())
            data = self.receive(connection)
            if data is None:
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
        settings = of_kind(wanted["metrology"], EmsconSettings, "settings")
        if context.watches:
            # A head that turns for a minute is nothing that somebody expects who only looks.
            settings = settings.model_copy(update={"initialize": False, "bird_bath": False})
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
        metrology = StationsMetrology(feeds, settings.rate, lambda name: stations[name].look())
        return metrology_set(metrology, stations.values(), context)


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


DRIVER = EmsconDriver()
