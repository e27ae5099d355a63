"""The simulated tracker with a Leica controller's protocol: emScon over TCP, one client at a time.

It is written from the public layout (sizes, offsets, numbers), not from the driver. Assumptions,
for lack of a public source: a broken beam ends the measurement, with status change 25 and an error
10004 for StartMeasurement; a search without a marker fails with 10004; a start while it measures is
answered "busy".
"""

import struct
from collections.abc import Callable, Iterator, Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.cell import BeamState, PointBlock
from elastocal.errors import DeviceError
from elastocal.sim.wire._tcp import Peer, TcpServer, probe_orientation
from elastocal.sim.wire.live_cell import LiveCell
from elastocal.sim.wire.servers import Told, serves

_OK, _BUSY, _UNKNOWN, _WRONG_PARAMETER, _NOT_INITIALIZED = 0, 1, 2, 3, 39
_NOT_READY, _MANY_CONNECTIONS = 10004, 10011
_LOST, _FOUND = 25, 27
_UNITS = (1.0, 1e3, 1e6, 1.0 / 0.3048, 1.0 / 0.9144, 1.0 / 0.0254)
"""Numbers a metre, by the number of the unit of length."""
_MILLIMETRE = 1
_REFLECTORS = ((1, "CCR-1.5in"), (2, "CCR-0.5in"), (7, "T-Mac"))
_STATIONARY, _CONTINUOUS, _PROBE = 0, 1, 7
_MOST_POINTS = 100
"""Points of a packet."""
_STATIONARY_TIME = 0.5
"""Averaging time of a stationary point, in s."""
_SIZES = {
    5: 32,
    7: 12,
    24: 16,
    26: 16,
    28: 24,
    30: 28,
    40: 16,
    42: 12,
    47: 48,
    49: 12,
    52: 12,
    54: 12,
    63: 20,
    80: 20,
}
"""Bytes of each command that is known."""


@serves("emscon")
class EmsconServer(TcpServer):
    """Answers commands, and sends points of the simulated tracker.

    Parameters
    ----------
    live : LiveCell
        The cell.
    told : Told
        Settings of the driver ``emscon``.
    initialize_time : float
        Time that the tracker takes to initialise, in s of the cell.
    """

    def __init__(self, live: LiveCell, told: Told, *, initialize_time: float = 0.5) -> None:
        super().__init__(told.address, {"tcp": _port(told)})
        self._live, self._tracker = live, live.metrology()
        self._initialize_time = initialize_time
        point = told.settings.get("point") or (0.0, 0.0, 0.0)
        self._point = np.array(point, dtype=float)
        self._faults: list[Callable[[Peer], None]] = []
        self.busy = 0
        """So many commands are answered "busy"."""
        self.refusal = 0
        """Status that the next StartMeasurement is answered with."""
        self.quality = 0
        """Quality of every point: 1 fast, 2 too fast, 3 prism error."""
        self.weather = (20.0, 1013.0, 50.0)
        """Temperature in °C, pressure in mbar, humidity in %."""
        self.units_stay = False
        """Whether it continues in mm, whatever units are requested."""
        self.mode = _STATIONARY
        self.start_anew()

    def start_anew(self) -> None:
        """Begin as after power on: clock at 0, units mm, not initialised."""
        self._zero = self._live.clock.now()
        self._initialized = self._measures = self._extended = False
        self._unit, self._since = _MILLIMETRE, 0.0
        self._later: list[tuple[float, bytes]] = []
        self._still: list[FloatArray] = []

    def say_change(self, code: int) -> None:
        """Report next that the system's state has changed."""
        self._faults.append(lambda peer: self.send(peer, _status_change(code)))

    def say_error(self, status: int) -> None:
        """Report next an error that is no answer."""
        self._faults.append(lambda peer: self.send(peer, _error(0, status)))

    def lose_power(self) -> None:
        """Restart under the client: the line drops, and all settings are lost."""

        def fault(peer: Peer) -> None:
            self.start_anew()
            self.drop(peer)

        self._faults.append(fault)

    def opened(self, peer: Peer) -> None:
        """Refuse a second client."""
        if len(self.peers) > 1:
            self.send(peer, _error(0, _MANY_CONNECTIONS))
            self.drop(peer)

    def received(self, peer: Peer, data: bytes) -> None:
        """Carry out the received command."""
        peer.rest += data
        while len(peer.rest) >= 12:
            size, kind, code = struct.unpack_from("<iii", peer.rest)
            if not 12 <= size <= 1024 or kind != 0:
                self.drop(peer)
                return
            if len(peer.rest) < size:
                return
            packet, peer.rest = peer.rest[:size], peer.rest[size:]
            for answer in self._answers(code, packet):
                self.send(peer, answer)

    def _answers(self, code: int, packet: bytes) -> list[bytes]:
        if self.busy:
            self.busy -= 1
            return [_answer(code, _BUSY)]
        if code not in _SIZES:
            return [_answer(code, _UNKNOWN)]
        if len(packet) != _SIZES[code]:
            return [_answer(code, _WRONG_PARAMETER)]
        if code == 7:
            self._initialized = True
            self._later.append((self._live.clock.now() + self._initialize_time, _answer(7, _OK)))
            return []
        if code == 42:
            return [_reflector(number, name) for number, name in _REFLECTORS]
        return [_answer(code, self._carried_out(code, packet[12:]))]

    def _carried_out(self, code: int, body: bytes) -> int:
        """Return the status of a command."""
        if code in (49, 54, 63) and not self._initialized:
            return _NOT_INITIALIZED
        if code == 49:
            return self._start()
        if code == 52:
            self._measures = False
        elif code == 63:
            return self._find()
        elif code == 5 and not self.units_stay:
            self._unit = struct.unpack_from("<i", body)[0]
            return _OK if 0 <= self._unit < len(_UNITS) else _WRONG_PARAMETER
        elif code == 24:
            self.mode = struct.unpack_from("<i", body)[0]
            return _OK if self.mode in (_STATIONARY, _CONTINUOUS, _PROBE) else _WRONG_PARAMETER
        elif code == 80:
            self._extended = struct.unpack_from("<ii", body)[1] == 1
        elif code == 40 and struct.unpack_from("<i", body)[0] not in dict(_REFLECTORS):
            return _WRONG_PARAMETER
        return _OK

    def _start(self) -> int:
        if self.refusal:
            refusal, self.refusal = self.refusal, 0
            return refusal
        if self._measures:
            return _BUSY
        if self._tracker.read().beam is BeamState.BROKEN:
            return _NOT_READY
        self._measures, self._since = True, self._live.clock.now()
        self._still = []
        return _OK

    def _find(self) -> int:
        block = self._tracker.read()
        return _NOT_READY if block.beam is BeamState.BROKEN else _OK

    def tick(self) -> None:
        """Send what is due."""
        block, now = self._tracker.read(), self._live.clock.now()
        due = [data for time, data in self._later if time <= now]
        self._later = [each for each in self._later if each[0] > now]
        faults, self._faults = (self._faults, []) if self.peers else ([], self._faults)
        if self._measures:
            due += self._measured(block, now)
        for peer in list(self.peers):
            self.send(peer, b"".join(due))
            for fault in faults:
                fault(peer)

    def _measured(self, block: PointBlock, now: float) -> list[bytes]:
        if block.beam is BeamState.BROKEN:
            self._measures = False
            return [_status_change(_LOST), _error(49, _NOT_READY)]
        if not len(block):
            return []
        if self.mode != _STATIONARY:
            return list(self._points(block))
        self._still.extend(block.position)
        if now - self._since < _STATIONARY_TIME:
            return []
        self._measures = False
        return [_status_change(_FOUND), self._single(np.array(self._still), block.sigma[-1])]

    def _points(self, block: PointBlock) -> Iterator[bytes]:
        """Yield packets of points; a clock that leaps brings more than one holds."""
        scale, probe = _UNITS[self._unit], self.mode == _PROBE
        position, rotation = block.position, b""
        if probe:
            R = probe_orientation(self._live, block.station)
            position = position - R @ self._point
            x, y, z, w = Rotation.from_matrix(R).as_quat().tolist()
            rotation = struct.pack("<14d", w, x, y, z, *[0.0] * 10)
        rows = []
        for time, place, sigma in zip(
            block.time, scale * position, scale * block.sigma, strict=True
        ):
            second, fraction = divmod(float(time) - self._zero, 1.0)
            stamp = struct.pack("<ii", int(second), int(fraction * 1e6))
            total = float(np.linalg.norm(sigma))
            values = struct.pack("<3d", *place)
            if probe or self._extended:
                values += struct.pack("<7d", *sigma, total, 0.0, 0.0, 0.0)
            between = struct.pack("<ii", 0, 1) if probe else b""
            rows.append(struct.pack("<i", self.quality) + between + stamp + values + rotation)
        kind = 5 if probe else 10 if self._extended else 3
        for first in range(0, len(rows), _MOST_POINTS):
            some = rows[first : first + _MOST_POINTS]
            head = struct.pack("<iiii", 0, len(some), self.mode, 0)
            if probe:
                head += struct.pack("<5i", 7, 0, 0, 0, 0)
            yield _packet(kind, head + struct.pack("<3d", *self.weather) + b"".join(some))

    def _single(self, positions: FloatArray, sigma: FloatArray) -> bytes:
        """Return a stationary point, the mean of some."""
        scale = _UNITS[self._unit]
        spread = positions.std(axis=0)
        values = [*positions.mean(axis=0), *spread, np.linalg.norm(spread), 0.0, 0.0, 0.0]
        values += [*sigma, np.linalg.norm(sigma)]
        lengths = [scale * float(value) for value in values]
        return _packet(2, struct.pack("<iii17d", 0, _STATIONARY, 0, *lengths, *self.weather))


def _port(told: Told) -> int:
    """Return the port of the only station."""
    stations = told.settings.get("stations") or {}
    if not isinstance(stations, Mapping):
        raise DeviceError(f"stations is {stations!r}: must be a table of stations by name")
    if len(stations) > 1:
        raise DeviceError(f"one emScon station is simulated, not {', '.join(stations)}")
    return next((int(each.port) for each in stations.values()), told.port())


def _packet(kind: int, body: bytes) -> bytes:
    return struct.pack("<ii", 8 + len(body), kind) + body


def _answer(code: int, status: int) -> bytes:
    return _packet(0, struct.pack("<ii", code, status))


def _error(code: int, status: int) -> bytes:
    return _packet(1, struct.pack("<ii", code, status))


def _status_change(code: int) -> bytes:
    return _packet(8, struct.pack("<i", code))


def _reflector(number: int, name: str) -> bytes:
    text = name.encode("utf-16-le").ljust(64, b"\0")
    return _packet(0, struct.pack("<iiiiid", 42, _OK, len(_REFLECTORS), number, 1, 0.0) + text)
