"""Faults on the lines between a run and its devices, made by whoever stands in between.

A `DatagramProxy` or a `StreamProxy` passes on what it is given; once a damage is
set it does to the data what a fault does. Neither the product nor its simulators take part: what
they send is damaged on the way.
"""

import re
import select
import socket
import struct
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

_RECORD = struct.Struct(">III6i")
_START = struct.pack(">HHI", 0x1234, 2, 0)
_LOOK = 0.02
Damage = Callable[[bytes], list[bytes]]
"""What becomes of a message: none, itself, another one, several."""


def pass_on(data: bytes) -> list[bytes]:
    return [data]


def lose(_: bytes) -> list[bytes]:
    return []


def garble(data: bytes) -> list[bytes]:
    """Return as many bytes that mean nothing."""
    return [np.random.default_rng(len(data)).bytes(len(data))]


@dataclass
class Thin:
    """Lets one of so many messages pass."""

    every: int
    _count: int = field(default=0)

    def __call__(self, data: bytes) -> list[bytes]:
        self._count += 1
        return [data] if self._count % self.every == 0 else []


def each_record(change: Callable[[list[int]], list[int]]) -> Damage:
    """Return what changes the records of a Net F/T box: sequence, its own, status, six counts."""

    def damage(data: bytes) -> list[bytes]:
        if len(data) % _RECORD.size:
            return [data]
        records = [change(list(each)) for each in _RECORD.iter_unpack(data)]
        return [b"".join(_RECORD.pack(*each) for each in records)]

    return damage


def bad_status(record: list[int]) -> list[int]:
    return [*record[:2], 0x80004000, *record[3:]]


def as_pounds(record: list[int]) -> list[int]:
    return [*record[:3], *(int(count / 4.448) for count in record[3:])]


def at_the_stop(record: list[int]) -> list[int]:
    """Return what a box says that cannot say NaN: the smallest number there is."""
    return [*record[:3], *(-(1 << 31),) * 6]


@dataclass
class Begun:
    """Counts from one again, as a box does that lost its power."""

    _number: int = 0

    def __call__(self, record: list[int]) -> list[int]:
        self._number += 1
        return [self._number, 70 * self._number, *record[2:]]


def not_a_number(data: bytes) -> list[bytes]:
    """Return a text whose first vector has no number: of the tool, or of the marker."""
    if b"<RIst" in data:
        return [re.sub(rb'<RIst X="[^"]*"', b'<RIst X="nan"', data)]
    return [re.sub(rb"(?m)^([0-9.]+),[-0-9.]+,", rb"\1,nan,", data)]


def in_metres(data: bytes) -> list[bytes]:
    """Return a text with lengths a thousandth of what they were."""

    def less(found: re.Match[bytes]) -> bytes:
        return found[1] + b"%.6f" % (float(found[2]) / 1e3)

    if b"<RIst" in data:
        head, rest = data.split(b"<RSol", 1)
        return [re.sub(rb'([XYZ]=")([-0-9.]+)', less, head) + b"<RSol" + rest]
    lines = []
    for line in data.split(b"\n"):
        parts = line.split(b",")
        if len(parts) > 4 and parts[0][:1].isdigit():
            parts[1:4] = [b"%.7f" % (float(each) / 1e3) for each in parts[1:4]]
        lines.append(b",".join(parts))
    return [b"\n".join(lines)]


class DatagramProxy:
    """Stands between two ends that talk in datagrams; whoever speaks first is answered."""

    def __init__(self, back: int, front: int = 0) -> None:
        self.from_device = self.to_device = pass_on
        """Damage to what the end behind says, and to what it is told."""
        self._front, self._back = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in "12")
        self._front.bind(("127.0.0.1", front))
        self._back.bind(("127.0.0.1", 0))
        self._behind, self._before = ("127.0.0.1", back), ("127.0.0.1", 0)
        self.port = self._front.getsockname()[1]
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._pump, daemon=True)
        self._thread.start()

    def _pump(self) -> None:
        while not self._closed.is_set():
            ready, _, _ = select.select([self._front, self._back], [], [], _LOOK)
            for line in ready:
                try:
                    data, sender = line.recvfrom(65_536)
                except OSError:
                    continue
                if line is self._front:
                    self._before = sender
                    for each in self.to_device(data):
                        self._back.sendto(each, self._behind)
                else:
                    for each in self.from_device(data):
                        self._front.sendto(each, self._before)

    def close(self) -> None:
        self._closed.set()
        self._thread.join(2.0)
        self._front.close()
        self._back.close()


class StreamProxy:
    """Stands between a client and a server that talk over TCP."""

    def __init__(self, back: int, front: int = 0) -> None:
        self.from_device = pass_on
        self._behind = ("127.0.0.1", back)
        self._listener = socket.create_server(("127.0.0.1", front))
        self.port = self._listener.getsockname()[1]
        self._pairs: list[tuple[socket.socket, socket.socket]] = []
        self._closed, self._gone, self._hung_up = (threading.Event() for _ in range(3))
        self._thread = threading.Thread(target=self._pump, daemon=True)
        self._thread.start()

    def hang_up(self) -> None:
        """Close what is open; who calls again is answered."""
        self._hung_up.set()

    def go(self) -> None:
        """Close what is open, and the port."""
        self._gone.set()

    def come_back(self) -> None:
        """Pass everything on again, at the same port."""
        self.from_device = pass_on
        if self._gone.is_set():
            while self._listener.fileno() >= 0:
                time.sleep(_LOOK)
            self._gone.clear()
            self._listener = socket.create_server(("127.0.0.1", self.port))

    def _pump(self) -> None:
        while not self._closed.is_set():
            if self._gone.is_set() and self._listener.fileno() >= 0:
                self._listener.close()
                self._hung_up.set()
            if self._hung_up.is_set():
                self._hung_up.clear()
                self._drop(self._pairs)
            listening = [self._listener] if self._listener.fileno() >= 0 else []
            ends = [line for pair in self._pairs for line in pair]
            ready, _, _ = select.select([*listening, *ends], [], [], _LOOK)
            if self._listener in ready:
                client, _ = self._listener.accept()
                self._pairs.append((client, socket.create_connection(self._behind)))
            for pair in [pair for pair in self._pairs if pair[0] in ready or pair[1] in ready]:
                self._pass(pair, ready)

    def _pass(self, pair: tuple[socket.socket, socket.socket], ready: list[socket.socket]) -> None:
        client, server = pair
        for line, other, damage in (
            (client, server, pass_on),
            (server, client, self.from_device),
        ):
            if line not in ready:
                continue
            try:
                data = line.recv(65_536)
                for each in damage(data) if data else ():
                    other.sendall(each)
            except OSError:
                data = b""
            if not data:
                self._drop([pair])
                return

    def _drop(self, pairs: list[tuple[socket.socket, socket.socket]]) -> None:
        for pair in list(pairs):
            self._pairs.remove(pair)
            for line in pair:
                line.close()

    def close(self) -> None:
        self._closed.set()
        self._thread.join(2.0)
        self._listener.close()
        self._drop(self._pairs)


def steal(port: int) -> None:
    """Ask a Net F/T box for its stream, as a second client does."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        line.sendto(_START, ("127.0.0.1", port))


def intrude(port: int, count: int = 50) -> None:
    """Send telegrams to a PC as a second controller does."""
    telegram = b'<Rob Type="KUKA"><RIst X="9" Y="9" Z="9" A="0" B="0" C="0"/><IPOC>4</IPOC></Rob>'
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        for _ in range(count):
            line.sendto(telegram, ("127.0.0.1", port))
