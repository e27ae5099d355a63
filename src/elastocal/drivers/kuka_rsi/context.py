"""What an RSI context holds: objects, their parameters and wires; made from the channels, checked.

Names, type ids, parameter numbers and ports are facts of public files: ros-industrial/
kuka_experimental (``ros_rsi.rsi``), kroshu/kuka-external-control-sdk (``rsi_joint_pos.rsi``, and
the catalogue of objects inside its ``.rsix``) and otherworld-dev/rsi-pi (``RSIPI_Stop.rsi``, run on
KSS 8.3). ``.rsi.xml`` counts ports and parameters from 1, ``.rsix`` from 0; a parameter carries
``IsRuntime`` where the catalogue says that it cannot be set at run time, and only there. Not tried
on a controller.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from elastocal.drivers.kuka_rsi.ethernet_file import ContextPort, EthernetFile
from elastocal.drivers.kuka_rsi.settings import Bounds
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
"""Whose inputs need no wire."""
_SIGNALS = {"STOP.In1": "Bool", "POSCORR.Stat": "Int"}
"""Type of a port where it is not a number."""
_LEAST, _MOST = "-2147483648", "2147483647"


@dataclass(frozen=True)
class ContextParameter:
    """One parameter of an object."""

    name: str
    value: str
    """As RSIVisual shows it: a choice by its name."""
    number: int
    """In ``.rsi.xml``, from 1; choices and what cannot be set at run time count for themselves."""
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
        """What the controller reads: a choice by its number."""
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
        """In ``.rsi`` and ``.rsi.xml``."""
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
    """What a file says of one object; all numbers from 1."""

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
            Of the context; the ETHERNET file has the same.
        ethernet : EthernetFile
            Its channels.
        bounds : Bounds
            Of the same mode.
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
        """Return what a reader of its files finds, by the names of the objects."""
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
