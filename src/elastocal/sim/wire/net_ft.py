"""A Net F/T box of the simulated cell: RDT, its configuration page, its TCP commands.

One client has the stream: who asked last. The page is ``/netftapi2.xml``. Of the TCP commands
READFT and READCALINFO are served, as often as a client asks on its line; writing a transform or a
threshold is refused. Not simulated: streams to another address, multi-unit synchronisation,
thresholds.
"""

import contextlib
import http
import http.server
import math
import socket
import struct
import sys
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from xml.sax.saxutils import escape

import numpy as np

from elastocal.cell import LOOPBACK, Cell, SensorStatus, WrenchBlock
from elastocal.errors import DeviceError
from elastocal.results import brief_repr
from elastocal.sim.wire._tcp import Peer, TcpServer
from elastocal.sim.wire.live_cell import LiveCell
from elastocal.sim.wire.servers import Told, bound, serves

_PAUSE = 0.002
"""Between two looks for samples, in s of the wall."""
_LISTEN = 0.05
"""Between two looks whether to go on, in s of the wall."""
_LARGEST = (1 << 31) - 1
_WRAP = 1 << 32
_MAGIC = 0x1234
_REQUEST, _RECORD = struct.Struct(">HHI"), struct.Struct(">III6i")
_COMMAND = struct.Struct(">B15xHH")
"""TCP command: code, thresholds that are meant, what the box shall do."""
_READ_FT, _READ_CALIBRATION, _WRITES = 0, 1, (2, 3)
_BIAS_BIT = 1
_SHORT = (1 << 15) - 1
"""Largest count of a READFT reply."""
_SATURATED = 0x80020000
_FORCES = {"lb": (1, 4.4482216152605), "N": (2, 1.0), "kN": (4, 1e3)}
"""Code in the calibration reply, and size in N."""
_TORQUES = {"lb-in": (1, 0.112984829027617), "N-m": (3, 1.0), "N-mm": (4, 1e-3)}
"""The same in N·m."""
_STOP, _REALTIME, _BUFFERED, _BIAS = 0x0000, 0x0002, 0x0003, 0x0042
_BUFFER = 5
"""Records of a datagram in buffered mode."""
_TICKS = 70
"""Steps of the box's own counter between two samples: it measures faster than it sends."""


@brief_repr
@dataclass
class NetFtBox:
    """Configuration and faults of a box; may be changed while it serves."""

    counts_per_force: int
    counts_per_torque: int
    force_unit: str = "N"
    torque_unit: str = "N-m"
    transform: tuple[float, ...] = (0.0,) * 6
    rdt: bool = True
    status: int = 0
    lose: int = 0
    """So many records are counted and not sent, from now on."""
    stalled: bool = False
    """Whether the box's own counter stalls."""
    bias: tuple[int, ...] = (0,) * 6
    """Bias in counts; set by the command of software bias."""
    scales: tuple[int, ...] = (0xFFFF,) * 6
    """Divisors of counts in a READFT reply, which has 16 bits for each."""

    @classmethod
    def of(cls, cell: Cell, force_unit: str = "N", torque_unit: str = "N-m") -> "NetFtBox":
        """Return a box for the sensor of a cell: a power of ten of counts, as the range allows."""
        sensor = cell.file.sensor
        if sensor is None:
            raise DeviceError(f"cell {cell.name} has no force sensor to simulate (key 'sensor')")
        force = max(sensor.force_range) / _FORCES[force_unit][1]
        torque = max(sensor.moment_range) / _TORQUES[torque_unit][1]
        counts = _counts(force), _counts(torque)
        largest = counts[0] * force, counts[1] * torque
        scales = [math.ceil(each / _SHORT) for each in largest for _ in range(3)]
        return cls(*counts, force_unit, torque_unit, scales=tuple(scales))

    def count(self, block: WrenchBlock) -> list[list[int]]:
        """Return the samples of a block in counts, bias taken off, shape (sample, 6)."""
        force = block.force * (self.counts_per_force / _FORCES[self.force_unit][1])
        torque = block.moment * (self.counts_per_torque / _TORQUES[self.torque_unit][1])
        counts = np.rint(np.concatenate([force, torque], axis=1)) - np.array(self.bias)
        found: list[list[int]] = np.clip(counts, -_LARGEST, _LARGEST).astype(int).tolist()
        return found

    def page(self, rate: float) -> bytes:
        """Return the configuration page."""
        numbers = {"cfgtfx": self.transform, "setbias": self.bias}
        texts = {
            "prodname": "Simulated Net F/T",
            "setcfgsel": "0",
            "cfgnam": "elastocal",
            "cfgcalsel": "0",
            "cfgcpf": str(self.counts_per_force),
            "cfgcpt": str(self.counts_per_torque),
            "scfgfu": self.force_unit,
            "scfgtu": self.torque_unit,
            **{key: ";".join(f"{each:g}" for each in values) for key, values in numbers.items()},
            "comrdte": "Enabled" if self.rdt else "Disabled",
            "comrdtrate": f"{rate:g}",
            "comrdtbsiz": str(_BUFFER),
            "runstat": f"{self.status:#010x}",
        }
        inner = "".join(f"<{key}>{escape(text)}</{key}>" for key, text in texts.items())
        return f'<?xml version="1.0"?><netft>{inner}</netft>'.encode()

    def calibration(self) -> bytes:
        """Return the reply to READCALINFO."""
        codes = _FORCES[self.force_unit][0], _TORQUES[self.torque_unit][0]
        counts = self.counts_per_force, self.counts_per_torque
        return struct.pack(">HBBII6H", _MAGIC, *codes, *counts, *self.scales)

    def reading(self, counts: Sequence[int], status: int) -> bytes:
        """Return the reply to READFT: counts over `scales`, the upper half of the status."""
        scaled = (each / scale for each, scale in zip(counts, self.scales, strict=True))
        short = [max(-_SHORT, min(_SHORT, round(each))) for each in scaled]
        return struct.pack(">HH6h", _MAGIC, status >> 16, *short)


def _counts(largest: float) -> int:
    """Return counts per unit: a power of ten, at most 10^6, that can count twice the range."""
    return int(min(10.0 ** math.floor(math.log10(_LARGEST / (2.0 * largest))), 1e6))


class NetFtServer:
    """A box on three ports of one address."""

    def __init__(
        self,
        live: LiveCell,
        port: int = 0,
        http_port: int = 0,
        tcp_port: int = 0,
        *,
        box: NetFtBox | None = None,
        address: str = LOOPBACK,
    ) -> None:
        """Take the ports; 0: any that is free.

        Raises
        ------
        DeviceError
            If the cell has no sensor, or a port is taken.
        """
        self.box = box or NetFtBox.of(live.cell)
        self._sensor = live.sensor()
        self._closed = threading.Event()
        self._udp = bound(socket.SOCK_DGRAM, port, address)
        self._udp.setblocking(False)
        self._tcp = _CommandServer(self, address, tcp_port)
        self._http = _PageServer(self, bound(socket.SOCK_STREAM, http_port, address))
        self._client: tuple[str, int] | None = None
        self._left: int | None = None
        """Records that the client still wants; None: all."""
        self._batch = 1
        self._waiting: list[bytes] = []
        self._rdt = self._ft = 0
        self._last, self._status = [0] * 6, 0
        self._threads = [
            threading.Thread(target=each, daemon=True) for each in (self._stream, self._serve_page)
        ]

    @property
    def port(self) -> int:
        """The UDP port."""
        return int(self._udp.getsockname()[1])

    @property
    def ports(self) -> dict[str, int]:
        """All ports, by protocol."""
        return {"udp": self.port, **self._tcp.ports, "http": int(self._http.server_address[1])}

    def start(self) -> None:
        """Answer from now on."""
        self._tcp.start()
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """Answer no more."""
        self._closed.set()
        if self._threads[0].is_alive():
            self._http.shutdown()
        self._http.server_close()
        for thread in self._threads:
            if thread.is_alive():
                thread.join(2.0)
        self._udp.close()
        self._tcp.close()

    def restart(self) -> None:
        """Forget counters and bias, as a box does that loses power; its client goes on to hear."""
        self._rdt = self._ft = 0
        self.box.bias = (0,) * 6

    def page(self) -> bytes:
        """Return the configuration page as it is now."""
        return self.box.page(self._sensor.rate)

    def _stream(self) -> None:
        while not self._closed.wait(_PAUSE):
            with contextlib.suppress(BlockingIOError, ConnectionError):
                while True:
                    self._obey(*self._udp.recvfrom(64))
            self._send(self._sensor.read())

    def _obey(self, datagram: bytes, client: tuple[str, int]) -> None:
        if len(datagram) != _REQUEST.size:
            return
        magic, command, samples = _REQUEST.unpack(datagram)
        if magic != _MAGIC:
            return
        if command == _STOP and client == self._client:
            self._client = None
        elif command in (_REALTIME, _BUFFERED):
            # The previous client of the stream is not informed.
            self._client, self._left = client, samples or None
            self._batch = _BUFFER if command == _BUFFERED else 1
            self._rdt, self._waiting = 0, []
        elif command == _BIAS:
            self._take_bias()

    def _take_bias(self) -> None:
        self.box.bias = tuple(b + c for b, c in zip(self.box.bias, self._last, strict=True))

    def answer(self, command: bytes) -> bytes:
        """Return the reply to a TCP command; nothing to an invalid one."""
        code, _, orders = _COMMAND.unpack(command)
        if code == _READ_CALIBRATION:
            return self.box.calibration()
        if code == _READ_FT:
            reply = self.box.reading(self._last, self._status)
            if orders & _BIAS_BIT:
                self._take_bias()
            return reply
        # Header, echo of the command, and 1 for not done.
        return struct.pack(">HBB", _MAGIC, code, 1) if code in _WRITES else b""

    def _send(self, block: WrenchBlock) -> None:
        status = self.box.status
        if block.status is SensorStatus.SATURATED:
            status |= _SATURATED
        self._status = status
        for counts in self.box.count(block):
            self._last = counts
            self._ft += 0 if self.box.stalled else _TICKS
            if self._client is None:
                continue
            self._rdt += 1
            if self.box.lose:
                self.box.lose -= 1
                continue
            ticks = self._rdt % _WRAP, self._ft % _WRAP
            self._waiting.append(_RECORD.pack(*ticks, status, *counts))
            self._left = None if self._left is None else self._left - 1
            if len(self._waiting) >= self._batch or self._left == 0:
                with contextlib.suppress(OSError):
                    self._udp.sendto(b"".join(self._waiting), self._client)
                self._waiting = []
            if self._left == 0:
                self._client = None

    def _serve_page(self) -> None:
        self._http.serve_forever(poll_interval=_LISTEN)


class _CommandServer(TcpServer):
    """Answers TCP commands, each of a fixed size, as often as they come on a line."""

    def __init__(self, server: NetFtServer, address: str, port: int) -> None:
        super().__init__(address, {"tcp": port})
        self._server = server

    def opened(self, peer: Peer) -> None:
        """Send nothing: the client begins."""

    def received(self, peer: Peer, data: bytes) -> None:
        """Answer all commands that are complete."""
        peer.rest += data
        while len(peer.rest) >= _COMMAND.size:
            command, peer.rest = peer.rest[: _COMMAND.size], peer.rest[_COMMAND.size :]
            self.send(peer, self._server.answer(command))

    def tick(self) -> None:
        """Do nothing periodically."""


class _PageServer(http.server.ThreadingHTTPServer):
    """Serves the configuration page, on a socket that is bound already."""

    daemon_threads = True

    def __init__(self, server: NetFtServer, line: socket.socket) -> None:
        super().__init__(line.getsockname(), _PageHandler, bind_and_activate=False)
        self.socket.close()
        self.socket, self.box_server = line, server
        self.server_address = line.getsockname()
        self.server_activate()

    def handle_error(
        self, request: socket.socket | tuple[bytes, socket.socket], client_address: object
    ) -> None:
        """Ignore a client that disconnects; other errors are raised."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)


class _PageHandler(http.server.BaseHTTPRequestHandler):
    """Answers one request."""

    server: _PageServer
    timeout = 2.0

    def do_GET(self) -> None:
        """Answer with the page for any index."""
        if self.path.partition("?")[0] != "/netftapi2.xml":
            self.send_error(http.HTTPStatus.NOT_FOUND)
            return
        page = self.server.box_server.page()
        self.send_response(http.HTTPStatus.OK)
        self.send_header("Content-Type", "text/xml")
        self.send_header("Content-Length", str(len(page)))
        self.end_headers()
        self.wfile.write(page)

    def log_message(self, format: str, *args: object) -> None:
        """Log nothing."""


@serves("net_ft")
def net_ft_server(live: LiveCell, told: Told) -> NetFtServer:
    """Return the box that a cell file describes."""
    return NetFtServer(live, told.port(), told.port("http_port"), told.port("tcp_port"))
