"""Where the objects of an RSI context stand in the picture that RSIVisual shows of it.

Sizes are those of public ``.rsi.diagram`` files, in inches; ids follow from names, so that the
same cell gives the same file.
"""

import uuid
from dataclasses import dataclass, field

from elastocal.drivers.kuka_rsi.context import ContextObject, RsiContext

_WIDTH, _GAP, _EDGE = 1.5, 0.25, 0.5
_PORT_LENGTH, _PORT_HEIGHT, _PORT_STEP = 0.4, 0.075, 0.4
_LIST_TOP, _LIST_BASE, _LIST_ROW = 0.51, 0.249388, 0.192301
_COLUMNS = {"SEN_PINT": 0.5, "ETHERNET": 3.875, "POSCORRMON": 11.0}
"""Left edge by kind; all others stand right of the ETHERNET object."""
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
        """Of the box."""
        longest = max(sum(p.way == way for p in self.ports) for way in ("In", "Out"))
        return max(self._list_height + 0.61, 0.475 + _PORT_STEP * (longest - 1))

    @property
    def bounds(self) -> str:
        """Left, top, width, height."""
        return _numbers(self.left, self.top, _WIDTH, self.height)

    @property
    def list_bounds(self) -> str:
        """Those of the list of parameters."""
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
        """Of the page."""
        return f"{max(box.left for box in self.boxes) + _WIDTH + _EDGE:g}"

    @property
    def height(self) -> str:
        """Of the page."""
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
