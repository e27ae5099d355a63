"""The packets of emScon TPI 3: little-endian, 4-byte alignment, each preceded by its size.

Clean-room: sizes, offsets and numbers are those on which public programs and the published layout
agree (see docs/references.md); no line of a vendor's header is here. Every packet is ``int32 size,
int32 type`` and the fields of the type.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.errors import DeviceError
from elastocal.results import brief_repr

LARGEST_PACKET = 65536
"""In bytes; a larger size is invalid."""
_HEAD = 8
_COMMAND, _ERROR, _MULTI, _PROBE, _STATUS_CHANGE, _MULTI_2 = 0, 1, 3, 5, 8, 10


class Code(IntEnum):
    """Commands that we use."""

    SET_UNITS = 5
    INITIALIZE = 7
    SET_MEASUREMENT_MODE = 24
    SET_COORDINATE_SYSTEM = 26
    SET_CONTINUOUS_TIME = 30
    SET_REFLECTOR = 40
    GET_REFLECTORS = 42
    SET_SYSTEM_SETTINGS = 47
    START_MEASUREMENT = 49
    STOP_MEASUREMENT = 52
    GO_BIRD_BATH = 54
    FIND_REFLECTOR = 63
    SET_STATISTIC_MODE = 80


class Mode(IntEnum):
    """Modes of measurement in which points stream."""

    CONTINUOUS_TIME = 1
    PROBE_CONTINUOUS_TIME = 7


STATUS_TEXTS = {
    1: "the server is busy with another command",
    2: "it does not know the command",
    3: "a parameter is wrong",
    23: "another reflector is on than the one that is set",
    27: "no weather station is found",
    35: "it is in use",
    37: "no distance is set: put the reflector into the bird bath",
    38: "no tracker is connected to its controller",
    39: "the tracker is not initialised",
    40: "a module of the server does not start",
    41: "a module of the server does not answer",
    57: "temperature, pressure or humidity is out of range",
    75: "no 6D probe is found",
    76: "no 6D probe is active",
    92: "6D is not allowed in this mode",
    93: "the 6D result is bad",
    94: "the weather station gives no temperature",
    95: "the weather station gives no pressure",
    96: "the weather station gives no humidity",
    10004: "the tracker is not ready to measure",
    10005: "the distance meter is still starting",
    10010: "the tracker is not level",
    10011: "another program holds the tracker, which takes one connection: close that program",
    10012: "the tracker is not warm yet",
    10013: "the tracker does not stand still",
    10014: "the tracker is not ready to measure",
    10015: "the controller has lost the tracker",
}
"""Statuses of answers, in words; not all that there are."""


def status_text(status: int) -> str:
    """Return the meaning of a status, with its number."""
    return f"{STATUS_TEXTS.get(status, 'it refuses')} (status {status})"


@dataclass(frozen=True)
class Answer:
    """The answer to a command."""

    command: int
    status: int


@dataclass(frozen=True)
class Reflector(Answer):
    """One of the reflectors that the tracker knows; each comes in an answer of its own."""

    total: int
    """Number of answers that follow."""
    number: int
    """Number by which the parameter is set."""
    name: str


@dataclass(frozen=True)
class Complaint:
    """Error that was not an answer, such as a broken beam."""

    command: int
    status: int


@dataclass(frozen=True)
class StatusChange:
    """A change of the system's state."""

    code: int


@brief_repr
@dataclass(frozen=True, eq=False)
class MeasuredPoints:
    """Points of a continuous measurement."""

    status: int
    """Status of the packet."""
    temperature: float
    """In °C."""
    pressure: float
    """In mbar."""
    humidity: float
    """In %."""
    quality: IndexArray
    """Shape (point,): 0 good, 1 fast, 2 too fast, 3 prism error, 4 trigger violated."""
    stamp: FloatArray
    """Shape (point,), in s of the tracker's clock."""
    position: FloatArray
    """Shape (point, 3), in m."""
    sigma: FloatArray
    """Shape (point, 3), in m; NaN where the mode states none."""
    quaternion: FloatArray | None
    """Orientations of a 6D probe, scalar first, shape (point, 4)."""
    rotation_status: IndexArray | None
    """Rotation status of a 6D probe, bits, shape (point,)."""


Packet = Answer | Complaint | StatusChange | MeasuredPoints


def command(code: Code, *values: float, form: str = "") -> bytes:
    """Return the packet of a command.

    Parameters
    ----------
    code : Code
        The command.
    *values : float
        Its parameters.
    form : str
        Their `struct` format: ``i`` for whole numbers and flags, ``d`` for the others.
    """
    body = struct.pack(f"<{form}", *values)
    return struct.pack("<iii", _HEAD + 4 + len(body), _COMMAND, code) + body


class PacketReader:
    """Reader of packets from the bytes of a connection; keeps no more than one packet."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> Iterator[Packet]:
        """Yield the packets that are whole now; types that we do not use are left out.

        Raises
        ------
        DeviceError
            If the bytes are no packets.
        """
        self._rest += data
        while len(self._rest) >= _HEAD:
            size, kind = struct.unpack_from("<ii", self._rest)
            if not _HEAD <= size <= LARGEST_PACKET:
                self._rest = b""
                raise DeviceError(f"a packet of {size} bytes: this is no emScon server")
            if len(self._rest) < size:
                return
            packet, self._rest = self._rest[:size], self._rest[size:]
            found = _packet(kind, packet)
            if found is not None:
                yield found


def _packet(kind: int, packet: bytes) -> Packet | None:
    try:
        if kind == _COMMAND:
            return _answer(packet)
        if kind == _ERROR:
            return Complaint(*struct.unpack_from("<ii", packet, _HEAD))
        if kind == _STATUS_CHANGE:
            return StatusChange(*struct.unpack_from("<i", packet, _HEAD))
        form = _FORMS.get(kind)
        return None if form is None else _points(form, packet)
    except struct.error as error:
        raise DeviceError(f"a packet of type {kind} is cut off: {len(packet)} bytes") from error


def _answer(packet: bytes) -> Answer:
    code, status = struct.unpack_from("<ii", packet, _HEAD)
    if code != Code.GET_REFLECTORS or status != 0:
        return Answer(code, status)
    total, number, _kind, _offset, name = struct.unpack_from("<iiid64s", packet, 16)
    text = name.decode("utf-16-le", errors="replace").partition("\0")[0]
    return Reflector(code, status, total, number, text)


@dataclass(frozen=True)
class _Form:
    """Layout of a packet of points."""

    weather: int
    """Offset of temperature, pressure and humidity."""
    first: int
    """Offset of the first point."""
    point: np.dtype[np.void]


def _point(*fields: tuple[str, str] | tuple[str, str, int]) -> np.dtype[np.void]:
    return np.dtype(list(fields))


_TIMES = (("second", "<i4"), ("microsecond", "<i4"))
_PLACE, _DEVIATION = ("place", "<f8", 3), ("deviation", "<f8", 3)
_MORE = ("more", "<f8", 4)
"""Total deviation and three covariances, which are not used."""
_FORMS = {
    _MULTI: _Form(24, 48, _point(("quality", "<i4"), *_TIMES, _PLACE)),
    _MULTI_2: _Form(24, 48, _point(("quality", "<i4"), *_TIMES, _PLACE, _DEVIATION, _MORE)),
    _PROBE: _Form(
        44,
        68,
        _point(
            ("quality", "<i4"),
            ("trigger", "<i4"),
            ("rotation", "<i4"),
            *_TIMES,
            _PLACE,
            _DEVIATION,
            _MORE,
            ("quaternion", "<f8", 4),
            ("angles", "<f8", 10),
        ),
    ),
}


def _points(form: _Form, packet: bytes) -> MeasuredPoints:
    status, count = struct.unpack_from("<ii", packet, _HEAD)
    temperature, pressure, humidity = struct.unpack_from("<ddd", packet, form.weather)
    size = form.first + count * form.point.itemsize
    if count < 0 or size != len(packet):
        raise DeviceError(f"a packet of {count} points has {len(packet)} bytes, not {size}")
    rows = np.frombuffer(packet, form.point, count, form.first)
    names = form.point.names or ()
    return MeasuredPoints(
        status=status,
        temperature=temperature,
        pressure=pressure,
        humidity=humidity,
        quality=rows["quality"].astype(np.intp),
        stamp=rows["second"] + 1e-6 * rows["microsecond"],
        position=rows["place"].copy(),
        sigma=rows["deviation"].copy() if "deviation" in names else np.full((count, 3), np.nan),
        quaternion=rows["quaternion"].copy() if "quaternion" in names else None,
        rotation_status=rows["rotation"].astype(np.intp) if "rotation" in names else None,
    )
