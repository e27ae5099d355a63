"""Messages of a Net F/T box: RDT requests and records, status, configuration.

Layouts: ATI manual 9620-05-NET FT, as the public programs pynetft, netft_utils, ati_netft_ros2 and
NetFT agree on them. Everything is big-endian.
"""

import math
import re
import struct
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

from elastocal.cell import SensorStatus
from elastocal.errors import DeviceError
from elastocal.results import brief_repr

PAGE = "/netftapi2.xml"
"""Path of the configuration page."""
ASK_CALIBRATION = struct.pack(">B19x", 1)
"""Command READCALINFO of the TCP interface."""
MOST_PAGE = 65536
"""Largest configuration page that is read, in bytes."""
_MAGIC = 0x1234
_REQUEST = struct.Struct(">HHI")
_RECORD = struct.Struct(">III6i")
_CALIBRATION = struct.Struct(">HBBII6H")
_MOST_RECORDS = 40
"""Records of a buffered datagram."""

_POUND = 4.4482216152605
"""A pound-force in N (exact: 0.45359237 kg times 9.80665 m/s²)."""
_KILOGRAM, _INCH, _FOOT = 9.80665, 0.0254, 0.3048
_FORCES = {
    **{"n": 1.0, "kn": 1e3, "lb": _POUND, "lbf": _POUND, "lbs": _POUND},
    **{"klb": 1e3 * _POUND, "klbf": 1e3 * _POUND, "kg": _KILOGRAM, "kgf": _KILOGRAM},
    **{"g": 1e-3 * _KILOGRAM, "gf": 1e-3 * _KILOGRAM},
}
"""Factors to N, by unit without hyphens and capitals."""
_TORQUES = {
    **{"nm": 1.0, "nmm": 1e-3, "knm": 1e3, "kgcm": 1e-2 * _KILOGRAM, "kgfcm": 1e-2 * _KILOGRAM},
    **{"lbin": _POUND * _INCH, "lbfin": _POUND * _INCH, "inlb": _POUND * _INCH},
    **{"lbft": _POUND * _FOOT, "lbfft": _POUND * _FOOT, "ftlb": _POUND * _FOOT},
}
"""Factors to N·m, by unit without hyphens and capitals."""
_FORCE_CODES = ("", "lb", "N", "klb", "kN", "kg", "g")
_TORQUE_CODES = ("", "lb-in", "lb-ft", "N-m", "N-mm", "kg-cm", "kN-m")

_SATURATION, _LATCH, _SUMMARY = 0x00020000, 0x00010000, 0x80000000
_STATUS = {
    _SUMMARY: "error",
    0x40000000: "CPU or RAM",
    0x20000000: "digital board",
    0x10000000: "analog board",
    0x08000000: "serial link",
    0x04000000: "program memory",
    0x02000000: "halted by its configuration",
    0x01000000: "settings",
    0x00800000: "configuration does not fit calibration",
    0x00400000: "network",
    0x00200000: "CAN",
    0x00100000: "RDT",
    0x00080000: "EtherNet/IP",
    0x00040000: "DeviceNet",
    _SATURATION: "gauge saturated",
    _LATCH: "threshold latched",
    0x4000: "watchdog",
    0x2000: "stack",
    0x1000: "EEPROM",
    0x0800: "flash",
    0x0400: "analog watchdog",
    0x0200: "strain current too high",
    0x0100: "strain current too low",
    0x0080: "analog ground",
    0x0040: "supply too high",
    0x0020: "supply too low",
    0x0010: "serial data",
    0x0008: "reference",
    0x0004: "temperature",
    0x0002: "HTTP",
}


class Command(IntEnum):
    """RDT commands. Software bias (0x42) is not among them: it would hide the tool's weight."""

    STOP = 0x0000
    START = 0x0002
    """One record a datagram, as they are measured."""


def request(command: Command, samples: int = 0) -> bytes:
    """Return the datagram of a command.

    Parameters
    ----------
    command : Command
        What to do.
    samples : int
        How many records; 0: until `Command.STOP`.
    """
    return _REQUEST.pack(_MAGIC, command, samples)


class RdtRecord(NamedTuple):
    """One sample."""

    rdt_sequence: int
    """Number within the stream; a gap is a loss."""
    ft_sequence: int
    """The box's own counter of samples."""
    status: int
    counts: tuple[int, ...]
    """Fx, Fy, Fz, Tx, Ty, Tz."""


def parse_records(datagram: bytes) -> list[RdtRecord]:
    """Return the records of a datagram.

    Raises
    ------
    DeviceError
        If it is no whole number of records.
    """
    if not 0 < len(datagram) <= _MOST_RECORDS * _RECORD.size or len(datagram) % _RECORD.size:
        raise DeviceError(f"a datagram of {len(datagram)} bytes: must be records of 36")
    return [
        RdtRecord(rdt, ft, status, tuple(counts))
        for rdt, ft, status, *counts in _RECORD.iter_unpack(datagram)
    ]


def status_names(status: int) -> str:
    """Return the meaning of a status word, by name.

    >>> status_names(0x80020000)
    '0x80020000: error, gauge saturated'
    """
    names = [name for bit, name in _STATUS.items() if status & bit]
    return f"{status:#010x}: {', '.join(names) or 'a bit without a name' if status else 'ok'}"


def status_of(status: int) -> SensorStatus:
    """Return the meaning of a status word for the sample that bears it.

    A latched threshold alone is a remark. A saturated gauge spoils the sample, anything else the
    sensor.
    """
    if status in (0, _SUMMARY | _LATCH):
        return SensorStatus.OK
    if status & _SATURATION and not status & ~(_SUMMARY | _LATCH | _SATURATION):
        return SensorStatus.SATURATED
    return SensorStatus.FAULT


@dataclass(frozen=True)
class CountScale:
    """Counts per unit, and the units."""

    counts_per_force: float
    counts_per_torque: float
    force_unit: str
    torque_unit: str

    def __post_init__(self) -> None:
        for name, value in (("force", self.counts_per_force), ("torque", self.counts_per_torque)):
            if not 0.0 < value < math.inf:
                raise DeviceError(f"counts per unit of {name} are {value!r}: must be above 0")
        for name, unit, known in (
            ("force", self.force_unit, _FORCES),
            ("torque", self.torque_unit, _TORQUES),
        ):
            if _plain(unit) not in known:
                raise DeviceError(f"unit of {name} is {unit!r} (known: {', '.join(known)})")

    @property
    def force(self) -> float:
        """A count of a force in N."""
        return _FORCES[_plain(self.force_unit)] / self.counts_per_force

    @property
    def moment(self) -> float:
        """A count of a torque in N·m."""
        return _TORQUES[_plain(self.torque_unit)] / self.counts_per_torque

    def same(self, other: "CountScale") -> bool:
        """Return whether a count means the same."""
        return math.isclose(self.force, other.force, rel_tol=1e-6) and math.isclose(
            self.moment, other.moment, rel_tol=1e-6
        )

    def __str__(self) -> str:
        force, torque = f"{self.counts_per_force:g}", f"{self.counts_per_torque:g}"
        return f"{force} counts a {self.force_unit}, {torque} counts a {self.torque_unit}"


def _plain(unit: str) -> str:
    return re.sub(r"[^a-z]", "", unit.lower())


@brief_repr
@dataclass(frozen=True)
class BoxConfiguration:
    """Content of the configuration page."""

    product: str
    calibration: str
    """Name of the active configuration."""
    scale: CountScale
    transform: tuple[float, ...]
    """Tool transform: shifts and turns, in the page's units; all 0: none."""
    bias: tuple[float, ...]
    """Software bias, in counts; all 0: none."""
    rate: float | None
    """RDT records a second; None where the page does not say."""
    rdt: bool
    """Whether RDT is switched on."""


def parse_configuration(page: bytes) -> BoxConfiguration:
    """Return the content of a configuration page.

    Raises
    ------
    DeviceError
        If it is none, holds entities, or lacks counts or units.
    """
    if len(page) > MOST_PAGE:
        raise DeviceError(f"a configuration page above {MOST_PAGE} bytes")
    text = page.decode("utf-8", "replace")
    if "<!" in re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL):
        raise DeviceError("a configuration page with a document type: is not read")
    try:
        root = ET.fromstring(text)
    except (ET.ParseError, ValueError) as error:
        raise DeviceError(f"a configuration page that is no XML: {error}") from error
    found = {each.tag.rpartition("}")[2].lower(): (each.text or "").strip() for each in root.iter()}
    return BoxConfiguration(
        product=found.get("prodname", ""),
        calibration=found.get("cfgnam", ""),
        scale=CountScale(
            _positive(found, "cfgcpf"),
            _positive(found, "cfgcpt"),
            found.get("scfgfu", ""),
            found.get("scfgtu", ""),
        ),
        transform=_all_numbers(found, "cfgtfx"),
        bias=_all_numbers(found, "setbias"),
        rate=_positive(found, "comrdtrate") if "comrdtrate" in found else None,
        rdt=found.get("comrdte", "").casefold() not in ("disabled", "off", "0"),
    )


def _positive(found: dict[str, str], key: str) -> float:
    try:
        return float(found[key])
    except (KeyError, ValueError) as error:
        text = found.get(key)
        raise DeviceError(f"configuration page: {key} is {text!r}: must be a number") from error


def _all_numbers(found: dict[str, str], prefix: str) -> tuple[float, ...]:
    """Return the numbers of an element, or of several that are numbered; none counts as none."""
    texts = [text for tag, text in sorted(found.items()) if re.fullmatch(rf"{prefix}\d*", tag)]
    try:
        return tuple(float(each) for text in texts for each in re.split(r"[;,\s]+", text) if each)
    except ValueError as error:
        raise DeviceError(f"configuration page: {prefix} is {texts}: must be numbers") from error


def parse_calibration(reply: bytes) -> CountScale:
    """Return the content of the reply to `ASK_CALIBRATION`.

    Raises
    ------
    DeviceError
        If it is no such reply.
    """
    if len(reply) != _CALIBRATION.size:
        raise DeviceError(f"a calibration of {len(reply)} bytes: must be {_CALIBRATION.size}")
    magic, force, torque, counts_per_force, counts_per_torque, *_ = _CALIBRATION.unpack(reply)
    if magic != _MAGIC:
        raise DeviceError(f"a calibration that begins with {magic:#06x}: must be {_MAGIC:#06x}")
    if not (0 < force < len(_FORCE_CODES) and 0 < torque < len(_TORQUE_CODES)):
        raise DeviceError(f"a calibration in units {force} and {torque}: must be 1 to 6")
    units = _FORCE_CODES[force], _TORQUE_CODES[torque]
    return CountScale(float(counts_per_force), float(counts_per_torque), *units)
