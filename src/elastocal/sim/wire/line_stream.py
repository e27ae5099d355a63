"""The simulated trackers as an adapter that sends text lines over TCP.

The format is that of docs/how-to/metrology.md. A station without a beam sends ``beam broken`` once,
or nothing at all; ``look STATION`` makes a station measure.
"""

from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.cell import BeamState, PointBlock
from elastocal.errors import DeviceError
from elastocal.sim.wire._tcp import Peer, TcpServer, probe_orientation
from elastocal.sim.wire.live_cell import LiveCell
from elastocal.sim.wire.servers import Told, serves

_MILLIMETRES = 1e3
_ALL = "tcp"
"""Name of the port that all stations share."""


@serves("line_stream")
class LineStreamServer(TcpServer):
    """Serves points of the simulated trackers.

    Parameters
    ----------
    live : LiveCell
        The cell.
    told : Told
        Settings of the driver ``line_stream``.
    unit : str
        Unit of lengths in the header; the numbers are in mm in any case.
    silent : bool
        Whether a broken beam is shown by silence.
    offset, drift : float
        The adapter's clock is ``(1 + drift) t + offset``, in s.
    """

    def __init__(
        self,
        live: LiveCell,
        told: Told,
        *,
        unit: str = "mm",
        silent: bool = False,
        offset: float = 3.2,
        drift: float = 0.0,
    ) -> None:
        places = _places(told)
        if told.settings.get("role") == "server":
            super().__init__(told.address, {}, places)
        else:
            super().__init__(told.address, {name: port for name, (_, port) in places.items()})
        self._live, self._unit, self._silent = live, unit, silent
        self.offset, self._drift = offset, drift
        self._tracker = live.metrology()
        point = told.settings.get("point") or (0.0, 0.0, 0.0)
        self._point = np.array(point, dtype=float)
        self._said: BeamState | None = None
        self.frame = "setup 1"
        """Name of the frame; a change is sent at once."""
        self._framed = ""
        self.faults: list[str] = []
        """Lines to be said next."""

    def opened(self, peer: Peer) -> None:
        """Send the names of the columns and of their frame."""
        turns = ",qx,qy,qz,qw" if self._point.any() else ""
        unit = self._unit
        self.send(
            peer,
            f"# simulated trackers\nt[s],x[{unit}],y[{unit}],z[{unit}]{turns},sigma[{unit}],"
            f"station\nframe {self.frame}\n".encode(),
        )
        self._said = None

    def received(self, peer: Peer, data: bytes) -> None:
        """Carry out ``look STATION``."""
        *lines, peer.rest = (peer.rest + data)[-4096:].split(b"\n")
        for line in lines:
            word, _, station = line.decode("ascii", errors="replace").strip().partition(" ")
            if word == "look":
                try:
                    self._tracker.look(station)
                except DeviceError as error:
                    self.send(peer, f"error {error}\n".encode())

    def tick(self) -> None:
        """Send the new points."""
        block = self._tracker.read()
        lines, self.faults = (self.faults, []) if self.peers else ([], self.faults)
        if self.frame != self._framed:
            lines.append(f"frame {self.frame}")
            self._framed = self.frame
        if block.beam is not self._said and not self._silent:
            word = "locked" if block.beam is BeamState.LOCKED else "broken"
            lines.append(f"beam {word} {block.station}")
        self._said = block.beam
        lines += self._points(block)
        data = "".join(f"{line}\n" for line in lines).encode()
        for peer in list(self.peers):
            if peer.name in (_ALL, block.station):
                self.send(peer, data)

    def _points(self, block: PointBlock) -> list[str]:
        times = (1.0 + self._drift) * block.time + self.offset
        position, turn = block.position, ""
        if self._point.any() and len(block):
            R = probe_orientation(self._live, block.station)
            position = position - R @ self._point
            turn = "".join(f",{value:.9f}" for value in Rotation.from_matrix(R).as_quat())
        return [
            f"{time:.6f},{x:.4f},{y:.4f},{z:.4f}{turn},{sigma:.4f},{block.station}"
            for time, (x, y, z), sigma in zip(
                times.tolist(),
                (_MILLIMETRES * position).tolist(),
                (_MILLIMETRES * block.sigma[:, 0]).tolist(),
                strict=True,
            )
        ]


def _places(told: Told) -> Mapping[str, tuple[str, int]]:
    """Return address and port by station, or of the port that all share."""
    stations = told.settings.get("stations") or {}
    if not isinstance(stations, Mapping):
        raise DeviceError(f"stations is {stations!r}: must be a table of stations by name")
    if not stations:
        return {_ALL: (told.address, told.port())}
    return {name: (told.address, int(station.port)) for name, station in stations.items()}
