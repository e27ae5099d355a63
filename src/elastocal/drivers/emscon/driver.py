"""Connections to Leica trackers, a thread each, and the driver.

Commands to a Leica tracker: it is set up once and then monitored; after a break of the beam the
marker is searched.

The order of commands is that of public programs: units, initialise, settings, mode, reflector,
find, start. Commands are sent one after another, each when the one before it is answered. The
answer to `look` while the beam is broken is FindReflector, then StartMeasurement: it is not
documented whether a tracker continues by itself after a break; one that does answers that it is
busy.

Verified against the simulator (`elastocal.sim.wire`) and the public layout, not hardware.
"""

import socket
import threading
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation

from elastocal.arrays import BoolArray, FloatArray
from elastocal.cell import (
    LOOPBACK,
    Cell,
    Clock,
    DeviceSet,
    DeviceSettings,
    Name,
    Point,
    PositiveLength,
    PositiveTime,
    RigContext,
    SampleRate,
    Tracker,
)
from elastocal.drivers.emscon.packets import (
    Answer,
    Code,
    Complaint,
    MeasuredPoints,
    Mode,
    Packet,
    PacketReader,
    Reflector,
    StatusChange,
    command,
    status_text,
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
from elastocal.errors import DeviceError, nearest, of_kind
from elastocal.records import StrictModel

_PORT = 700
_OK, _BUSY, _IN_USE, _NOT_INITIALIZED = 0, 1, 35, 39
_AGAIN = 0.2
"""After how long a command is repeated that found the server busy, in s."""
_METRES, _RADIANS, _CELSIUS, _MILLIBAR, _RELATIVE = 0, 0, 0, 0, 0
_RIGHT_HANDED = 0
_EXTENDED = 1
_FATAL = frozenset({38, 39, 40, 41, 57, 94, 95, 96, 10005, 10010, 10011, 10015})
"""Statuses of complaints that no search for the reflector mends."""
_QUALITIES = {
    2: "the marker moves too fast to be measured (speed exceeded)",
    3: "the prism is not measured well (prism error): clean or turn the reflector",
    4: "the trigger is violated",
}
"""Qualities that exclude a point; 1, fast, does not."""
_CLOSING = 998
_RESTARTED = {
    850: "its sensor was connected anew",
    _CLOSING: "its server is closing",
    999: "its server was started anew",
}
_CHANGED = {
    6: "units",
    7: "reflector",
    8: "settings",
    12: "coordinate system",
    15: "station orientation",
    16: "transformation",
    17: "mode of measurement",
}
"""Settings that another program may change during a measurement, which makes earlier and later
numbers inconsistent."""
_LOST = {25: "the tracker is not ready", 99: "the 6D probe is not seen"}
_FROZEN_ROTATION = 1 << 5
_ROTATION_ERROR = 1 << 1
_WEATHER = ((-20.0, 60.0, "temperature", "degC"), (500.0, 1200.0, "pressure", "mbar"))
"""A distance is wrong by 1 ppm a degree and 0.27 ppm a mbar."""

_Port = Annotated[int, Field(ge=1, le=65535)]


class EmsconStation(StrictModel):
    """Address of one tracker."""

    address: str = LOOPBACK
    port: _Port = _PORT


class EmsconSettings(DeviceSettings):
    """Keys beside ``driver: emscon``."""

    address: str = LOOPBACK
    """Address of the controller of the only station."""
    port: _Port = _PORT
    stations: dict[Name, EmsconStation] = Field(default_factory=dict)
    """A controller for each station of the cell, where there are several."""
    marker: Literal["reflector", "probe"] = "reflector"
    """A corner cube (3D) or a 6D probe (T-Mac)."""
    reflector: str | None = None
    """Name of the corner cube as the tracker knows it; by default the one that is set."""
    point: Point = (0.0, 0.0, 0.0)
    """Point of a 6D probe: the point that counts, in the probe's own frame, in m."""
    rate: SampleRate = 100.0
    """Points a second."""
    initialize: bool = True
    """Whether the tracker is initialised first: its head turns, for a minute."""
    bird_bath: bool = False
    """Whether it goes to its home position first, for the distance of an interferometer."""
    distance: PositiveLength = 3.0
    """Roughly, where the reflector is looked for before the first point, in m."""
    patience: PositiveTime = 120.0
    """Largest time for a command, or without a connection, in s."""
    silence: PositiveTime = 0.2
    """Without a point for longer the beam counts as broken, in s."""


@dataclass(frozen=True)
class _Step:
    """A command, and what it is for."""

    code: Code
    packet: bytes
    may_fail: bool = False
    """Whether its refusal is no fault: the beam stays broken."""


class Dialogue:
    """One connection: sends command after command, and takes what comes; knows no socket.

    Parameters
    ----------
    settings : EmsconSettings
        What is wanted.
    feed : StationFeed
        Where points go.
    clock : Clock
        Clock of the rig.
    fresh : bool
        Whether this is the first connection: only then is the tracker initialised.
    """

    def __init__(
        self, settings: EmsconSettings, feed: StationFeed, clock: Clock, *, fresh: bool
    ) -> None:
        self._settings, self._feed, self._clock = settings, feed, clock
        self._steps, self._fresh = deque(_setup(settings, fresh=fresh)), fresh
        self._waiting: _Step | None = None
        self._since = self._again = clock.now()
        self._pointed = -np.inf
        self.ready = False
        """Whether the set-up is done."""
        self._distance = settings.distance
        self._reflectors: list[Reflector] = []

    def look(self) -> None:
        """Find the marker again if it is lost and no search is under way."""
        seen = self._clock.now() - self._pointed <= self._settings.silence
        if self.ready and not seen and not self._steps and self._waiting is None:
            self._steps.extend(_search(self._settings, self._distance))

    def due(self) -> bytes:
        """Return the bytes that are to be sent now; none while an answer is waited for.

        Raises
        ------
        DeviceError
            If an answer does not come.
        """
        now = self._clock.now()
        if self._waiting is not None:
            if not now - self._since <= self._settings.patience:
                raise DeviceError(f"no answer to {_named(self._waiting.code)}")
            return b""
        if not self._steps or now < self._again:
            self.ready = self.ready or not self._steps
            return b""
        self._waiting, self._since = self._steps.popleft(), now
        return self._waiting.packet

    def take(self, packet: Packet) -> None:
        """Take what has come.

        Raises
        ------
        DeviceError
            If the tracker is out of order, or not as it has to be.
        """
        if isinstance(packet, MeasuredPoints):
            self._take_points(packet)
        elif isinstance(packet, Answer):
            self._take_answer(packet)
        elif isinstance(packet, StatusChange):
            self._take_change(packet.code)
        else:
            self._take_complaint(packet)

    def _take_answer(self, answer: Answer) -> None:
        step = self._waiting
        if step is None or answer.command != step.code:
            return
        if isinstance(answer, Reflector):
            self._reflectors.append(answer)
            if len(self._reflectors) < answer.total:
                return
            self._choose_reflector()
        elif answer.status == _BUSY and not step.may_fail:
            self._steps.appendleft(step)
            self._again = self._clock.now() + _AGAIN
        elif answer.status != _OK:
            self._refused(step, answer.status)
        self._waiting = None

    def _refused(self, step: _Step, status: int) -> None:
        text = f"{_named(step.code)}: {status_text(status)}"
        if step.code is Code.STOP_MEASUREMENT:
            return
        if status == _NOT_INITIALIZED and not self._fresh:
            raise DeviceError(f"{text}: it was started anew, its frame may be another one")
        if not step.may_fail or status in _FATAL:
            raise DeviceError(text)
        # A tracker that has continued to measure reports that it is busy.
        if step.code is not Code.START_MEASUREMENT or status not in (_BUSY, _IN_USE):
            self._steps.clear()
            self._lost(text)

    def _choose_reflector(self) -> None:
        wanted = self._settings.reflector
        names = [each.name for each in self._reflectors]
        if wanted not in names:
            raise DeviceError(
                f"there is no reflector {wanted!r}{nearest(str(wanted), names)}"
                f" (reflectors: {', '.join(names)})"
            )
        number = self._reflectors[names.index(wanted)].number
        self._steps.appendleft(_step(Code.SET_REFLECTOR, number, form="i"))

    def _take_change(self, code: int) -> None:
        if code in _RESTARTED and (self.ready or code == _CLOSING):
            raise DeviceError(f"{_RESTARTED[code]}: its frame may be another one, register anew")
        if code == 851:
            raise DeviceError("its sensor was disconnected")
        if self.ready and self._waiting is None and code in _CHANGED:
            raise DeviceError(
                f"another program has changed its {_CHANGED[code]}: points before and after do not"
                " go together"
            )
        if code in _LOST:
            self._lost(_LOST[code])

    def _take_complaint(self, complaint: Complaint) -> None:
        if self._waiting is not None and complaint.command == self._waiting.code:
            self._take_answer(Answer(complaint.command, complaint.status))
            return
        text = status_text(complaint.status)
        if complaint.status in _FATAL:
            raise DeviceError(text)
        self._lost(text)

    def _take_points(self, points: MeasuredPoints) -> None:
        if points.status in _FATAL:
            raise DeviceError(status_text(points.status))
        for value, (low, high, what, unit) in zip(
            (points.temperature, points.pressure), _WEATHER, strict=True
        ):
            if not low <= value <= high:
                raise DeviceError(
                    f"its {what} is {value:.4g} {unit}, outside {low:g} to {high:g}: distances are"
                    " wrong; is the weather station on?"
                )
        position, good = self._positions(points)
        why = next((_QUALITIES[q] for q in points.quality.tolist() if q in _QUALITIES), "")
        for row in np.flatnonzero(good):
            self._feed.point(position[row], points.sigma[row], float(points.stamp[row]))
            self._distance = float(np.linalg.norm(position[row]))
            self._pointed = self._clock.now()
        if len(good) and not good.any():
            self._feed.beam_broken(why or "the orientation of the probe is not known")

    def _positions(self, points: MeasuredPoints) -> tuple[FloatArray, BoolArray]:
        """Return the points that count, shape (point, 3), in m, and which of them are good."""
        good: BoolArray = ~np.isin(points.quality, list(_QUALITIES))
        good &= np.isfinite(points.position).all(axis=1)
        position, q = points.position, points.quaternion
        if self._settings.marker == "reflector" or q is None or points.rotation_status is None:
            return position, good
        good &= np.isfinite(q).all(axis=1) & (np.abs(np.linalg.norm(q, axis=1) - 1.0) < 0.02)
        good &= (points.rotation_status & (_FROZEN_ROTATION | _ROTATION_ERROR)) == 0
        if any(self._settings.point) and good.any():
            position = position.copy()
            turns = Rotation.from_quat(np.roll(q[good], -1, axis=1))
            position[good] += turns.apply(np.array(self._settings.point))
        return position, good

    def _lost(self, why: str) -> None:
        self._pointed = -np.inf
        self._feed.beam_broken(why)


def _step(code: Code, *values: float, form: str = "", may_fail: bool = False) -> _Step:
    return _Step(code, command(code, *values, form=form), may_fail)


def _setup(settings: EmsconSettings, *, fresh: bool) -> list[_Step]:
    """Return the commands that make a tracker measure."""
    probe = settings.marker == "probe"
    mode = Mode.PROBE_CONTINUOUS_TIME if probe else Mode.CONTINUOUS_TIME
    units = (_METRES, _RADIANS, _CELSIUS, _MILLIBAR, _RELATIVE)
    # Weather read and used, no transformation, no orientation, last place kept, messages sent, no
    # places beside the measurement, and three flags of no meaning for us.
    flags = (2, 0, 0, 1, 1, 0, 0, 0, 0)
    steps = [_step(Code.STOP_MEASUREMENT, may_fail=True), _step(Code.SET_UNITS, *units, form="5i")]
    if fresh and settings.initialize:
        steps.append(_step(Code.INITIALIZE))
    steps += [
        _step(Code.SET_SYSTEM_SETTINGS, *flags, form="9i"),
        _step(Code.SET_COORDINATE_SYSTEM, _RIGHT_HANDED, form="i"),
        _step(Code.SET_STATISTIC_MODE, _EXTENDED, _EXTENDED, form="2i"),
        _step(Code.SET_MEASUREMENT_MODE, mode, form="i"),
        _step(Code.SET_CONTINUOUS_TIME, round(1e3 / settings.rate), 0, 0, 0, form="4i"),
    ]
    if settings.reflector is not None and not probe:
        steps.append(_step(Code.GET_REFLECTORS))
    if settings.bird_bath:
        steps.append(_step(Code.GO_BIRD_BATH))
    return steps + _search(settings, settings.distance)


def _search(settings: EmsconSettings, distance: float) -> list[_Step]:
    """Return the commands that find the marker near a distance in m, and measure it."""
    start = _step(Code.START_MEASUREMENT, may_fail=True)
    if settings.marker == "probe":
        return [start]
    return [_step(Code.FIND_REFLECTOR, distance, form="d", may_fail=True), start]


def _named(code: Code) -> str:
    return code.name.replace("_", " ").capitalize()


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
        """Start a search for the marker."""
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
            # A person who only watches does not expect a head that turns for a minute.
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
    """Return the address of each station's controller."""
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
"""The driver that cell files name; see `EmsconDriver`."""
