"""The two messages of KUKA's Robot Sensor Interface over Ethernet: ``<Rob>`` in, ``<Sen>`` out.

Each interpolation cycle the controller sends one XML datagram with what its ETHERNET object was
configured to send, and waits for one that echoes its ``IPOC``. Numbers are in millimetres and
degrees, with rotations A, B, C about z, the new y, the new x, as the pendant shows them; this
module keeps these units.

The reader is tolerant of what differs between controllers (capitals, tags of a site's own, what is
not sent) and of nothing else: no document type, no entity, at most 64 KB, only finite numbers.
Sources: ros-industrial/kuka_experimental and kroshu/kuka-external-control-sdk (examples of both
messages). Verified against simulators and public layouts, not on hardware.
"""

from dataclasses import dataclass, field
from enum import Enum, IntEnum
from xml.parsers import expat

from elastocal.errors import DeviceError
from elastocal.results import brief_repr
from elastocal.units import parse_number

MOST_BYTES = 65_536
"""Largest datagram that is looked at."""
_FRAME = ("x", "y", "z", "a", "b", "c")
_AXES = tuple(f"a{number}" for number in range(1, 7))
_EXTERNAL = tuple(f"e{number}" for number in range(1, 7))
_READ = {
    "rist": _FRAME,
    "rsol": _FRAME,
    "aipos": _AXES,
    "eipos": _EXTERNAL,
    "delay": ("d",),
    "krl": ("n", "state"),
}
"""Elements that are read with their attributes, in small letters; all others are let pass."""
_NAMES = dict(zip(_READ, ("RIst", "RSol", "AIPos", "EIPos", "Delay", "Krl"), strict=True))
"""Their names as a controller writes them."""
_OPTIONAL = frozenset({"eipos"})
"""Elements of which some attributes may be missing: a robot without external axes."""
_LARGEST = 1e7
"""Largest number of a controller, in mm or deg; the command numbers of a program are below it."""
_MOST_DIGITS = 20
_FAR = 250
"""Cycles by which an IPOC that is no jump may be off: a second at 4 ms."""
_WRAP = 1 << 32
"""IPOC counts up to here, and from zero again."""
_IN_A_ROW = 3
"""Number of consecutive old messages after which they count as the newer ones: the program was
restarted with a slightly lower count."""
_SHORT = 100
"""Controllers with RSI 2 begin with an empty message that is shorter than this, in bytes."""
Six = tuple[float, float, float, float, float, float]
"""Six numbers in mm and deg, or all in deg."""
NO_CORRECTION: Six = (0.0,) * 6


class ProgramState(IntEnum):
    """State of the program ``elcal_run``, as reported in ``Krl.State``."""

    ABSENT = 0
    """Not in its loop."""
    STANDING = 1
    """Waiting; corrections do not act."""
    GUIDED = 2
    """In ``RSI_MOVECORR``: corrections take effect."""
    MOVING = 3
    """On a ``PTP`` motion."""
    ARRIVED = 4
    BRAKED = 5
    """The ``PTP`` was aborted on its way."""
    ENDED = 9


class Order(IntEnum):
    """Order to the program ``elcal_run``, in ``Cmd.Op``."""

    HOLD = 0
    """Stand still; leave ``RSI_MOVECORR``, brake a ``PTP``."""
    GUIDE = 1
    """Enter ``RSI_MOVECORR``."""
    MOVE = 2
    """``PTP`` to the axis positions given."""
    ADOPT = 3
    """Adopt the present position as the programmed one: RSI off, ``PTP`` to the measured axes, RSI
    on. The controller sends nothing meanwhile; programs before 2026-11 do not know it."""
    END = 9


@brief_repr
@dataclass(frozen=True)
class RobMessage:
    """State of a controller in one cycle; None what it does not send."""

    ipoc: int
    """Its time stamp, which the answer echoes."""
    actual: Six | None = None
    """RIst: tool in base as it is, X, Y, Z in mm, A, B, C in deg."""
    setpoint: Six | None = None
    """RSol: the same as programmed, without correction."""
    axes: Six | None = None
    """AIPos: A1 to A6, in deg."""
    external: tuple[float, ...] | None = None
    """EIPos: E1 and on, in mm or deg."""
    delay: int | None = None
    """Delay D: answers that came too late, as the controller counts."""
    command: int | None = None
    """Krl.N: number of the last ``PTP`` that is over."""
    state: int | None = None
    """Krl.State: a `ProgramState`, or a number that is not one."""
    decimals: int = 0
    """Most decimals of a number of RIst."""


@dataclass(frozen=True)
class MoveTarget:
    """Axis positions of a ``PTP``."""

    number: int
    """Number of the command."""
    axes: Six = NO_CORRECTION
    """A1 to A6, in deg."""
    external: Six = NO_CORRECTION
    """E1 to E6, in mm or deg."""
    percent: float = 1.0
    """Speed as a part of the axis speeds, 1 to 100."""


@dataclass(frozen=True)
class SenMessage:
    """Values sent to a controller in one cycle."""

    correction: Six = NO_CORRECTION
    """RKorr: X, Y, Z in mm, A, B, C in deg; of one cycle (relative) or in all (absolute)."""
    order: Order = Order.HOLD
    target: MoveTarget | None = None
    """Target of the ``PTP``, for programs that know such; None leaves it out."""
    sentype: str = "elastocal"
    """``SENTYPE`` of the controller's ETHERNET file."""
    rearm: bool = False
    """Take the STOP channel back for once, so that it can rise again."""

    @property
    def stop(self) -> bool:
        """The channel of the STOP object; its rising edge ends ``RSI_MOVECORR``."""
        return self.order is not Order.GUIDE and not self.rearm


class Arrival(Enum):
    """Relation of a message to the one before it."""

    FIRST = "first"
    NEXT = "next"
    AFTER_LOSS = "after loss"
    OUT_OF_ORDER = "out of order"
    JUMPED = "jumped"
    """The controller's time has jumped: its program was restarted."""


class IpocWatch:
    """Relation of consecutive messages by their IPOC.

    IPOC counts milliseconds modulo 2**32: it grows by the cycle. Some simulators count messages, by
    1.
    """

    def __init__(self, cycle: float) -> None:
        self._step = round(1e3 * cycle)
        self._last: int | None = None
        self._old = self._in_a_row = 0
        self.lost = 0

    def classify(self, ipoc: int, anew: bool = False) -> Arrival:
        """Return how a message follows; one out of order does not count as the last.

        Parameters
        ----------
        ipoc : int
            Number of the message.
        anew : bool
            Whether the sender is otherwise known to have restarted.
        """
        last = self._last
        if last is None:
            self._last = ipoc
            return Arrival.FIRST
        change = _signed(ipoc - last)
        if change == 1:
            self._step = 1
        if not anew and -_FAR * self._step <= change <= 0 and not self._is_a_row(ipoc):
            return Arrival.OUT_OF_ORDER
        steps, rest = divmod(change, self._step)
        self._last, self._in_a_row = ipoc, 0
        if anew or rest or not 0 < steps <= _FAR:
            return Arrival.JUMPED
        self.lost += steps - 1
        return Arrival.NEXT if steps == 1 else Arrival.AFTER_LOSS

    def _is_a_row(self, ipoc: int) -> bool:
        """Return whether an old message is one of a row of them."""
        follows = self._in_a_row > 0 and _signed(ipoc - self._old) == self._step
        self._old, self._in_a_row = ipoc, self._in_a_row + 1 if follows else 1
        return self._in_a_row >= _IN_A_ROW


def _signed(change: int) -> int:
    """Return a difference of two counts, modulo their range, with the smaller size."""
    return (change + _WRAP // 2) % _WRAP - _WRAP // 2


def is_overture(datagram: bytes) -> bool:
    """Return whether a datagram is the empty message that RSI 2 begins with.

    >>> is_overture(b'<Rob Type="KUKA"></Rob>')
    True
    """
    return len(datagram) < _SHORT and b"ipoc" not in datagram.lower()


def read_rob(datagram: bytes) -> RobMessage:
    """Return the message that a controller sent.

    Parameters
    ----------
    datagram : bytes
        One datagram, a ``<Rob>`` document.

    Raises
    ------
    DeviceError
        If it is none: too large, no XML, a document type, no IPOC, a number that is none.
    """
    if len(datagram) > MOST_BYTES:
        raise DeviceError(f"RSI datagram of {len(datagram)} bytes: at most {MOST_BYTES} are read")
    found = _Elements()
    parser = expat.ParserCreate("iso-8859-1")
    parser.StartElementHandler = found.start
    parser.EndElementHandler = found.end
    parser.CharacterDataHandler = found.text
    parser.StartDoctypeDeclHandler = _refuse_doctype
    parser.EntityDeclHandler = _refuse_doctype
    try:
        parser.Parse(datagram, True)
    except expat.ExpatError as error:
        raise DeviceError(f"RSI datagram is no XML: {error}") from error
    given = found.elements
    vectors = {name: _numbers(name, attributes) for name, attributes in given.items()}
    return RobMessage(
        ipoc=_ipoc("".join(found.ipoc)),
        actual=_six(vectors.get("rist")),
        setpoint=_six(vectors.get("rsol")),
        axes=_six(vectors.get("aipos")),
        external=vectors.get("eipos"),
        delay=_whole(vectors.get("delay"), 0),
        command=_whole(vectors.get("krl"), 0),
        state=_whole(vectors.get("krl"), 1),
        decimals=max(len(text.partition(".")[2]) for text in ["", *given.get("rist", {}).values()]),
    )


def write_sen(message: SenMessage, ipoc: int) -> bytes:
    """Return the answer to the message with an IPOC, numbers with six decimals.

    >>> write_sen(SenMessage(order=Order.GUIDE, sentype="PC"), 4)[:40]
    b'<Sen Type="PC"><Stop>0</Stop><RKorr X="0'
    """
    parts = [f'<Sen Type="{message.sentype}"><Stop>{int(message.stop)}</Stop>']
    parts.append(_element("RKorr", "XYZABC", message.correction))
    if message.target is not None:
        target = message.target
        parts.append(
            f'<Cmd N="{target.number}" Op="{int(message.order)}" V="{target.percent:.3f}"/>'
        )
        parts.append(_element("Ax", [name.upper() for name in _AXES], target.axes))
        parts.append(_element("Ex", [name.upper() for name in _EXTERNAL], target.external))
    parts.append(f"<IPOC>{ipoc}</IPOC></Sen>")
    return "".join(parts).encode("ascii")


def _element(tag: str, names: str | list[str], values: Six) -> str:
    # Rounded first, so that "-0.000000" is never sent.
    plain = (round(value, 6) + 0.0 for value in values)
    given = (f'{name}="{value:.6f}"' for name, value in zip(names, plain, strict=True))
    return f"<{tag} {' '.join(given)}/>"


@dataclass
class _Elements:
    """Elements of one document, as expat reports them."""

    elements: dict[str, dict[str, str]] = field(default_factory=dict)
    ipoc: list[str] = field(default_factory=list)
    _depth: int = 0
    _within_ipoc: bool = False

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self._depth += 1
        name = tag.lower()
        if self._depth == 1 and name != "rob":
            raise DeviceError(f"RSI datagram is a <{tag:.20}>: expected <Rob>")
        if self._depth != 2:
            return
        self._within_ipoc = name == "ipoc"
        if name in self.elements or (self._within_ipoc and self.ipoc):
            raise DeviceError(f"RSI datagram has <{tag:.20}> twice")
        if name in _READ:
            self.elements[name] = {key.lower(): text for key, text in attributes.items()}

    def end(self, _tag: str) -> None:
        self._depth -= 1
        self._within_ipoc = False

    def text(self, text: str) -> None:
        if self._within_ipoc:
            self.ipoc.append(text)


def _refuse_doctype(*_: object) -> None:
    raise DeviceError("RSI datagram has a document type or entities: none are read")


def _numbers(name: str, given: dict[str, str]) -> tuple[float, ...]:
    """Return the numbers of an element, in order."""
    wanted = _READ[name]
    if name in _OPTIONAL:
        wanted = wanted[: next((i for i, key in enumerate(wanted) if key not in given), None)]
    return tuple(_number(name, key, given.get(key)) for key in wanted)


def _number(name: str, key: str, text: str | None) -> float:
    if text is None:
        raise DeviceError(f"RSI datagram: {_NAMES[name]} has no {key.upper()}")
    what = f"RSI datagram: {_NAMES[name]}.{key.upper()} is {text!r:.30}"
    try:
        value = parse_number(text)
    except ValueError:
        comma = ": decimal comma" if _is_number(text.replace(",", ".", 1)) else ""
        raise DeviceError(f"{what}, no number{comma}") from None
    if not abs(value) <= _LARGEST:
        raise DeviceError(f"{what}, no number in range")
    return value


def _is_number(text: str) -> bool:
    try:
        parse_number(text)
    except ValueError:
        return False
    return True


def _six(values: tuple[float, ...] | None) -> Six | None:
    if values is None:
        return None
    one, two, three, four, five, six = values
    return one, two, three, four, five, six


def _whole(values: tuple[float, ...] | None, place: int) -> int | None:
    return None if values is None else round(values[place])


def _ipoc(text: str) -> int:
    digits = text.strip()
    if not (digits.isascii() and digits.isdigit() and len(digits) <= _MOST_DIGITS):
        raise DeviceError(f"RSI datagram: IPOC is {digits!r:.30}, must be a whole number")
    return int(digits)
