"""The line to a Net F/T box, and the driver that cell files name ``net_ft``.

RDT serves one client: the last request gets the stream, and the previous client is not informed. So
when a stream ends, the box is queried: if its page answers, another client has the stream. It is
not taken back, since two programs that take it from each other would both receive half of it.

The stream of a Net F/T box as a force sensor: numbering, loss, stall, status.
"""

import contextlib
import http.client
import socket
import threading
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, TypeVar

import numpy as np
from pydantic import Field, FiniteFloat

from elastocal.arrays import FloatArray
from elastocal.cell import (
    LOOPBACK,
    Cell,
    Clock,
    DeviceReading,
    DeviceSet,
    DeviceSettings,
    LineCounts,
    RigContext,
    SensorStatus,
    WrenchBlock,
    WrenchSample,
    three,
)
from elastocal.drivers.net_ft.protocol import (
    ASK_CALIBRATION,
    MOST_PAGE,
    PAGE,
    BoxConfiguration,
    Command,
    CountScale,
    RdtRecord,
    parse_calibration,
    parse_configuration,
    parse_records,
    request,
    status_names,
    status_of,
)
from elastocal.errors import DeviceError, of_kind, present

_NEWEST = 1000
"""Samples that are kept for a caller that does not look; older ones are lost."""
_LATE = 64
"""A record that comes so many places after a later one is dropped; beyond, the count restarted."""
_WINDOW = 1000
"""Records over which the share that is lost is judged."""
_MOST_LOST = 0.1
_STANDING = 100
"""Records without progress of the box's own counter after which it counts as stalled."""
_MOST_STATES = 16
"""Words of status that are remembered."""
_MOST_MALFORMED = 10
"""Datagrams in a row that are no records."""
_FOLLOWS = 1e-3
"""Largest growth of the latency from the box, in s per second: a faster growth is a slow quartz."""
_LONGEST_WAY = 0.05
"""Largest latency, in s: a sample is never dated earlier."""
_SILENT = 0.5
"""Age of the newest record from which on none comes any more, in s."""
_WRAP = 1 << 32
_BACK = 1 << 31


class NetFtSensor:
    """Samples of one box; see `elastocal.cell.devices.ForceSensor` and `elastocal.cell.WrenchFeed`.

    Datagrams arrive by `received`, from any thread. A fault of the stream is raised at the next
    `read` and at all later ones, since unreliable forces end a run. `newest` refuses only a stream
    with a permanent fault (`fail`: the box was restarted, or its counts have another unit); a bad
    status is a bad sample, and invalid or repeated datagrams are missing samples (`leave_gap`).

    Parameters
    ----------
    clock : Clock
        Of the rig. Samples are as far apart as the box says, and have the time of arrival of those
        that came quickest.
    scale : CountScale
        As the box states it.
    rate : float
        Records a second, as the box states it.
    source : str
        The box, for messages.
    """

    def __init__(self, clock: Clock, scale: CountScale, rate: float, source: str) -> None:
        self.rate = rate
        self.source = source
        self.lost = self.late = self.malformed = 0
        """Records that never came; that came after later ones; datagrams that were none."""
        self.taken = self.saturated = 0
        """Records that were taken; those of them beyond a range."""
        self._states: set[int] = set()
        self._clock, self._scale = clock, scale
        self._lock = threading.Lock()
        self._rows: deque[tuple[float, tuple[int, ...]]] = deque(maxlen=_NEWEST)
        self._saturated = False
        self._newest: tuple[float, tuple[int, ...], SensorStatus] | None = None
        self._failure: str | None = None
        self.gap = ""
        """Why samples are missing, or bad; empty as long as none are."""
        self._last: RdtRecord | None = None
        self._time = self._arrived = -np.inf
        self._count = 0
        """Place of the last record in the stream, wraps of its number undone."""
        self._offset = np.inf
        """Time of arrival less place over rate, of those that came quickest."""
        self._standing = self._malformed_now = 0
        self._window = self._window_lost = 0

    def received(self, datagram: bytes) -> None:
        """Take a datagram; never raises."""
        now = self._clock.now()
        try:
            records = parse_records(datagram)
        except DeviceError as error:
            self.malformed += 1
            self._malformed_now += 1
            if self._malformed_now > _MOST_MALFORMED:
                self.leave_gap(f"what it sends are no RDT records: {error}")
            return
        self._malformed_now = 0
        for record in records:
            self._take(record, now)

    def fail(self, why: str) -> None:
        """Refuse every further `read` and `newest`; the first reason is kept."""
        with self._lock:
            self._failure = self._failure or why

    def leave_gap(self, why: str) -> None:
        """Refuse the next `read`: samples are missing in the stream, or bad.

        `newest` continues, with the age of its sample. If the stream returns, the correction of a
        process goes on, whereas the readings of a procedure end with the refusal.
        """
        with self._lock:
            self.gap = self.gap or why

    @property
    def failed(self) -> bool:
        """Whether something has gone wrong."""
        return self._failure is not None

    def _take(self, record: RdtRecord, now: float) -> None:
        last, self._last = self._last, record
        if last is not None and not self._goes_on(last, record):
            return
        status = status_of(record.status)
        self.taken += 1
        if record.status not in (0, *self._states) and len(self._states) < _MOST_STATES:
            self._states.add(record.status)
        self._time = self._time_of(now)
        if status is SensorStatus.FAULT:
            self.leave_gap(f"status {status_names(record.status)}")
            self._newest = self._time, record.counts, status
            return
        with self._lock:
            self._rows.append((self._time, record.counts))
            self._saturated |= status is SensorStatus.SATURATED
            self.saturated += status is SensorStatus.SATURATED
            self._newest = self._time, record.counts, status

    def _goes_on(self, last: RdtRecord, record: RdtRecord) -> bool:
        """Judge the numbers of a record by the one before it; False: it is to be dropped."""
        step = (record.rdt_sequence - last.rdt_sequence) % _WRAP
        if step == 0 or step >= _WRAP - _LATE:
            self.late += 1
            self._last = last
            return False
        if step >= _BACK:
            self.fail(
                f"its count of records went from {last.rdt_sequence} back to"
                f" {record.rdt_sequence}: it was started anew, or another client asked for it"
            )
            return False
        ahead = (record.ft_sequence - last.ft_sequence) % _WRAP
        if ahead >= _BACK:
            self.fail(
                f"its count of samples went from {last.ft_sequence} back to {record.ft_sequence}:"
                " it was started anew, and a bias that it had is gone"
            )
            return False
        self._standing = 0 if ahead else self._standing + 1
        if self._standing >= _STANDING:
            self.leave_gap(f"it repeats sample {record.ft_sequence}: it has stalled")
            return False
        self._count += step
        self._count_lost(step - 1)
        return True

    def _time_of(self, now: float) -> float:
        """Return the time of a record; records that were delayed together arrive in bursts."""
        since = self._count / self.rate
        if self._offset < np.inf:
            self._offset += _FOLLOWS * (now - self._arrived)
        self._offset, self._arrived = min(self._offset, now - since), now
        time = min(max(since + self._offset, now - _LONGEST_WAY), now)
        return max(time, float(np.nextafter(self._time, np.inf)))

    def _count_lost(self, lost: int) -> None:
        self.lost += lost
        self._window, self._window_lost = self._window + lost + 1, self._window_lost + lost
        # Not at the end of the window only: of a stream that thins out it is said at once.
        if self._window_lost > _MOST_LOST * _WINDOW:
            self.leave_gap(f"{self._window_lost} of {self._window} records were lost on the way")
        if self._window >= _WINDOW or self._window_lost > _MOST_LOST * _WINDOW:
            self._window = self._window_lost = 0

    def _wrenches(self, counts: FloatArray) -> tuple[FloatArray, FloatArray]:
        return self._scale.force * counts[:, :3], self._scale.moment * counts[:, 3:]

    def newest(self) -> WrenchSample | None:
        """Return the newest sample; None before the first.

        Raises
        ------
        DeviceError
            If the stream cannot be trusted.
        """
        self._require()
        if self._newest is None:
            return None
        time, counts, status = self._newest
        force, moment = self._wrenches(np.array([counts], dtype=float))
        return WrenchSample(time, force[0], moment[0], status)

    def read(self) -> WrenchBlock:
        """Return the samples since the last call; the newest `_NEWEST` when there are more.

        Raises
        ------
        DeviceError
            If the stream is unreliable, with the reason. A gap is reported once, and samples from
            before its end are dropped.
        """
        self._require()
        with self._lock:
            gap, self.gap = self.gap, ""
            if gap:
                self._rows.clear()
                raise DeviceError(f"{self.source}: {gap}")
            rows, saturated = list(self._rows), self._saturated
            self._rows.clear()
            self._saturated = False
        counts = np.array([counts for _, counts in rows], dtype=float).reshape(-1, 6)
        force, moment = self._wrenches(counts)
        return WrenchBlock(
            time=np.array([time for time, _ in rows]),
            force=force,
            moment=moment,
            force_sigma=np.nan,
            moment_sigma=np.nan,
            status=SensorStatus.SATURATED if saturated else SensorStatus.OK,
            source=self.source,
        )

    def reading(self) -> DeviceReading:
        """Return the readings of the stream; without a state where no record comes.

        Raises
        ------
        DeviceError
            If the stream cannot be trusted.
        """
        newest, (counts,) = self.newest(), self.lines()
        silent = newest is None or not self._clock.now() - newest.time <= _SILENT
        state, problem = "", ""
        if newest is not None and not silent:
            state = f"status {status_names(present(self._last, 'last record').status)}"
            if newest.status is not SensorStatus.OK:
                state, problem = "not to be trusted", state
            elif self.gap:
                state = f"{state}; a run would have ended: {self.gap}"
        return DeviceReading(
            kind="sensor",
            device=self.source,
            heard=newest is not None,
            problem=problem,
            state=state,
            counts=counts,
            force=None if newest is None else three(newest.force),
            moment=None if newest is None else three(newest.moment),
        )

    def lines(self) -> tuple[LineCounts, ...]:
        """Return the counts of the stream."""
        counts = LineCounts(
            device=self.source,
            received=self.taken,
            lost=self.lost,
            late=self.late,
            malformed=self.malformed,
            saturated=self.saturated,
            status=tuple(status_names(state) for state in sorted(self._states)),
        )
        return (counts,)

    def _require(self) -> None:
        if self._failure is not None:
            raise DeviceError(f"{self.source}: {self._failure}")


_SILENCE = 0.25
"""Silence of a stream, in s of wall time, after which it has ended."""
_PATIENCE = 1.0
"""Time to wait for page and calibration, in s of wall time."""
_REQUESTS = 4
"""Times that a stream is asked for before the box counts as deaf."""
_CALIBRATION_BYTES = 24
_LOOK_AGAIN = 5.0
"""Between two looks at the calibration of a box that streams, in s of the wall."""
_NO_RECORD = f"no record for {_SILENCE:g} s"
_OFF = ", and its page does not answer: is it off, or the cable unplugged?"
_TAKEN = ", though its page answers: another client has taken the stream"

_Answer = TypeVar("_Answer")
_Port = Annotated[int, Field(ge=1, le=65535)]


class NetFtSettings(DeviceSettings):
    """Settings of a sensor whose driver is ``net_ft``."""

    address: str = LOOPBACK
    """Address of the box; ATI ships 192.168.1.1."""
    port: _Port = 49152
    """UDP, RDT."""
    http_port: _Port = 80
    """TCP, configuration page."""
    tcp_port: _Port | None = 49151
    """TCP, calibration: a second source of the counts, looked at while it streams; null: none."""
    rate: Annotated[FiniteFloat, Field(gt=0.0, le=1e5)] | None = None
    """Records a second, for a box whose page does not say."""
    tool_transform: tuple[FiniteFloat, ...] = ()
    """Tool transform of the box, as its page states it; by default there must be none. The cell's
    ``sensor.pose`` then is that of the transformed frame."""
    software_bias: bool = False
    """Whether the box may have a software bias. It hides the tool's weight, and a box that loses
    power forgets it."""


class BoxLine:
    """Sockets and threads to one box; `sensor` is what they feed.

    Parameters
    ----------
    settings : NetFtSettings
        Where the box is.
    clock : Clock
        Clock of the rig.
    """

    def __init__(self, settings: NetFtSettings, clock: Clock) -> None:
        """Read the configuration and ask for the stream.

        Raises
        ------
        DeviceError
            If the box does not answer, or must not be used as it is set up.
        """
        self._settings = settings
        self.source = f"Net F/T at {settings.address}"
        self.configuration = self._checked(self._named(self._page))
        if settings.tcp_port is not None:
            self._require_same(self._named(self._calibration))
        rate = self.configuration.rate or settings.rate
        if rate is None:
            raise DeviceError(f"{self.source}: its page does not say comrdtrate: give the key rate")
        self.sensor = NetFtSensor(clock, self.configuration.scale, rate, self.source)
        self._closed = threading.Event()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._threads = [
            threading.Thread(target=each, daemon=True) for each in (self._listen, self._watch)
        ]
        try:
            # Connected: datagrams of anybody else never come up.
            self._socket.connect((settings.address, settings.port))
            self._start()
        except (DeviceError, OSError) as error:
            self._socket.close()
            if isinstance(error, DeviceError):
                raise
            raise DeviceError(f"{self.source}: {error.strerror or error}") from error

    def _start(self) -> None:
        """Ask for the stream until it comes, and go on in threads."""
        self._socket.settimeout(_SILENCE)
        for _ in range(_REQUESTS):
            self._socket.send(request(Command.START))
            with contextlib.suppress(TimeoutError):
                self.sensor.received(self._socket.recv(MOST_PAGE))
                break
        else:
            raise DeviceError(
                f"{self.source}: its page answers, but no stream comes from UDP port"
                f" {self._settings.port}: a firewall between, or RDT on another port"
            )
        for thread in self._threads:
            thread.start()

    def reading(self) -> DeviceReading:
        """Return the readings of the box.

        A stream that another client has taken is not taken back; it may return by itself.

        Raises
        ------
        DeviceError
            If the box does not answer, or its counts mean something else.
        """
        shown = self.sensor.reading()
        if shown.state:
            return shown
        if not self._answers():
            raise DeviceError(f"{self.source}: {_NO_RECORD}{_OFF}")
        return replace(shown, problem=shown.problem or f"{_NO_RECORD}{_TAKEN}")

    def close(self) -> None:
        """End stream and threads."""
        self._closed.set()
        with contextlib.suppress(OSError):
            self._socket.send(request(Command.STOP))
        for thread in self._threads:
            thread.join(2.0 * _PATIENCE)
        self._socket.close()

    def _listen(self) -> None:
        while not (self._closed.is_set() or self.sensor.failed):
            try:
                self.sensor.received(self._socket.recv(MOST_PAGE))
            except TimeoutError:
                if not self.sensor.gap:
                    self._end_or_go_on()
            except OSError as error:
                self.sensor.fail(f"{error.strerror or error}")

    def _end_or_go_on(self) -> None:
        """Look why nothing comes; a stream that comes again meanwhile was only held up."""
        why = self._why_silent()
        try:
            self.sensor.received(self._socket.recv(MOST_PAGE))
        except TimeoutError:
            if not self._closed.is_set():
                self.sensor.leave_gap(why)

    def _why_silent(self) -> str:
        return f"{_NO_RECORD}{_TAKEN if self._answers() else _OFF}"

    def _answers(self) -> bool:
        try:
            self._page()
        except (DeviceError, OSError):
            return False
        return True

    def _watch(self) -> None:
        """See that a count goes on to mean the same."""
        look = self._page_scale if self._settings.tcp_port is None else self._calibration
        while not self._closed.wait(_LOOK_AGAIN) and not self.sensor.failed:
            # A box that does not answer, or whose answer is cut off, is known by its stream.
            with contextlib.suppress(OSError, DeviceError):
                scale = look()
                try:
                    self._require_same(scale)
                except DeviceError as error:
                    self.sensor.fail(str(error).removeprefix(f"{self.source}: "))

    def _require_same(self, scale: CountScale) -> None:
        if not scale.same(self.configuration.scale):
            raise DeviceError(
                f"{self.source}: {self.configuration.scale} by its page, {scale} by its calibration"
                " now: it was set to another one, and what its counts mean is not known"
            )

    def _page_scale(self) -> CountScale:
        return self._page().scale

    def _page(self) -> BoxConfiguration:
        settings = self._settings
        line = http.client.HTTPConnection(settings.address, settings.http_port, timeout=_PATIENCE)
        with contextlib.closing(line):
            try:
                line.request("GET", PAGE)
                answer = line.getresponse()
                if answer.status != http.client.OK:
                    raise DeviceError(f"{PAGE} answers {answer.status} {answer.reason}")
                return parse_configuration(answer.read(MOST_PAGE + 1))
            except http.client.HTTPException as error:
                raise DeviceError(f"{PAGE}: no HTTP: {error or type(error).__name__}") from error

    def _calibration(self) -> CountScale:
        settings = self._settings
        port = present(settings.tcp_port, "sensor.tcp_port")
        with socket.create_connection((settings.address, port), _PATIENCE) as line:
            line.sendall(ASK_CALIBRATION)
            reply = b""
            while len(reply) < _CALIBRATION_BYTES and (more := line.recv(_CALIBRATION_BYTES)):
                reply += more
        return parse_calibration(reply)

    def _named(self, ask: Callable[[], _Answer]) -> _Answer:
        """Return an answer; a refusal names the box."""
        try:
            return ask()
        except DeviceError as error:
            raise DeviceError(f"{self.source}: {error}") from error
        except OSError as error:
            raise DeviceError(
                f"{self.source} does not answer: {error.strerror or error}"
            ) from error

    def _checked(self, found: BoxConfiguration) -> BoxConfiguration:
        """Refuse a box that is not set up for raw forces in its own frame."""
        if not found.rdt:
            raise DeviceError(f"{self.source}: RDT is switched off (page Communications)")
        wanted = self._settings.tool_transform or (0.0,) * len(found.transform)
        if found.transform != wanted:
            stated = ", ".join(f"{value:g}" for value in found.transform)
            raise DeviceError(
                f"{self.source} has the tool transform {stated}: set it to 0, or state it"
                " (key tool_transform) and give sensor.pose of the transformed frame"
            )
        if any(found.bias) and not self._settings.software_bias:
            raise DeviceError(
                f"{self.source} has a software bias, which hides the tool's weight: clear it, or"
                " allow it (software_bias: true)"
            )
        return found


@dataclass(frozen=True)
class NetFtDriver:
    """Makes sensors of ATI Net F/T boxes; see `elastocal.cell.Driver`."""

    kinds = frozenset({"sensor"})
    real = False

    def settings(self, kind: str) -> type[DeviceSettings]:  # noqa: ARG002 - the protocol's form
        """Return the settings of the sensor."""
        return NetFtSettings

    def connect(
        self,
        cell: Cell,  # noqa: ARG002 - the protocol's form
        wanted: Mapping[str, DeviceSettings],
        context: RigContext,
    ) -> DeviceSet:
        """Connect to the box; its stream begins.

        Raises
        ------
        DeviceError
            If the box does not answer, or must not be used as it is set up.
        """
        settings = of_kind(wanted["sensor"], NetFtSettings, "settings")
        line = BoxLine(settings, context.clock)
        sensor = line.sensor
        readings = (lambda: (line.reading(),)) if context.watches else None
        return DeviceSet(
            sensor=sensor, feed=sensor, close=line.close, lines=sensor.lines, readings=readings
        )


DRIVER = NetFtDriver()
"""The driver that cell files name; see `NetFtDriver`."""
