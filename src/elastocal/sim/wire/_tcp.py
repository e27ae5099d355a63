"""A small TCP server in one thread, for simulated devices that speak in streams."""

import contextlib
import selectors
import socket
import threading
from abc import ABC, abstractmethod
from collections.abc import Mapping

from elastocal.arrays import FloatArray
from elastocal.errors import DeviceError, present
from elastocal.sim.wire.live_cell import LiveCell
from elastocal.sim.workcell import SimulatedCell

_TICK = 0.01
"""Time between two calls of `TcpServer.tick`, in s of the wall."""
_SEND_TIME = 1.0
"""A peer that does not take what is sent is dropped after this, in s."""
_RECEIVED = 65536


class Peer:
    """A connection, with the name of the port that it came by."""

    def __init__(self, name: str, line: socket.socket) -> None:
        self.name, self.line = name, line
        self.rest = b""
        """Bytes that were received and not used yet."""

    def send(self, data: bytes) -> bool:
        """Send; return whether the peer is still there."""
        with contextlib.suppress(OSError):
            self.line.sendall(data)
            return True
        return False


class TcpServer(ABC):
    """Listens at ports, and calls its hooks one at a time.

    Parameters
    ----------
    address : str
        To bind to.
    ports : mapping of str to int
        By name; 0 for any free one.
    call : mapping of str to (str, int)
        Peers to connect to, by name, where the device is the client.
    """

    def __init__(
        self,
        address: str,
        ports: Mapping[str, int],
        call: Mapping[str, tuple[str, int]] | None = None,
    ) -> None:
        self._thread = threading.Thread(target=self._run, name=type(self).__name__, daemon=True)
        self._done, self._selector = threading.Event(), selectors.DefaultSelector()
        self._call = dict(call or {})
        self.peers: list[Peer] = []
        self._listeners: dict[str, socket.socket] = {}
        for name, port in ports.items():
            try:
                listener = socket.create_server((address, port))
            except OSError as error:
                self.close()
                raise DeviceError(
                    f"cannot listen at {address}:{port}: {error.strerror or error}"
                ) from error
            self._listeners[name] = listener
            self._selector.register(listener, selectors.EVENT_READ, name)

    @property
    def ports(self) -> Mapping[str, int]:
        """The ports that were taken, by name."""
        taken = {name: int(each.getsockname()[1]) for name, each in self._listeners.items()}
        return taken or {name: port for name, (_, port) in self._call.items()}

    def close(self) -> None:
        """End the thread, and give the ports back."""
        self._done.set()
        if self._thread.is_alive():
            self._thread.join()
        for listener in self._listeners.values():
            listener.close()
        self._selector.close()

    def start(self) -> None:
        """Answer from now on."""
        self._thread.start()

    def _run(self) -> None:
        while not self._done.is_set():
            self._call_peers()
            for key, _ in self._selector.select(_TICK):
                if isinstance(key.data, Peer):
                    self._receive(key.data)
                else:
                    # A client that has gone again, or one too many for the process, is left out.
                    with contextlib.suppress(OSError):
                        line, _ = self._listeners[key.data].accept()
                        self._add(Peer(key.data, line))
            self.tick()
        for peer in list(self.peers):
            self.drop(peer)

    def _call_peers(self) -> None:
        there = {peer.name for peer in self.peers}
        for name, place in self._call.items():
            if name not in there:
                with contextlib.suppress(OSError):
                    self._add(Peer(name, socket.create_connection(place, timeout=_SEND_TIME)))

    def _add(self, peer: Peer) -> None:
        peer.line.settimeout(_SEND_TIME)
        self.peers.append(peer)
        self._selector.register(peer.line, selectors.EVENT_READ, peer)
        self.opened(peer)

    def _receive(self, peer: Peer) -> None:
        data = b""
        with contextlib.suppress(OSError):
            data = peer.line.recv(_RECEIVED)
        if data:
            self.received(peer, data)
        else:
            self.drop(peer)

    def drop(self, peer: Peer) -> None:
        """End a connection."""
        if peer in self.peers:
            self.peers.remove(peer)
            self._selector.unregister(peer.line)
            peer.line.close()

    def send(self, peer: Peer, data: bytes) -> None:
        """Send to a peer; one that does not listen is dropped."""
        if data and not peer.send(data):
            self.drop(peer)

    @abstractmethod
    def opened(self, peer: Peer) -> None:
        """Greet a new connection."""

    @abstractmethod
    def received(self, peer: Peer, data: bytes) -> None:
        """Take what a peer says."""

    @abstractmethod
    def tick(self) -> None:
        """Do the periodic work."""


def probe_orientation(live: LiveCell, station: str) -> FloatArray:
    """Return the orientation in a station's frame of a probe turned as the tool, shape (3, 3)."""

    def seen(sim: SimulatedCell) -> FloatArray:
        tracker = present(sim.tracker, "tracker of the simulated cell")
        R_base_station = tracker.T_base_station(station)[:3, :3]
        R: FloatArray = R_base_station.T @ sim.arm.state().T_base_tcp[:3, :3]
        return R

    return live.apart(seen)
