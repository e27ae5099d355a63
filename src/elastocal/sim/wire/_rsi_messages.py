"""Corrections of a simulated RSI context: their sum, its limits, and the stop beyond them.

The messages of RSI over Ethernet as the controller sends and reads them, by its own config file.

The file (``<ROOT>``) names the channels: ``DEF_…`` with ``INDX="INTERNAL"`` are the controller's
own (poses, axes, count of late answers), the others are ports of the ETHERNET object, whose tags
are free; ``a.b`` becomes the attribute ``b`` of an element ``a``. A channel of the answer that does
not come keeps its last value (``HOLDON="1"``) or falls to 0.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.errors import DeviceError

_CORRECTIONS = ("RKorr.X", "RKorr.Y", "RKorr.Z", "RKorr.A", "RKorr.B", "RKorr.C")


class RsiStopError(DeviceError):
    """The controller stops the arm and the RSI context; an operator must reset it."""


@dataclass(frozen=True)
class PosCorrLimits:
    """Limits in the RSI context; the defaults are the controller's, except for the lengths."""

    lower: tuple[float, float, float] = (-0.2, -0.2, -0.2)
    """LowerLimX..Z of POSCORR in m; it clamps and says nothing."""
    upper: tuple[float, float, float] = (0.2, 0.2, 0.2)
    rotation: float = math.radians(5.0)
    """MaxRotAngle of POSCORR in rad."""
    monitor_way: float = 0.25
    """MaxTrans of POSCORRMON in m; it stops the arm."""
    monitor_rotation: float = math.radians(6.0)


@dataclass
class PosCorr:
    """Sums corrections up (relative), or takes them as they are (absolute); frame Base."""

    limits: PosCorrLimits
    absolute: bool
    shift: FloatArray = field(default_factory=lambda: np.zeros(3))
    """Shape (3,), in m."""
    turn: FloatArray = field(default_factory=lambda: np.eye(3))
    """Shape (3, 3)."""

    def take(self, channels: Mapping[str, float]) -> None:
        """Take the corrections of a cycle, in mm and deg.

        Raises
        ------
        RsiStopError
            Where their sum is beyond what POSCORRMON allows.
        """
        values = np.array([channels.get(tag, 0.0) for tag in _CORRECTIONS])
        if self.absolute or np.any(values):
            way = 1e-3 * values[:3] if self.absolute else self.shift + 1e-3 * values[:3]
            self.shift = np.clip(way, self.limits.lower, self.limits.upper)
        if np.any(values[3:]) or self.absolute:
            self._turn(values[3:])
        length, angle = float(np.linalg.norm(self.shift)), _angle(self.turn)
        if length > self.limits.monitor_way or angle > self.limits.monitor_rotation:
            raise RsiStopError(
                f"KSS29000 POSCORRMON: correction {1e3 * length:.3f} mm, {math.degrees(angle):.3f}°"
                f" beyond {1e3 * self.limits.monitor_way:g} mm,"
                f" {math.degrees(self.limits.monitor_rotation):g}°"
            )

    def _turn(self, degrees: FloatArray) -> None:
        asked: FloatArray = Rotation.from_euler("ZYX", degrees, degrees=True).as_matrix()
        asked = asked if self.absolute else asked @ self.turn
        # A turn that is too large is not made smaller: the axes would not be those asked for.
        self.turn = asked if _angle(asked) <= self.limits.rotation else self.turn

    def clear(self) -> None:
        """Correct nothing; RSI_ON begins so."""
        self.shift, self.turn = np.zeros(3), np.eye(3)

    @property
    def offset(self) -> FloatArray:
        """The correction as shift (3,) over turn (3, 3), shape (4, 3)."""
        return np.vstack([self.shift, self.turn])


def _angle(turn: FloatArray) -> float:
    return math.acos(min(1.0, max(-1.0, 0.5 * (float(np.trace(turn)) - 1.0))))


LARGEST = 65536
"""Longest datagram that the controller reads, in bytes."""
_CHANNELS = 64
"""Largest number of channels in each direction."""
_KINDS = ("BOOL", "STRING", "LONG", "DOUBLE")
_POSE = ("X", "Y", "Z", "A", "B", "C")
_ARM = tuple(f"A{n}" for n in range(1, 7))
_EXTERNAL = tuple(f"E{n}" for n in range(1, 7))
_INTERNAL = {
    "RIst": _POSE, "RSol": _POSE, "AIPos": _ARM, "ASPos": _ARM, "EIPos": _EXTERNAL,
    "ESPos": _EXTERNAL, "MACur": _ARM, "MECur": _EXTERNAL, "Delay": ("D",),
    **{f"Tech.{kind}{n}": tuple(f"{kind}{n}{k}" for k in range(1, 11))
       for kind in "CT" for n in range(1, 7)},
}  # fmt: skip
"""Attributes of the channels that the controller fills in itself."""
Values = Mapping[str, float | Sequence[float]]
"""Values by tag, the internal ones without ``DEF_``; a channel that is not there is 0."""


@dataclass(frozen=True)
class Channel:
    """One ``<ELEMENT>``."""

    tag: str
    kind: str
    """BOOL, STRING, LONG or DOUBLE."""
    internal: bool
    hold: bool
    """Whether it keeps its value when no answer comes."""

    @property
    def name(self) -> str:
        """The tag without ``DEF_``."""
        return self.tag.removeprefix("DEF_") if self.internal else self.tag


@dataclass(frozen=True)
class EthernetConfig:
    """The config file of an ETHERNET object."""

    address: str
    """Address of the PC."""
    port: int
    sentype: str
    only_send: bool
    send: tuple[Channel, ...]
    receive: tuple[Channel, ...]

    @classmethod
    def from_xml(cls, text: str) -> "EthernetConfig":
        """Return the config of a file's text, as the controller reads it at RSI_CREATE.

        Raises
        ------
        DeviceError
            If it would refuse it.
        """
        try:
            root = ElementTree.fromstring(text)
        except ElementTree.ParseError as error:
            raise DeviceError(f"RSI_CREATE: the config is no XML: {error}") from error
        entries = {key: _text(root, key) for key in ("IP_NUMBER", "PORT", "SENTYPE", "ONLYSEND")}
        if root.tag != "ROOT" or not entries["PORT"].isdigit():
            raise DeviceError("RSI_CREATE: the config has no <ROOT><CONFIG> with a PORT")
        return cls(
            entries["IP_NUMBER"],
            int(entries["PORT"]),
            entries["SENTYPE"],
            entries["ONLYSEND"].upper() == "TRUE",
            _channels(root, "SEND"),
            _channels(root, "RECEIVE"),
        )

    @classmethod
    def read(cls, path: Path) -> "EthernetConfig":
        """Return the config in a file; see `from_xml`."""
        try:
            return cls.from_xml(path.read_text(encoding="utf-8-sig"))
        except OSError as error:
            raise DeviceError(f"RSI_CREATE: {path}: {error.strerror}") from error


def _text(root: ElementTree.Element, key: str) -> str:
    return (root.findtext(f"CONFIG/{key}") or "").strip()


def _channels(root: ElementTree.Element, section: str) -> tuple[Channel, ...]:
    """Return the channels of a section.

    Raises
    ------
    DeviceError
        If one is not as it must be.
    """
    found, ports = [], set()
    for element in root.findall(f"{section}/ELEMENTS/ELEMENT"):
        tag, kind, index = (element.get(key, "") for key in ("TAG", "TYPE", "INDX"))
        internal = index == "INTERNAL"
        known = tag.removeprefix("DEF_") in (*_INTERNAL, "EStr") if internal else index.isdigit()
        if not (known and kind in _KINDS and tag.startswith("DEF_") == internal):
            raise DeviceError(f"RSI_CREATE: {section}: element {tag!r} {kind!r} INDX {index!r}")
        if not internal and (index in ports or not 1 <= int(index) <= _CHANNELS):
            raise DeviceError(f"RSI_CREATE: Invalid index - signal output: {tag!r} INDX {index}")
        ports.add(index)
        found.append(Channel(tag, kind, internal, element.get("HOLDON", "0") == "1"))
    return tuple(found)


class RobWriter:
    """Writes ``<Rob>`` datagrams."""

    def __init__(self, channels: Sequence[Channel], precision: int) -> None:
        """Write such channels with so many decimals."""
        self._fields: list[tuple[str, int, bool]] = []
        elements: dict[str, list[tuple[str, str]]] = {}
        for channel in channels:
            number = f"{{:.{precision}f}}" if channel.kind == "DOUBLE" else "{:.0f}"
            attributes = _INTERNAL.get(channel.name) if channel.internal else None
            element, _, attribute = channel.name.partition(".")
            names = attributes or (attribute,)
            elements.setdefault(element, []).extend((name, number) for name in names)
            self._fields.append((channel.name, len(names), attributes is not None))
        body = "".join(_form(element, parts) for element, parts in elements.items())
        self._form = f'<Rob Type="KUKA">{body}<IPOC>{{:d}}</IPOC></Rob>'
        order = [name.partition(".")[0] for name, _, _ in self._fields]
        # Attributes of one element are written together, wherever their channels are.
        self._fields.sort(key=lambda field: order.index(field[0].partition(".")[0]))

    def write(self, values: Values, ipoc: int) -> bytes:
        """Return the datagram of a cycle."""
        numbers: list[float] = []
        for name, count, many in self._fields:
            value = values.get(name, 0.0)
            if many and isinstance(value, Sequence):
                numbers += [*value, *[0.0] * (count - len(value))]
            else:
                numbers += [value] * count if not isinstance(value, Sequence) else value[:count]
        return self._form.format(*numbers, ipoc).encode()


def _form(element: str, parts: list[tuple[str, str]]) -> str:
    """Return the format of an element: attributes, or a text where there is no attribute."""
    if parts[0][0] == "":
        return f"<{element}>{parts[0][1]}</{element}>"
    inside = " ".join(f'{name}="{number}"' for name, number in parts)
    return f"<{element} {inside}/>"


@dataclass(frozen=True)
class Answer:
    """One ``<Sen>`` datagram."""

    ipoc: int
    values: Mapping[str, float]
    """Received values by tag."""


class SenReader:
    """Reads ``<Sen>`` datagrams as the controller does: what does not fit has not come."""

    def __init__(self, channels: Sequence[Channel], sentype: str) -> None:
        """Look for such channels, in messages of such a type."""
        numbers = [c.tag for c in channels if not c.internal and c.kind != "STRING"]
        self._tags = [(tag, *tag.partition(".")[::2]) for tag in numbers]
        self._sentype = sentype

    def read(self, datagram: bytes) -> Answer | None:
        """Return the content of a datagram; None where the controller does not take it."""
        if len(datagram) > LARGEST or b"<!" in datagram:
            return None
        try:
            root = ElementTree.fromstring(datagram)
            ipoc = int(root.findtext("IPOC") or "")
        except (ElementTree.ParseError, ValueError):
            return None
        if root.tag != "Sen" or root.get("Type") != self._sentype:
            return None
        values = {}
        for tag, element, attribute in self._tags:
            found = root.find(element)
            text = None if found is None else found.get(attribute) if attribute else found.text
            number = _number(text)
            if number is not None:
                values[tag] = number
        return Answer(ipoc, values)


def _number(text: str | None) -> float | None:
    try:
        number = float(text or "")
    except ValueError:
        return None
    return number if abs(number) < float("inf") else None
