"""The C program for a real-time Linux: RSI and Net F/T around the exported compensator.

Addresses and limits are in one generated header; the rest is the C of ``templates/linux``,
unchanged.
"""

import ipaddress
import math
from dataclasses import dataclass

from elastocal import __version__
from elastocal.compensation.export._constants import remark
from elastocal.compensation.export.writer import filled
from elastocal.compensation.online import Design
from elastocal.errors import CompensationError
from elastocal.results import brief_repr

LINUX_FILES = (
    "elastocal_live.c",
    "live_held.c",
    "live_held.h",
    "live_wire.c",
    "live_wire.h",
    "live_config.h",
)
"""The program; `Makefile` and `LIVE.md` are beside it."""
_PRIORITY = 70


@brief_repr
@dataclass(frozen=True)
class LinuxTarget:
    """Addresses and limits of a cell, for the program; SI."""

    cell: str
    """Name of the cell."""
    rsi: tuple[str, int]
    """Own address and port, to which the controller sends."""
    controller: str
    """Address of the controller; other senders are not answered."""
    sentype: str
    timeout: int
    """Cycles without an answer after which the controller stops."""
    sensor: tuple[str, int, int]
    """Address of the Net F/T, its UDP port, its TCP port for the calibration."""
    external: int
    """Joints of the model that are external axes; they come first."""
    scale: tuple[float, ...]
    """Factors from the controller's mm and deg to each joint, in m and rad."""
    correction: float
    """Largest, in m."""
    rate: float
    """In m/s."""
    delay: float
    """Largest time from a correction to its motion, in s."""

    def __post_init__(self) -> None:
        """Refuse an invalid address, since it becomes a text in C.

        Raises
        ------
        CompensationError
            With the address.
        """
        for address in (self.rsi[0], self.controller, self.sensor[0]):
            try:
                ipaddress.IPv4Address(address)
            except ValueError as error:
                raise CompensationError(
                    f"address {address!r} must be numbers, such as 192.168.10.5: the program asks"
                    " no name server"
                ) from error


def linux_files(numbers: Design, target: LinuxTarget) -> dict[str, str]:
    """Return the files of the program, by name; `c_files` has those of the model.

    Parameters
    ----------
    numbers : Design
        The compensator.
    target : LinuxTarget
        The cell.
    """
    settings = numbers.settings
    sample = numbers.filters.sample
    values = {
        "VERSION": __version__,
        "CELL": remark(target.cell),
        "ROBOT": remark(numbers.calibrated.model.robot.name),
        "RSI_ADDRESS": target.rsi[0],
        "RSI_PORT": str(target.rsi[1]),
        "ROBOT_ADDRESS": target.controller,
        "SENTYPE": target.sentype,
        "TIMEOUT": str(target.timeout),
        "DELAY_CYCLES": str(math.ceil(target.delay / settings.cycle)),
        "FT_ADDRESS": target.sensor[0],
        "FT_PORT": str(target.sensor[1]),
        "FT_TCP_PORT": str(target.sensor[2]),
        "EVERY_RECORD": str(int(sample < settings.cycle)),
        "LARGEST": repr(target.correction),
        "STEP": repr(target.rate * settings.cycle),
        "FADE_STEP": repr(numbers.fade_step),
        "EXTERNAL": str(target.external),
        "SCALE": ", ".join(repr(each) for each in target.scale),
        "CYCLE_MS": f"{1e3 * settings.cycle:g}",
        "SAMPLE_MS": f"{1e3 * sample:g}",
        "LARGEST_MM_CELL": f"{1e3 * target.correction:g}",
        "RATE_MM_CELL": f"{1e3 * target.rate:g}",
        "HOLD_MS": f"{1e3 * settings.hold:g}",
        "FADE_MM": f"{1e3 * settings.limits.fade:g}",
        "PRIORITY": str(_PRIORITY),
    }
    names = (*LINUX_FILES, "Makefile", "LIVE.md")
    return {name: filled(f"linux/{name}", values) for name in names}
