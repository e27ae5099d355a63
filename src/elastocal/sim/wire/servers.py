"""Table of servers by the driver that connects to them; each module here registers its own.

A server makes a `LiveCell` available to its clients, in threads of its own, from `start` to
`close`.
"""

import importlib
import pkgutil
import socket
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

from elastocal.cell import LOOPBACK
from elastocal.errors import DeviceError
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.sim.wire.live_cell import LiveCell


@brief_repr
@dataclass(frozen=True)
class Told:
    """Settings of the devices of a driver in the cell file, for its server."""

    address: str = LOOPBACK
    """Address to bind to."""
    settings: Mapping[str, object] = field(default_factory=dict)
    """Keys and values in SI, those of all kinds of device that the driver makes."""

    def port(self, key: str = "port") -> int:
        """Return the port under a key; 0, any free port, if there is none."""
        port = self.settings.get(key, 0)
        if not (isinstance(port, int) and 0 <= port <= 65535):
            raise DeviceError(f"{key} is {port!r}: must be 0 to 65535")
        return port


class WireServer(Protocol):
    """A server of one device family."""

    @property
    def ports(self) -> Mapping[str, int]:
        """The ports that it took, by protocol (``udp``, ``tcp``, ``http``), the main one first."""

    def start(self) -> None:
        """Answer from now on."""

    def close(self) -> None:
        """Answer no more, and give the ports back."""


MakeServer = Callable[[LiveCell, Told], WireServer]
SERVERS: dict[str, MakeServer] = {}
"""Functions that make a server, by the name of the driver that connects to it; see
`wire_servers`."""
_TAKES: dict[str, Callable[[Robot], bool]] = {}
"""Whether the line of a server can carry a robot, where not every one."""
_Make = TypeVar("_Make", bound=MakeServer)


def serves(driver: str, takes: Callable[[Robot], bool] | None = None) -> Callable[[_Make], _Make]:
    """Register what makes the server of a driver.

    Parameters
    ----------
    driver : str
        Name of the driver, as cell files have it.
    takes : callable
        Whether its line can carry a robot; every one by default.
    """

    def register(make: _Make) -> _Make:
        SERVERS[driver] = make
        if takes is not None:
            _TAKES[driver] = takes
        return make

    return register


def wire_servers() -> Mapping[str, MakeServer]:
    """Return the table, every module of this package in it."""
    package = importlib.import_module("elastocal.sim.wire")
    for module in pkgutil.iter_modules(package.__path__):
        importlib.import_module(f"{package.__name__}.{module.name}")
    return SERVERS


def suited_servers(robot: Robot) -> tuple[str, ...]:
    """Return the names of all servers whose line can carry a robot."""
    return tuple(name for name in wire_servers() if name not in _TAKES or _TAKES[name](robot))


def bound(kind: socket.SocketKind, port: int, address: str = LOOPBACK) -> socket.socket:
    """Return a socket that has a port.

    Parameters
    ----------
    kind : SocketKind
        ``SOCK_DGRAM`` or ``SOCK_STREAM``.
    port : int
        0: any that is free.
    address : str
        Address of this machine.

    Raises
    ------
    DeviceError
        If it is taken.
    """
    line = socket.socket(socket.AF_INET, kind)
    try:
        if kind == socket.SOCK_STREAM:
            line.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        line.bind((address, port))
    except OSError as error:
        line.close()
        raise DeviceError(f"cannot take port {port} of {address}: {error.strerror}") from error
    return line
