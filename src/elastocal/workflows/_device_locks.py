"""The lock of a cell's devices: of all programs and users of this machine, one talks to them."""

import contextlib
import getpass
import ipaddress
import os
import socket
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import datetime

from elastocal.cell import Cell, DevicePlace, DeviceSettings
from elastocal.errors import DeviceError
from elastocal.locks import SHARED, claim


@contextmanager
def devices_to_oneself(
    cell: Cell, devices: Mapping[str, DeviceSettings], command: str, side: str = ""
) -> Iterator[None]:
    """Lock devices for this process, against all programs and users of this machine.

    They are known by their places: cell files that name the same box exclude one another.

    Parameters
    ----------
    cell : Cell
        The cell.
    devices : mapping
        Settings by kind of device.
    command : str
        Which command has them, for others who want them.
    side : str
        ``simulated`` for a program that is the devices; empty for one that talks to them.

    Raises
    ------
    DeviceError
        If another program has one, or nothing can be locked here.
    """
    who = f"process {os.getpid()}, {_user()}, since {_now()}"
    with contextlib.ExitStack() as held:
        for key, kind in _keys(devices, side).items():
            with at_device(cell, kind):
                held.callback(_claimed(key, f"elastocal {command} {cell.path} ({who})"))
        yield


def _keys(devices: Mapping[str, DeviceSettings], side: str) -> Mapping[str, str]:
    """Return the kind of device by the name of its lock."""
    found: dict[str, str] = {}
    for kind, settings in devices.items():
        for place in settings.device_places():
            # A port that the system will choose cannot be locked.
            if place.port or not is_loopback(place.host):
                found.setdefault(f"{side} {_resolved(place)}".strip(), kind)
    return found


def _claimed(key: str, holder: str) -> Callable[[], None]:
    try:
        return claim(key, holder)
    except BlockingIOError as error:
        raise DeviceError(f"{key} is in use by {error.strerror}") from error
    except OSError as error:
        raise DeviceError(
            f"{key} cannot be locked against other programs: {error.strerror or error}:"
            f" {error.filename or SHARED}"
        ) from error


def _resolved(place: DevicePlace) -> DevicePlace:
    """Return a place with its address in numbers, where that is known."""
    with contextlib.suppress(OSError, UnicodeError):
        return place._replace(host=socket.gethostbyname(place.host))
    return place._replace(host=place.host.casefold())


def open_doors(devices: Mapping[str, DeviceSettings]) -> list[str]:
    """Return warnings of addresses that mean all addresses of this machine.

    Parameters
    ----------
    devices : mapping
        Settings by kind of device.
    """
    found = []
    for kind, settings in devices.items():
        own = [each for each in settings.own_ports() if _is_any(each.address)]
        found += [
            f"devices.{kind}.address is {each.address}: whoever is in any network of this machine"
            f" reaches the {each.kind.upper()} port {each.port}, and none of these protocols knows"
            " who speaks; name this machine's address in the device's own network"
            for each in own
        ]
        found += [
            f"devices.{kind}: the address {each.host} names no device: it stands for all addresses"
            " of this machine"
            for each in settings.device_places()
            if _is_any(each.host) and each.host not in [port.address for port in own]
        ]
    return found


def _is_any(address: str) -> bool:
    with contextlib.suppress(ValueError):
        return ipaddress.ip_address(address).is_unspecified
    return False


def is_loopback(address: str) -> bool:
    """Return whether an address is this machine's for itself."""
    with contextlib.suppress(ValueError):
        return ipaddress.ip_address(address).is_loopback
    return False


@contextmanager
def at_device(cell: Cell, kind: str) -> Iterator[None]:
    """Let refusals name the device by its key in the cell file."""
    try:
        yield
    except DeviceError as error:
        raise DeviceError(f"{cell.path}: devices.{kind}: {error}") from error


def _user() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError, ImportError):  # a user without a name
        return "unknown user"


def _now() -> str:
    return datetime.now().astimezone().isoformat(" ", "seconds")
