"""Points of tracker stations, from the thread of a line to `elastocal.cell.Metrology`.

A thread enters the events of its line: points, a beam that breaks or is found, a fault. The
supervision cycle takes them out without waiting. In between are the checks that any instrument
needs: its clock (`elastocal.drivers.device_clock`), the unit of its lengths by the range of the
station in the cell file, a bound on what is kept.

The connection to a station: a thread that keeps it up, and fills the feeds of its stations.
"""

import math
import socket
import threading
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import (
    BeamState,
    Cell,
    Clock,
    DeviceReading,
    DeviceSet,
    LineCounts,
    PointBlock,
    RigContext,
    Tracker,
    three,
)
from elastocal.drivers.device_clock import DeviceClock
from elastocal.errors import DeviceError, nearest
from elastocal.units import factor

NEWEST = 500
"""Points that are kept for a caller that does not look; older ones are lost."""
_OUTSIDE = 10
"""Points one after another outside the station's range: no blunder, but another unit or frame."""
_ROUGHLY = 2.0
"""Factor by which a marker may be beyond the range, which is a planner's figure."""
_UNITS = ("m", "mm", "um", "in")


class StationFeed:
    """Events of one station, entered by a thread and taken by the supervision cycle.

    Parameters
    ----------
    tracker : Tracker
        The station in the cell file.
    source : str
        Device and address, for messages.
    clock : Clock
        Clock of the rig.
    silence : float
        Silence after which the beam of a station counts as broken, in s.
    unit : str
        Unit in which the device states lengths, for messages.
    own_frame : bool
        Whether points are in the station's own frame, so that they lie within its range.
    """

    def __init__(
        self,
        tracker: Tracker,
        source: str,
        clock: Clock,
        *,
        silence: float = 0.2,
        unit: str = "m",
        own_frame: bool = True,
    ) -> None:
        self.tracker, self.source, self.unit = tracker, source, unit
        self._clock, self._silence, self._own_frame = clock, silence, own_frame
        self._lock = threading.Lock()
        self._stamps = DeviceClock(f"{source}: {tracker.name}")
        self._rows: deque[tuple[float, ...]] = deque(maxlen=NEWEST)
        self._beam, self._note, self._fault = BeamState.BROKEN, "no point has come yet", ""
        self._heard = -np.inf
        self._outside = 0
        self._points = self._breaks = 0
        self.connected = False
        """Whether its line has said anything yet."""

    @property
    def counts(self) -> LineCounts:
        """Counts so far."""
        device = f"{self.source}: {self.tracker.name}"
        return LineCounts(device=device, received=self._points, breaks=self._breaks)

    @property
    def clock(self) -> DeviceClock:
        """The station's clock as it is estimated."""
        return self._stamps

    def point(self, position: FloatArray, sigma: FloatArray, stamp: float | None = None) -> None:
        """Take a point; the beam then holds.

        Parameters
        ----------
        position, sigma : ndarray, shape (3,)
            In m; sigma NaN where it is not known.
        stamp : float, optional
            By the device's clock, in s; by default the present time.
        """
        now = self._clock.now()
        with self._lock:
            try:
                time = now if stamp is None else self._stamps.rig_time(stamp, now)
                self._require_in_range(position)
            except DeviceError as error:
                self._fault = self._fault or str(error)
                return
            self._rows.append((time, *position.tolist(), *sigma.tolist()))
            self._heard, self._beam, self._note = now, BeamState.LOCKED, ""
            self._points += 1

    def beam_broken(self, why: str) -> None:
        """Take note that the marker is not seen, and why."""
        with self._lock:
            self._break_beam(why)
            self._rows.clear()

    def fail(self, why: str) -> None:
        """Take note of a fault; the next call of `take` raises it, and all after it."""
        with self._lock:
            self._fault = self._fault or f"{self.source}: {why}"

    def forget(self) -> None:
        """Drop all events that were not taken."""
        with self._lock:
            self._rows.clear()

    def take(self) -> PointBlock:
        """Return the points since the last call; none while the beam is broken.

        Raises
        ------
        DeviceError
            If something is wrong with the station or its line.
        """
        with self._lock:
            if self._fault:
                raise DeviceError(self._fault)
            self._require_points()
            beam, note = self._beam, self._note
            rows = np.array(self._rows, dtype=float).reshape(-1, 7)
            self._rows.clear()
        if beam is BeamState.BROKEN:
            rows = rows[:0]
        return PointBlock(
            time=rows[:, 0],
            position=rows[:, 1:4],
            sigma=rows[:, 4:],
            beam=beam,
            station=self.tracker.name,
            source=self.source,
            note=note,
        )

    def reading(self) -> DeviceReading:
        """Return the station's state; a fault is shown once, and the next one is taken."""
        with self._lock:
            self._require_points()
            fault, self._fault = self._fault, ""
            if fault:
                self._stamps = DeviceClock(f"{self.source}: {self.tracker.name}")
            locked, newest = self._beam is BeamState.LOCKED, self._rows[-1] if self._rows else None
            note, counts = self._note, self.counts
            offset, drift = self._stamps.against_the_pc()
        return DeviceReading(
            kind="metrology",
            device=counts.device,
            heard=self.connected,
            problem=fault or ("" if self.connected else note),
            state="locked" if locked else f"not locked: {note}" if self.connected else "",
            counts=counts,
            offset=offset,
            drift=drift,
            position=three(np.array(newest[1:4])) if locked and newest is not None else None,
        )

    def _require_points(self) -> None:
        """Take a station that is silent for too long for one whose beam is broken."""
        silent = self._clock.now() - self._heard
        if self._beam is BeamState.LOCKED and not silent <= self._silence:
            self._break_beam("it says nothing")

    def _break_beam(self, why: str) -> None:
        self._breaks += self._beam is BeamState.LOCKED
        self._beam, self._note = BeamState.BROKEN, why

    def _require_in_range(self, position: FloatArray) -> None:
        """Refuse a marker that is outside the station's range time after time."""
        nearest_marker, farthest = self.tracker.range
        distance = float(np.linalg.norm(position))
        if not self._own_frame or nearest_marker / _ROUGHLY <= distance <= _ROUGHLY * farthest:
            self._outside = 0
            return
        self._outside += 1
        if self._outside < _OUTSIDE:
            return
        raw = distance / factor(self.unit, "length")
        fitting = (
            unit
            for unit in _UNITS
            if nearest_marker <= raw * factor(unit, "length") <= farthest and unit != self.unit
        )
        unit = next(fitting, None)
        guess = (
            f"the numbers, {raw:.4g}, look like {unit}, not {self.unit}: state the right unit"
            if unit
            else "are its points in another frame than the station's own?"
        )
        raise DeviceError(
            f"{self.source}: marker {distance:.4g} m from {self.tracker.name}, whose range is"
            f" {nearest_marker:g} m to {farthest:g} m: {guess}"
        )


class StationsMetrology:
    """One or several stations; fulfils `elastocal.cell.Metrology`.

    Parameters
    ----------
    feeds : mapping of str to StationFeed
        By the stations' names, in the order of the cell file.
    rate : float
        Nominal number of points a second.
    on_look : callable
        Called with the name of the station that is to find the marker; returns at once.
    """

    def __init__(
        self, feeds: Mapping[str, StationFeed], rate: float, on_look: Callable[[str], None]
    ) -> None:
        self._feeds, self._on_look = feeds, on_look
        self.rate = rate
        self.stations = tuple(feeds)
        self._station = self.stations[0]

    def look(self, station: str) -> None:
        """Measure with this station from now on, and find the marker again if it was lost.

        Raises
        ------
        DeviceError
            If there is no such station.
        """
        require_station(station, self.stations)
        if station != self._station:
            self._feeds[station].forget()
        self._station = station
        self._on_look(station)

    def read(self) -> PointBlock:
        """Return the points since the last call; none while the beam is broken.

        Raises
        ------
        DeviceError
            If something is wrong with the station that measures, or its line.
        """
        return self._feeds[self._station].take()

    def readings(self) -> tuple[DeviceReading, ...]:
        """Return the state of each station."""
        return tuple(feed.reading() for feed in self._feeds.values())

    def lines(self) -> tuple[LineCounts, ...]:
        """Return the counts of each station."""
        return tuple(feed.counts for feed in self._feeds.values())


def require_station(station: str, stations: tuple[str, ...]) -> None:
    """Refuse a station that is not there.

    Raises
    ------
    DeviceError
        With the nearest and all names.
    """
    if station not in stations:
        raise DeviceError(
            f"there is no station {station!r}{nearest(station, stations)}"
            f" (stations: {', '.join(stations)})"
        )


def require_trackers(cell: Cell) -> tuple[Tracker, ...]:
    """Return the stations of a cell.

    Raises
    ------
    DeviceError
        If it has none.
    """
    if not cell.file.trackers:
        raise DeviceError(f"{cell.path}: a tracker to connect to stands under the key 'trackers'")
    return cell.file.trackers


_RECEIVED = 65536
"""Bytes that are read at once."""
WAKE = 0.05
"""Interval at which a thread checks whether to end, in s of wall time."""
_AGAIN = 1.0
"""Until a line that is only watched is connected again after a refusal, in s of the wall."""


class StationLink(threading.Thread, ABC):
    """Keeps one connection until it is closed; received events fill the feeds of its stations.

    Parameters
    ----------
    name : str
        Name of the thread.
    feeds : sequence of StationFeed
        Informed when the connection is lost.
    clock : Clock
        Clock of the rig.
    patience : float
        Largest time without a connection before a fault, in s. Infinite: there is no fault, it is
        connected again whatever it said.
    """

    def __init__(
        self, name: str, feeds: Sequence[StationFeed], clock: Clock, patience: float
    ) -> None:
        super().__init__(name=name, daemon=True)
        self.clock, self.patience = clock, patience
        self.done = threading.Event()
        """Set when it is to end."""
        self._told = feeds

    @abstractmethod
    def hear(self) -> bool:
        """Connect and receive until the connection ends; False: there was no connection yet.

        Raises
        ------
        DeviceError
            If what came ends the run.
        OSError
            If the line does not carry.
        """

    def close(self) -> None:
        """End the thread."""
        self.done.set()
        if self.is_alive():
            self.join()

    def receive(self, connection: socket.socket) -> bytes | None:
        """Return the bytes that have come; None: none yet, empty: the connection has ended."""
        try:
            data = connection.recv(_RECEIVED)
        except TimeoutError:
            return None
        for feed in self._told if data else ():
            feed.connected = True
        return data

    def run(self) -> None:
        """Connect, hear, connect again."""
        gone = self.clock.now()
        while not self.done.is_set():
            try:
                if self.hear():
                    gone = self.clock.now()
                    self._broken("the connection has ended")
            except DeviceError as error:
                if not self.patience < math.inf:
                    self._broken(str(error))
                    self.done.wait(_AGAIN)
                    continue
                self._failed(str(error))
                return
            except OSError as error:
                self._broken(f"no connection: {error.strerror or error}")
            if not self.clock.now() - gone <= self.patience:
                self._failed(f"no connection for {self.clock.now() - gone:.0f} s")
                return
            self.done.wait(WAKE)

    def _broken(self, why: str) -> None:
        for feed in self._told:
            feed.beam_broken(why)

    def _failed(self, why: str) -> None:
        for feed in self._told:
            feed.fail(why)


def metrology_set(
    metrology: StationsMetrology, links: Iterable[StationLink], context: RigContext
) -> DeviceSet:
    """Begin to connect; return the stations with what closes their links."""
    started = tuple(links)
    for link in started:
        link.patience = context.patience(link.patience)
        link.start()

    def close() -> None:
        for link in started:
            link.close()

    return DeviceSet(
        metrology=metrology, close=close, lines=metrology.lines, readings=metrology.readings
    )
