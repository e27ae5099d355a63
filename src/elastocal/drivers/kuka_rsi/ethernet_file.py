"""Configuration file of a controller's ETHERNET object: generated and checked.

Channels of the controller's own (``DEF_RIst``) are known by their names, all others by the number
of the input or output of the object that they are wired to in the RSI context; with a point in the
name they are attributes of one element. A site may have changed the XML: it is read with a bound,
without entities, its attributes by name. Written after kroshu/kuka-external-control-sdk and
ros-industrial/kuka_experimental; not tried on a controller.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from xml.etree import ElementTree

from elastocal.drivers.kuka_rsi.settings import CORRECTIONS, HOLD_ON, RsiSettings, require_pair
from elastocal.errors import DeviceError
from elastocal.results import brief_repr

_MOST_CHARACTERS = 262_144


def parsed(text: str) -> ElementTree.Element:
    """Return the root of a file, all names without their namespaces.

    Raises
    ------
    DeviceError
        If it is no XML, too long, or has a document type.
    """
    if len(text) > _MOST_CHARACTERS:
        raise DeviceError(
            f"{len(text)} characters: a file of a controller has at most {_MOST_CHARACTERS}"
        )
    if "<!" in text.replace("<!--", ""):
        raise DeviceError("a document type or entities: a file of a controller has none")
    try:
        # RSIVisual begins its files with a byte order mark.
        root = ElementTree.fromstring(text.removeprefix("\ufeff"))
    except ElementTree.ParseError as error:
        raise DeviceError(f"no XML: {error}") from error
    for each in root.iter():
        each.tag = each.tag.rpartition("}")[2]
    return root


def attribute(element: ElementTree.Element, name: str) -> str:
    """Return an attribute that must be there.

    Raises
    ------
    DeviceError
        If it is not.
    """
    found = element.get(name)
    if found is None:
        raise DeviceError(f"an {element.tag} has no {name}")
    return found


MODES = ("measure", "contact", "compensation")
_MOST_CHANNELS = 64
_OWN = ("RIst", "RSol", "AIPos", "EIPos", "Delay")
"""Channels of the controller's own that are sent."""
_CORRECTION = tuple(f"RKorr.{axis}" for axis in "XYZABC")
_STOP = "Stop"


@dataclass(frozen=True)
class ContextPort:
    """Input or output of an object of the RSI context."""

    kind: str
    """Kind of the object: ``POSCORR``."""
    port: str
    variable: int | None = None
    """Index of the KRL variable that the object reads or writes; such an object is for it alone."""

    def __str__(self) -> str:
        """Return its name on the sheet."""
        return (
            f"{self.kind}.{self.port}" if self.variable is None else f"{self.kind} {self.variable}"
        )


@dataclass(frozen=True)
class EthernetChannel:
    """One numbered channel."""

    tag: str
    kind: str
    """``BOOL``, ``LONG`` or ``DOUBLE``."""
    number: int
    """Number of the output (received) or input (sent) of the ETHERNET object, from 1."""
    wired_to: ContextPort
    hold_on: int | None = None
    """HoldOn of a received channel."""


@brief_repr
@dataclass(frozen=True)
class EthernetFile:
    """Configuration of the ETHERNET object of one RSI context: what it sends and receives."""

    mode: str
    address: str
    """Address of the PC."""
    port: int
    sentype: str
    own: tuple[str, ...]
    """Names without ``DEF_`` of the controller's own channels that are sent."""
    sent: tuple[EthernetChannel, ...] = ()
    received: tuple[EthernetChannel, ...] = field(default_factory=tuple)

    @property
    def only_send(self) -> bool:
        """Whether the controller hears nothing."""
        return self.mode == "measure"

    @classmethod
    def of(cls, settings: RsiSettings, mode: str, external: bool) -> "EthernetFile":
        """Return the file of a mode.

        Parameters
        ----------
        settings : RsiSettings
            Addresses.
        mode : str
            One of `MODES`.
        external : bool
            Whether there are external axes.
        """
        own = tuple(name for name in _OWN if external or name != "EIPos")
        place = (mode, settings.address, settings.port, settings.sentype, own)
        if mode == "measure":
            return cls(*place)
        hold = HOLD_ON[CORRECTIONS[mode]]
        received = [(_STOP, "BOOL", ContextPort("STOP", "In1"), 1)]
        received += [
            (tag, "DOUBLE", ContextPort("POSCORR", f"Corr{tag[-1]}"), hold) for tag in _CORRECTION
        ]
        if mode == "compensation":
            return cls(*place, (), _numbered(received))
        received += [
            (tag, "LONG", ContextPort("MAP2SEN_PINT", "In1", k), 1)
            for k, tag in enumerate(("Cmd.N", "Cmd.Op"), start=1)
        ]
        targets = [f"Ax.A{k}" for k in range(1, 7)] + [f"Ex.E{k}" for k in range(1, 7)]
        reals = [(13, "Cmd.V"), *enumerate(targets, start=1)]
        received += [(tag, "DOUBLE", ContextPort("MAP2SEN_PREA", "In1", k), 1) for k, tag in reals]
        sent = [
            (tag, "LONG", ContextPort("SEN_PINT", "Out1", k), None)
            for k, tag in ((11, "Krl.N"), (12, "Krl.State"))
        ]
        return cls(*place, _numbered(sent), _numbered(received))


def _numbered(
    rows: Sequence[tuple[str, str, ContextPort, int | None]],
) -> tuple[EthernetChannel, ...]:
    return tuple(
        EthernetChannel(tag, kind, number, wired_to, hold_on)
        for number, (tag, kind, wired_to, hold_on) in enumerate(rows, start=1)
    )


def check_ethernet_file(text: str, mode: str) -> None:
    """Refuse an ETHERNET file that does not do what a mode needs, or pairs HOLDON wrongly.

    Parameters
    ----------
    text : str
        Its contents.
    mode : str
        One of `MODES`.

    Raises
    ------
    DeviceError
        With the channel that is wrong.
    """
    root = parsed(text)
    if root.tag != "ROOT":
        raise DeviceError(f"its root is <{root.tag:.20}>: must be <ROOT>")
    only_send = _text(root, "CONFIG/ONLYSEND").upper() == "TRUE"
    if only_send != (mode == "measure"):
        raise DeviceError(f"ONLYSEND is {only_send!s}: mode {mode} needs {not only_send!s}".upper())
    sent = [attribute(each, "TAG") for each in root.findall("SEND/ELEMENTS/ELEMENT")]
    received = {attribute(each, "TAG"): each for each in root.findall("RECEIVE/ELEMENTS/ELEMENT")}
    for what, count in (("SEND", len(sent)), ("RECEIVE", len(received))):
        if count > _MOST_CHANNELS:
            raise DeviceError(f"{what} has {count} channels: at most {_MOST_CHANNELS}")
    needed = ["DEF_RIst", "DEF_AIPos"] + ([] if mode == "measure" else ["DEF_RSol"])
    needed += ["Krl.N", "Krl.State"] if mode == "contact" else []
    _require_tags("SEND", needed, sent)
    if mode == "measure":
        return
    _require_tags("RECEIVE", [_STOP, *_CORRECTION[:3]], received)
    for tag in _CORRECTION:
        if tag in received:
            _check_hold_on(tag, attribute(received[tag], "HOLDON"), mode)


def _check_hold_on(tag: str, text: str, mode: str) -> None:
    if text not in ("0", "1"):
        raise DeviceError(f"{tag}: HOLDON is {text!r}: must be 0 or 1")
    try:
        require_pair(CORRECTIONS[mode], int(text))
    except ValueError as error:
        raise DeviceError(f"{tag}: {error}") from error


def _require_tags(section: str, needed: list[str], given: list[str] | Mapping[str, object]) -> None:
    for tag in needed:
        if tag not in given:
            raise DeviceError(f"{section} has no element {tag}")


def _text(root: ElementTree.Element, path: str) -> str:
    found = root.findtext(path)
    if found is None:
        raise DeviceError(f"it has no {path}")
    return found.strip()
