"""The files for the controller: ETHERNET files, RSI contexts, KRL programs, the sheet to be signed.

All are made from the same limits and channels. Nothing here was tried on a controller; the programs
say so.

It also places the objects of an RSI context in the diagram of RSIVisual.

Sizes are those of public ``.rsi.diagram`` files, in inches; ids follow from names, so that the
same cell gives the same file.
"""

import hashlib
import math
import uuid
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.drivers.kuka_rsi.context import PRECISION, ContextObject, RsiContext, check_context
from elastocal.drivers.kuka_rsi.ethernet_file import (
    MODES,
    EthernetFile,
    check_ethernet_file,
    parsed,
)
from elastocal.drivers.kuka_rsi.force_control import ForceLaw, overshoot
from elastocal.drivers.kuka_rsi.settings import Bounds, RsiSettings, bounds_of
from elastocal.errors import DeviceError
from elastocal.files import filling
from elastocal.robot import xyzabc_from_T
from elastocal.templating import templates

_WIDTH, _GAP, _EDGE = 1.5, 0.25, 0.5
_PORT_LENGTH, _PORT_HEIGHT, _PORT_STEP = 0.4, 0.075, 0.4
_LIST_TOP, _LIST_BASE, _LIST_ROW = 0.51, 0.249388, 0.192301
_COLUMNS = {"SEN_PINT": 0.5, "ETHERNET": 3.875, "POSCORRMON": 11.0}
"""Left edge by kind; all other objects are to the right of the ETHERNET object."""
_SINKS = 7.625


@dataclass(frozen=True)
class DrawnPort:
    """A port of an object."""

    id: str
    way: str
    """``In`` or ``Out``."""
    name: str
    mandatory: bool
    left: float
    top: float

    @property
    def bounds(self) -> str:
        """Left, top, width, height."""
        return _numbers(self.left, self.top, _PORT_LENGTH, _PORT_HEIGHT)


@dataclass(frozen=True)
class DrawnObject:
    """An object, its ports, and its list of parameters."""

    id: str
    name: str
    list_id: str
    left: float
    top: float
    rows: int
    ports: tuple[DrawnPort, ...]

    @property
    def _list_height(self) -> float:
        return _LIST_BASE + _LIST_ROW * self.rows

    @property
    def height(self) -> float:
        """Height of the box."""
        longest = max(sum(p.way == way for p in self.ports) for way in ("In", "Out"))
        return max(self._list_height + 0.61, 0.475 + _PORT_STEP * (longest - 1))

    @property
    def bounds(self) -> str:
        """Left, top, width, height."""
        return _numbers(self.left, self.top, _WIDTH, self.height)

    @property
    def list_bounds(self) -> str:
        """Bounds of the list of parameters."""
        top = self.top + _LIST_TOP
        return _numbers(self.left + 0.015, top, _WIDTH - 0.03, self._list_height)


@dataclass(frozen=True)
class DrawnWire:
    """A wire from an output to an input."""

    to: str
    source: str
    points: str


@dataclass
class Drawing:
    """The picture of a context."""

    boxes: list[DrawnObject] = field(default_factory=list)
    wires: list[DrawnWire] = field(default_factory=list)

    @property
    def width(self) -> str:
        """Width of the page."""
        return f"{max(box.left for box in self.boxes) + _WIDTH + _EDGE:g}"

    @property
    def height(self) -> str:
        """Height of the page."""
        return f"{max(box.top + box.height for box in self.boxes) + _EDGE:g}"

    @classmethod
    def of(cls, context: RsiContext) -> "Drawing":
        """Return the picture: sources left, the ETHERNET object, what it feeds right of it."""
        drawing, tops = cls(), dict[float, float]()
        for each in context.objects:
            left = _COLUMNS.get(each.kind, _SINKS)
            box = _box(context.name, each, left, tops.get(left, _EDGE))
            tops[left] = box.top + box.height + _GAP
            drawing.boxes.append(box)
        ports = {p.id: p for box in drawing.boxes for p in box.ports}
        for each in context.objects:
            for number, source, output in each.wired:
                to = ports[_id(context.name, each.name, each.inputs[number - 1].name)]
                start = ports[_id(context.name, source.name, source.outputs[output - 1].name)]
                drawing.wires.append(DrawnWire(to.id, start.id, _points(to, start)))
        return drawing


def _box(context: str, each: ContextObject, left: float, top: float) -> DrawnObject:
    heights = [top + _GAP + _PORT_STEP * k for k in range(64)]
    ports = [
        DrawnPort(
            _id(context, each.name, p.name), "In", p.name, p.mandatory, left - _PORT_LENGTH, y
        )
        for p, y in zip(each.inputs, heights, strict=False)
    ]
    ports += [
        DrawnPort(_id(context, each.name, p.name), "Out", p.name, False, left + _WIDTH, y)
        for p, y in zip(each.outputs, heights, strict=False)
    ]
    own, listed = _id(context, each.name), _id(context, each.name, "RSIParameters")
    return DrawnObject(own, each.name, listed, left, top, len(each.parameters), tuple(ports))


def _points(to: DrawnPort, start: DrawnPort) -> str:
    """Return the corners of a wire, from the input back to the output."""
    ends = (to.left, to.top), (start.left + _PORT_LENGTH, start.top)
    (x_to, y_to), (x_start, y_start) = ends
    middle = 0.5 * (x_to + x_start)
    corners = [] if y_to == y_start else [(middle, y_to), (middle, y_start)]
    each = [ends[0], *corners, ends[1]]
    return "; ".join(f"({x:g} : {y + 0.5 * _PORT_HEIGHT:g})" for x, y in each)


def _id(*names: str) -> str:
    return str(uuid.uuid5(uuid.NAMESPACE_URL, "/".join(("elastocal", *names))))


def _numbers(*values: float) -> str:
    return ", ".join(f"{value:g}" for value in values)


PROGRAMS = {"measure": "elcal_meas", "contact": "elcal_run", "compensation": "elcal_comp"}
"""Name of program, RSI context and ETHERNET file of each mode."""
SHEET = "SIGN-OFF.md"
"""File that two people sign before the files go on the controller."""
LONGEST_NAME = 24
"""Longest name of a file on the controller, with its suffix; not verified on one."""
FORMS = {"rsi": ("rsi", "rsi.xml", "rsi.diagram"), "rsix": ("rsix",)}
"""Suffixes of the files that make one RSI context, by the setting ``rsi_context``."""


@dataclass(frozen=True)
class ControllerSet:
    """Values that the templates of one mode are filled with."""

    mode: str
    name: str
    ethernet: EthernetFile
    bounds: Bounds
    context: RsiContext
    loads: str
    """Argument of ``RSI_CREATE``."""
    ipo: str
    """``#IPO_FAST`` or ``#IPO``."""


def controller_files(cell: Cell, settings: RsiSettings) -> dict[str, bytes]:
    """Return the contents of all files by name, the sheet last.

    Parameters
    ----------
    settings : RsiSettings
        Those of its arm.

    Raises
    ------
    DeviceError, FileAccessError, SchemaError
        If the commissioning record that the settings name cannot be used.
    """
    sets = [_set_of(cell, settings, mode) for mode in MODES]
    files: dict[str, bytes] = {}
    for each in sets:
        text = _render("ethernet.xml", ethernet=each.ethernet)
        check_ethernet_file(text, each.mode)
        files[f"{each.name}.xml"] = _controller_bytes(text)
        files |= _context_files(each, settings)
        for suffix in ("src", "dat"):
            text = _render(f"{each.name}.{suffix}", each=each, settings=settings)
            files[f"{each.name}.{suffix}"] = _controller_bytes(text)
    longest = max(files, key=len)
    if not len(longest) <= LONGEST_NAME:
        raise DeviceError(f"{longest}: must be at most {LONGEST_NAME} signs")
    files[SHEET] = _sheet(cell, settings, sets, files).encode("utf-8")
    return files


def check_controller_file(text: str, cell: Cell, settings: RsiSettings) -> None:
    """Refuse an ETHERNET file or RSI context that is not what the mode of the arm needs.

    Parameters
    ----------
    text : str
        Contents of the file; its root element gives its kind.
    settings : RsiSettings
        Those of its arm.

    Raises
    ------
    DeviceError
        With the channel, object, limit or wire that is wrong.
    """
    if parsed(text).tag == "ROOT":
        check_ethernet_file(text, settings.mode)
    else:
        check_context(text, _set_of(cell, settings, settings.mode).context)


def write_controller_files(
    folder: Path, files: dict[str, bytes], force: bool = False
) -> tuple[str, ...]:
    """Write files into a folder, all or none; return their names.

    Raises
    ------
    FileAccessError
        If one cannot be written, or is there and ``force`` is not given.
    """
    with filling(folder, SHEET, force) as temporary:
        for name, contents in files.items():
            (temporary / name).write_bytes(contents)
    return tuple(files)


def _set_of(cell: Cell, settings: RsiSettings, mode: str) -> ControllerSet:
    own = settings.largest_correction if mode == settings.mode else None
    pair = {"correction": None, "hold_on": None, "largest_correction": own}
    bounds = bounds_of(cell, settings.model_copy(update={"mode": mode, **pair}))
    name, ethernet = PROGRAMS[mode], EthernetFile.of(settings, mode, cell.robot.external_axes > 0)
    context = RsiContext.of(name, ethernet, bounds, settings.timeout)
    loads = f"{name}.rsi" if settings.rsi_context == "rsi" else name
    ipo = "#IPO_FAST" if settings.cycle < 0.01 else "#IPO"
    return ControllerSet(mode, name, ethernet, bounds, context, loads, ipo)


def _context_files(each: ControllerSet, settings: RsiSettings) -> dict[str, bytes]:
    files, drawing = {}, Drawing.of(each.context)
    for suffix in FORMS[settings.rsi_context]:
        text = _render(f"context.{suffix}", context=each.context, drawing=drawing)
        if suffix != "rsi.diagram":
            check_context(text, each.context)
        files[f"{each.name}.{suffix}"] = _controller_bytes(text)
    return files


def _sheet(
    cell: Cell, settings: RsiSettings, sets: list[ControllerSet], files: dict[str, bytes]
) -> str:
    delay = settings.motion_delay(cell)
    stiffness = settings.contact_stiffness
    law = ForceLaw.design(stiffness, delay, settings.cycle, settings.force_speed)
    further = overshoot(cell.file.procedure.contact_speed, stiffness, delay + 2.0 * settings.cycle)
    return _render(
        SHEET,
        cell=cell,
        settings=settings,
        sets={each.mode: each for each in sets},
        delay=delay,
        delay_from=_provenance(settings),
        law=law,
        margin=math.degrees(law.phase_margin(stiffness)),
        further=further,
        T_flange_tcp=cell.T_flange_tcp,
        precision=PRECISION,
        forms=FORMS[settings.rsi_context],
        hashes={name: hashlib.sha256(contents).hexdigest() for name, contents in files.items()},
    )


def _provenance(settings: RsiSettings) -> str:
    if settings.commissioning is not None:
        return f"measured, {settings.commissioning}"
    return "as the cell file says" if settings.delay is not None else "ASSUMED: measure it"


def _controller_bytes(text: str) -> bytes:
    return text.replace("\n", "\r\n").encode("ascii")


def _frame(T: FloatArray) -> str:
    xyzabc = xyzabc_from_T(T)
    values = [*(1e3 * xyzabc[:3]), *np.degrees(xyzabc[3:])]
    parts = (f"{key} {round(v, 3) + 0.0:.3f}" for key, v in zip("XYZABC", values, strict=True))
    return f"{{{', '.join(parts)}}}"


def _millimetres(metres: float) -> str:
    return f"{1e3 * metres:.1f}"


def _render(template: str, **values: object) -> str:
    texts = templates(__package__)
    texts.filters |= {
        "frame": _frame,
        "mm": _millimetres,
        "deg": lambda radians: f"{math.degrees(radians):.1f}",
    }
    return texts.get_template(template).render(values)
