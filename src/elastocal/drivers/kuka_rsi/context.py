"""RSI contexts: objects, their parameters and wires, made from the channels and checked.

Names, type ids, parameter numbers and ports are facts of public files: ros-industrial/
kuka_experimental (``ros_rsi.rsi``), kroshu/kuka-external-control-sdk (``rsi_joint_pos.rsi``, and
the catalogue of objects inside its ``.rsix``) and otherworld-dev/rsi-pi (``RSIPI_Stop.rsi``, run on
KSS 8.3). ``.rsi.xml`` counts ports and parameters from 1, ``.rsix`` from 0; a parameter carries
``IsRuntime`` where the catalogue says that it cannot be set at run time, and only there. Not tried
on a controller.

Contexts of all three file forms are read and compared with what a cell needs.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from xml.etree import ElementTree

from elastocal.drivers.kuka_rsi.ethernet_file import ContextPort, EthernetFile, attribute, parsed
from elastocal.drivers.kuka_rsi.settings import Bounds
from elastocal.errors import DeviceError
from elastocal.results import brief_repr

PRECISION = 6
"""Decimals that the controller sends; its default is 1, a tenth of a millimetre."""
_STOP_TYPE, _COSYS_TYPE = "KUKA.RSIVisual.RSI_StopType", "KUKA.RSIVisual.RSI_TrafoCosys"
CHOICES = {
    _COSYS_TYPE: ("World", "Base", "RobRoot", "Tool", "TTS"),
    _STOP_TYPE: ("InfoMessage", "PathNormal", "Velocity", "PathFast", "ExitMoveCorr"),
}
"""Names of the choices of a type of parameter, in the order of their numbers."""
_AXES = ("X", "Y", "Z", "A", "B", "C")
_CAMEL = {
    "ETHERNET": "Ethernet",
    "STOP": "Stop",
    "POSCORR": "PosCorr",
    "POSCORRMON": "PosCorrMon",
    "MAP2SEN_PINT": "Map2Sen_PInt",
    "MAP2SEN_PREA": "Map2Sen_PRea",
    "SEN_PINT": "Sen_PInt",
}
_TYPE_IDS = {
    "ETHERNET": 64,
    "STOP": 18,
    "POSCORR": 27,
    "POSCORRMON": 81,
    "MAP2SEN_PINT": 16,
    "MAP2SEN_PREA": 17,
    "SEN_PINT": 57,
}
_INPUTS = {
    "STOP": ("In1",),
    "POSCORR": tuple(f"Corr{axis}" for axis in _AXES),
    "MAP2SEN_PINT": ("In1",),
    "MAP2SEN_PREA": ("In1",),
}
_OUTPUTS = {"POSCORR": ("Stat", *_AXES), "POSCORRMON": _AXES, "SEN_PINT": ("Out1",)}
_OPTIONAL = ("ETHERNET", "POSCORR")
"""Objects whose inputs need no wire."""
_SIGNALS = {"STOP.In1": "Bool", "POSCORR.Stat": "Int"}
"""Type of a port where it is not a number."""
_LEAST, _MOST = "-2147483648", "2147483647"


@dataclass(frozen=True)
class ContextParameter:
    """One parameter of an object."""

    name: str
    value: str
    """Value as RSIVisual shows it: a choice by its name."""
    number: int
    """Number in ``.rsi.xml``, from 1; choices and parameters that cannot be set at run time are
    counted separately."""
    kind: str = "System.Double"
    smallest: str = _LEAST
    largest: str = _MOST
    runtime: bool = True
    """Whether it can be set while RSI runs."""

    @property
    def choices(self) -> tuple[str, ...]:
        """Names of what it may be; none for numbers and texts."""
        return CHOICES.get(self.kind, ())

    @property
    def code(self) -> str:
        """Value that the controller reads: a choice by its number."""
        return str(self.choices.index(self.value)) if self.choices else self.value


@dataclass(frozen=True)
class ContextInput:
    """One input of an object."""

    name: str
    mandatory: bool
    signal: str | None
    source: "tuple[ContextObject, int] | None"
    """Object and number of its output, from 1."""


@dataclass(frozen=True)
class ContextOutput:
    """One output of an object."""

    name: str
    signal: str | None


@brief_repr
@dataclass(frozen=True)
class ContextObject:
    """One object of a context."""

    kind: str
    number: int
    """Index of its KRL variable, else 1."""
    parameters: tuple[ContextParameter, ...]
    outputs: tuple[ContextOutput, ...]
    inputs: tuple[ContextInput, ...] = ()

    @property
    def type_id(self) -> int:
        """Number of the kind."""
        return _TYPE_IDS[self.kind]

    @property
    def name(self) -> str:
        """Name in ``.rsi`` and ``.rsi.xml``."""
        return f"{self.kind}{self.number}"

    @property
    def camel(self) -> str:
        """Kind in ``.rsix``."""
        return _CAMEL[self.kind]

    @property
    def wired(self) -> "list[tuple[int, ContextObject, int]]":
        """Number of the input, source and number of its output, all from 1."""
        return [(k, *e.source) for k, e in enumerate(self.inputs, start=1) if e.source is not None]


@brief_repr
@dataclass(frozen=True)
class ContextEntry:
    """Content of a file about one object; all numbers from 1."""

    type_id: int
    parameters: Mapping[str, tuple[int, str]]
    """Number and value by name."""
    wires: Mapping[int, tuple[str, int]]
    """Source and number of its output by the number of the input."""


@brief_repr
@dataclass(frozen=True)
class RsiContext:
    """All objects of the context of one mode."""

    name: str
    objects: tuple[ContextObject, ...]

    @classmethod
    def of(cls, name: str, ethernet: EthernetFile, bounds: Bounds, timeout: int) -> "RsiContext":
        """Return the context that wires every channel of an ETHERNET file, with its limits.

        Parameters
        ----------
        name : str
            Name of the context; the ETHERNET file has the same.
        ethernet : EthernetFile
            Its channels.
        bounds : Bounds
            Bounds of the same mode.
        timeout : int
            Cycles without an answer until RSI ends.
        """
        sources = [_object(each.wired_to, bounds) for each in ethernet.sent]
        feed = tuple(
            ContextInput(f"In{k}", False, None, (each, 1))
            for k, each in enumerate(sources, start=1)
        )
        # RSIVisual always shows one free port more on either side.
        free = ContextInput(f"In{len(feed) + 1}", False, None, None)
        outputs = tuple(
            ContextOutput(f"Out{k}", None) for k in range(1, len(ethernet.received) + 2)
        )
        line = ContextObject("ETHERNET", 1, _ethernet(name, timeout), outputs, (*feed, free))
        ports: dict[tuple[str, int], dict[str, int]] = {}
        for channel in ethernet.received:
            to = channel.wired_to
            ports.setdefault((to.kind, to.variable or 1), {})[to.port] = channel.number
        sinks = [_sink(kind, k, wires, line, bounds) for (kind, k), wires in ports.items()]
        if ethernet.only_send:
            return cls(name, (line,))
        monitor = _object(ContextPort("POSCORRMON", "X"), bounds)
        return cls(name, (*sources, line, *sinks, monitor))

    def table(self) -> dict[str, ContextEntry]:
        """Return the objects that a reader of its files finds, by their names."""
        return {
            each.name: ContextEntry(
                each.type_id,
                {p.name: (p.number, p.code) for p in each.parameters},
                {k: (source.name, out) for k, source, out in each.wired},
            )
            for each in self.objects
        }


def _sink(
    kind: str, number: int, wires: Mapping[str, int], line: ContextObject, bounds: Bounds
) -> ContextObject:
    inputs = tuple(
        ContextInput(
            port,
            kind not in _OPTIONAL,
            _SIGNALS.get(f"{kind}.{port}"),
            (line, wires[port]) if port in wires else None,
        )
        for port in _INPUTS[kind]
    )
    bare = _object(ContextPort(kind, inputs[0].name, number), bounds)
    return ContextObject(kind, number, bare.parameters, bare.outputs, inputs)


def _object(port: ContextPort, bounds: Bounds) -> ContextObject:
    outputs = tuple(
        ContextOutput(name, _SIGNALS.get(f"{port.kind}.{name}"))
        for name in _OUTPUTS.get(port.kind, ())
    )
    number = port.variable or 1
    turn = f"{math.degrees(bounds.turn):.1f}"
    match port.kind:
        case "POSCORR":
            parameters = _poscorr(f"{1e3 * bounds.poscorr:.1f}", turn)
        case "POSCORRMON":
            own = {"MaxTrans": f"{1e3 * bounds.monitor:.1f}", "MaxRotAngle": turn}
            parameters = tuple(
                ContextParameter(name, value, k, smallest="0")
                for k, (name, value) in enumerate(own.items(), start=1)
            )
        case "STOP":
            # RSI 4 knows a parameter Channel, too; with it, RSI 3 was seen to take no corrections.
            parameters = (ContextParameter("Mode", "ExitMoveCorr", 1, _STOP_TYPE),)
        case _:
            parameters = (ContextParameter("Index", str(number), 1, "System.Int32", "1", "20"),)
    return ContextObject(port.kind, number, parameters, outputs)


def _poscorr(largest: str, turn: str) -> tuple[ContextParameter, ...]:
    sides = [("LowerLim", f"-{largest}"), ("UpperLim", largest)]
    limits = [(f"{side}{axis}", value) for side, value in sides for axis in "XYZ"]
    own = [*limits, ("MaxRotAngle", turn)]
    frame = ContextParameter("RefCorrSys", "Base", 1, _COSYS_TYPE, runtime=False)
    return (
        *(ContextParameter(name, value, k) for k, (name, value) in enumerate(own, start=1)),
        frame,
    )


def _ethernet(name: str, timeout: int) -> tuple[ContextParameter, ...]:
    whole = "System.Int32"
    return (
        ContextParameter("ConfigFile", f"{name}.xml", 1, "System.FileName", runtime=False),
        ContextParameter("Timeout", str(timeout), 1, whole, "0"),
        ContextParameter("Flag", "-1", 4, whole, "-1", "999"),
        ContextParameter("Precision", str(PRECISION), 8, whole, "1", "32"),
    )


_Entries = dict[str, ContextEntry]


def read_context(text: str) -> _Entries:
    """Return the content of a file of RSI objects, by kind and index of the KRL variable.

    Parameters
    ----------
    text : str
        Contents of the file.

    Raises
    ------
    DeviceError
        If it is none of the three, or its objects do not fit together.
    """
    root = parsed(text)
    readers = {"RSIObjects": _read_3, "RsiContext": _read_4, "rSIModel": _read_drawn}
    reader = readers.get(root.tag)
    if reader is None:
        raise DeviceError(
            f"its root is <{root.tag:.20}>: must be <ROOT> of an ETHERNET file, or of a context"
            f" {', '.join(f'<{tag}>' for tag in readers)}"
        )
    return reader(root)


def check_context(text: str, wanted: RsiContext) -> None:
    """Refuse a context that is not the one that a cell needs.

    Names of objects and parameters beyond ours may differ; objects beyond ours may not be there.

    Raises
    ------
    DeviceError
        With the first object, limit or wire that is another.
    """
    found, table = read_context(text), wanted.table()
    for name in sorted(table.keys() - found.keys()):
        raise DeviceError(f"no object {name}")
    for name in sorted(found.keys() - table.keys()):
        raise DeviceError(f"it has an object {name}, which {wanted.name} must not have")
    for name, ours in table.items():
        _check_entry(name, found[name], ours)


def _check_entry(name: str, theirs: ContextEntry, ours: ContextEntry) -> None:
    if theirs.type_id != ours.type_id:
        raise DeviceError(f"{name}: its type is {theirs.type_id}, must be {ours.type_id}")
    for key, (number, value) in ours.parameters.items():
        if key not in theirs.parameters:
            raise DeviceError(f"{name}: no parameter {key}")
        given_number, given = theirs.parameters[key]
        if given_number != number:
            raise DeviceError(f"{name}: {key} is parameter {given_number}, must be {number}")
        if not _same(given, value):
            raise DeviceError(f"{name}: {key} is {given:.40}, must be {value}")
    for number in sorted(ours.wires.keys() | theirs.wires.keys()):
        given_wire, wire = theirs.wires.get(number), ours.wires.get(number)
        if given_wire != wire:
            raise DeviceError(
                f"{name}: input {number} has {_wire(given_wire)}, must be {_wire(wire)}"
            )


def _same(given: str, wanted: str) -> bool:
    try:
        return math.isclose(float(given), float(wanted), abs_tol=1e-9)
    except ValueError:
        return given == wanted


def _wire(wire: tuple[str, int] | None) -> str:
    return "no wire" if wire is None else f"output {wire[1]} of {wire[0]}"


def _whole(element: ElementTree.Element, name: str, first: int = 1) -> int:
    """Return a number that counts from ``first`` as one that counts from 1."""
    text = attribute(element, name)
    if not (text.isascii() and text.isdigit() and len(text) < 6):
        raise DeviceError(f"{element.tag}: {name} is {text:.20}: must be a whole number")
    return int(text) + 1 - first


def _read_3(root: ElementTree.Element) -> _Entries:
    return _linked(root.findall("RSIObject"), 1, ("ObjTypeID", "ObjID", "OutObjID", "ParamID"))


def _read_4(root: ElementTree.Element) -> _Entries:
    objects = root.findall("RsiObjects/RsiObject")
    return _linked(objects, 0, ("ObjTypeId", "ObjId", "OutObjId", "ParamId"))


def _linked(objects: list[ElementTree.Element], first: int, names: tuple[str, ...]) -> _Entries:
    """Return the entries of files in which wires name numbers of ports."""
    type_id, own_id, source_id, parameter_id = names
    ids: dict[str, str] = {}
    parameters = []
    for each in objects:
        values = {
            attribute(p, "Name"): (_whole(p, parameter_id, first), attribute(p, "ParamValue"))
            for p in each.findall("Parameters/Parameter")
        }
        _name(ids, attribute(each, own_id), attribute(each, "ObjType"), values)
        parameters.append(values)
    found = {}
    for each, values in zip(objects, parameters, strict=True):
        wires = {
            _whole(wire, "InIdx", first): (
                _known(ids, attribute(wire, source_id)),
                _whole(wire, "OutIdx", first),
            )
            for wire in each.findall("Inputs/Input")
        }
        entry = ContextEntry(_whole(each, type_id), values, wires)
        found[ids[attribute(each, own_id)]] = entry
    return found


def _read_drawn(root: ElementTree.Element) -> _Entries:
    """Return the entries of ``.rsi``, in which wires and choices have names."""
    ids: dict[str, str] = {}
    objects, parameters = root.findall("rSIObjects/rSIElement"), []
    outputs: dict[str, list[str]] = {}
    for each in objects:
        values = {
            attribute(p, "name"): (_whole(p, "index"), _code(p))
            for p in each.findall("rSIParameters/rSIParameter")
        }
        own = attribute(each, "name")
        _name(ids, own, attribute(each, "objType"), values)
        parameters.append(values)
        outputs[own] = [attribute(p, "name") for p in each.findall("rSIOutPorts/rSIOutPort")]
    found = {}
    for each, values in zip(objects, parameters, strict=True):
        wires = {}
        for number, port in enumerate(each.findall("rSIInPorts/rSIInPort"), start=1):
            moniker = port.find("source/rSIOutPortMoniker")
            if moniker is not None:
                source, _, output = attribute(moniker, "name").removeprefix("//").partition("/")
                name = _known(ids, source)
                if output not in outputs[source]:
                    raise DeviceError(f"{source:.40} has no output {output:.40}")
                wires[number] = (name, outputs[source].index(output) + 1)
        found[ids[attribute(each, "name")]] = ContextEntry(_whole(each, "objTypeID"), values, wires)
    return found


def _code(parameter: ElementTree.Element) -> str:
    value = attribute(parameter, "value")
    choices = CHOICES.get(attribute(parameter, "paramType"), ())
    return str(choices.index(value)) if value in choices else value


def _name(ids: dict[str, str], own: str, kind: str, parameters: dict[str, tuple[int, str]]) -> None:
    name = f"{kind.upper()[:24]}{parameters.get('Index', (0, '1'))[1][:6]}"
    if own in ids or name in ids.values():
        raise DeviceError(f"two objects {name}")
    ids[own] = name


def _known(ids: dict[str, str], name: str) -> str:
    if name not in ids:
        raise DeviceError(f"a wire from {name:.40}, which is not there")
    return ids[name]
