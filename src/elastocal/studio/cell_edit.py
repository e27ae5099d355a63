"""Edits of the cell from a page: checked and written back whole, or not at all.

Text that is not edited stays unchanged, including comments. A position in the file is its keys from
the top: ``("surface", "region", "box", "min", 0)``. The YAML parser gives the beginning and end of
a value; only the text between is replaced (docs/decisions/0114-libraries-not-taken.md).
"""

import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.errors import ElastocalError, FileAccessError, SchemaError
from elastocal.files import replacing, require_file, require_size, sha256
from elastocal.outputs import OutputRule, ruled
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.units import in_unit

Key = str | int
"""Name of a key, or number of an item."""
Value = str | float | Sequence["Value"] | Mapping[str, "Value"]
"""Value that may be set; a text is always written in quotes."""
_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_LINE = re.compile(r"[ \t]*(#[^\r\n]*)?(\r\n|\n|\Z)")
"""Text that may follow a value on its line."""


def with_value(text: str, place: Sequence[Key], value: Value) -> str:
    """Return the text with another value at a place; keys that are not there yet are added.

    Raises
    ------
    SchemaError
        If the text is no YAML, or the place cannot be there.
    """
    node, depth = _deepest(text, place)
    if depth == len(place):
        return _replaced(text, node, flow(value))
    for key in reversed(place[depth + 1 :]):
        value = {str(key): value}
    return _added(text, node, place[depth], value)


def without(text: str, place: Sequence[Key]) -> str:
    """Return the text without a position; the same text if there is none.

    Raises
    ------
    SchemaError
        If the text is no YAML, or the place is in a list or mapping that is written on one line.
    """
    parent, depth = _deepest(text, place[:-1])
    if depth < len(place) - 1:
        return text
    for start, end in _entries(text, parent, place[-1]):
        if _is_flow(parent):
            names = ".".join(map(str, place))
            raise SchemaError(f"{names} is written on one line with others: edit the text")
        return text[: _line_start(text, start)] + text[end:]
    return text


def appended(text: str, place: Sequence[Key], value: Value) -> str:
    """Return the text with one more item at the end of a list, which is made where it is not there.

    Raises
    ------
    SchemaError
        If the text is no YAML, or the place is no list.
    """
    node, depth = _deepest(text, place)
    if depth < len(place):
        return with_value(text, place, [value])
    if not isinstance(node, yaml.SequenceNode):
        raise SchemaError(f"{'.'.join(map(str, place))} is no list")
    if _is_flow(node) or not node.value:
        end = text.rindex("]", node.start_mark.index, node.end_mark.index)
        comma = ", " if node.value else ""
        return f"{text[:end].rstrip()}{comma}{flow(value)}{text[end:]}"
    dash = text.rindex("-", 0, node.value[0].start_mark.index)
    indent = text[_line_start(text, dash) : dash]
    return _inserted(text, _end_of(node), f"{indent}- {flow(value)}")


def count_items(text: str, place: Sequence[Key]) -> int:
    """Return the number of items of a list; 0 where it is not there."""
    node, depth = _deepest(text, place)
    return len(node.value) if depth == len(place) and not isinstance(node, yaml.ScalarNode) else 0


def flow(value: Value) -> str:
    """Return a value as YAML on one line.

    >>> flow({"name": "station 1", "range": ["1 m", 15.0]})
    '{name: "station 1", range: ["1 m", 15]}'

    Raises
    ------
    SchemaError
        If a number is not finite.
    """
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_key(k)}: {flow(each)}" for k, each in value.items()) + "}"
    if isinstance(value, Sequence):
        return "[" + ", ".join(map(flow, value)) + "]"
    if not math.isfinite(value):
        raise SchemaError(f"{value!r} is no number for a cell file")
    return f"{value:.12g}"


def _key(name: str) -> str:
    return name if _PLAIN.fullmatch(name) else json.dumps(name, ensure_ascii=False)


def _deepest(text: str, place: Sequence[Key]) -> tuple[yaml.Node, int]:
    """Return the node farthest along a place, and how many of its keys lead there."""
    try:
        node = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f"line {mark.line + 1}: " if mark is not None else ""
        raise SchemaError(f"{where}{getattr(error, 'problem', None) or 'is no YAML'}") from error
    if not isinstance(node, yaml.MappingNode):
        raise SchemaError("a cell file has keys and values")
    found: yaml.Node = node
    for depth, key in enumerate(place):
        child = _child(found, key)
        if child is None:
            return found, depth
        found = child
    return found, len(place)


def _child(node: yaml.Node, key: Key) -> yaml.Node | None:
    if isinstance(node, yaml.MappingNode):
        return next((value for name, value in node.value if name.value == str(key)), None)
    if isinstance(node, yaml.SequenceNode) and isinstance(key, int) and key < len(node.value):
        child: yaml.Node = node.value[key]
        return child
    return None


def _entries(text: str, node: yaml.Node, key: Key) -> list[tuple[int, int]]:
    """Return the range of lines of a key or item; empty if there is none."""
    if isinstance(node, yaml.MappingNode):
        pairs = [(name.start_mark.index, value) for name, value in node.value if name.value == key]
    elif isinstance(node, yaml.SequenceNode) and isinstance(key, int):
        pairs = [
            (text.rfind("-", 0, value.start_mark.index), value)
            for value in node.value[key : key + 1]
        ]
    else:
        pairs = []
    return [(start, _rest_of_line(text, _end_of(value))) for start, value in pairs]


def _replaced(text: str, node: yaml.Node, new: str) -> str:
    """Return the text with a node replaced; a block is replaced by text on one line."""
    start, end = node.start_mark.index, _end_of(node)
    if isinstance(node, yaml.ScalarNode) or _is_flow(node):
        return text[:start] + new + text[end:]
    line = _line_start(text, start)
    if text[line:start].strip():
        return text[:start] + new + text[end:]
    # The key is on an earlier line: its value is written after its colon.
    colon = text.rindex(":", 0, line)
    return f"{text[: colon + 1]} {new}{text[colon + 1 : line].rstrip()}{text[end:]}"


def _added(text: str, node: yaml.Node, key: Key, value: Value) -> str:
    if not isinstance(node, yaml.MappingNode) or not isinstance(key, str):
        raise SchemaError(f"there is no place for {key!r} in the file")
    if _is_flow(node):
        end = text.rindex("}", node.start_mark.index, node.end_mark.index)
        comma = ", " if node.value else ""
        return f"{text[:end].rstrip()}{comma}{_key(key)}: {flow(value)}{text[end:]}"
    first = node.value[0][0].start_mark.index
    indent = " " * (first - _line_start(text, first))
    return _inserted(text, _end_of(node), f"{indent}{_key(key)}: {flow(value)}")


def _inserted(text: str, end: int, line: str) -> str:
    """Return the text with a line more, behind the one in which a node ends."""
    newline = "\r\n" if "\r\n" in text else "\n"
    place = _rest_of_line(text, end)
    before = text[:place] if text[:place].endswith("\n") else text[:place] + newline
    return f"{before}{line}{newline}{text[place:]}"


def _end_of(node: yaml.Node) -> int:
    """Return the position of a node's last letter; YAML extends a block to the next key."""
    if isinstance(node, yaml.ScalarNode) or _is_flow(node) or not node.value:
        return int(node.end_mark.index)
    last = node.value[-1]
    return _end_of(last[1] if isinstance(node, yaml.MappingNode) else last)


def _is_flow(node: yaml.Node) -> bool:
    """Return whether a node is written in brackets, on one line or several."""
    return isinstance(node, yaml.CollectionNode) and bool(node.flow_style)


def _line_start(text: str, index: int) -> int:
    return text.rfind("\n", 0, index) + 1


def _rest_of_line(text: str, index: int) -> int:
    """Return the end of the line of an index, after its comment."""
    match = _LINE.match(text, index)
    return match.end() if match else index


_BOM = "\ufeff"
_REGION, _STATIONS, _LOADS = ("surface", "region"), ("trackers",), ("load_cases",)


@record()
class StationForm:
    """One tracker station, quantities as in the file."""

    name: str
    position: tuple[str, str, str]
    range: tuple[str, str]


@record()
class RegionForm:
    """Corners of a box in the frame of the mesh, quantities as in the file."""

    min: tuple[str, str, str]
    max: tuple[str, str, str]


@brief_repr
@record()
class LoadForm:
    """Load cases, quantities as in the file."""

    fx: str
    fy: str
    fz: str
    level: str
    """Part of ``fz``; empty: none."""
    cases: tuple[str, ...]


@brief_repr
@record()
class CellForm:
    """Fields of a cell file that the page can edit."""

    stations: tuple[StationForm, ...]
    region: RegionForm | None
    """None: the whole surface, or a polygon."""
    polygon: bool
    """Whether the region is a polygon, or has a frame of its own: edited as text alone."""
    loads: LoadForm


@brief_repr
@record()
class CellEdit:
    """Changes to a cell file; None leaves a field unchanged."""

    text: str | None = None
    """The whole file."""
    home: tuple[float, ...] | None = None
    """Joint positions in rad or m."""
    loads: LoadForm | None = None
    region: RegionForm | None = None
    whole_surface: bool = False
    """Remove the region."""
    stations: tuple[StationForm, ...] | None = None


@dataclass(frozen=True)
class CellText:
    """A cell file as it was read."""

    path: Path
    text: str
    bom: bool

    @staticmethod
    def read(path: Path) -> "CellText":
        """Return the text of a cell file, its ends of line as they are.

        Raises
        ------
        FileAccessError, SchemaError
            If it cannot be read, or is too large.
        """
        require_file(path)
        try:
            require_size(path)
            text = path.read_bytes().decode("utf-8")
        except OSError as error:
            raise FileAccessError(f"cannot read {path}: {error.strerror or error}") from error
        except UnicodeDecodeError as error:
            raise FileAccessError(f"cannot read {path}: not a UTF-8 text file") from error
        return CellText(path, text.removeprefix(_BOM), text.startswith(_BOM))

    def edited(self, edit: CellEdit, cell: Cell) -> str:
        """Return the text with an edit.

        Raises
        ------
        SchemaError
            If there is no place for it in the text.
        """
        text = self.text if edit.text is None else _with_line_ends(edit.text, self.text)
        if edit.home is not None:
            text = _with_home(text, cell, edit.home)
        if edit.loads is not None:
            text = _with_loads(text, edit.loads, form_of(cell).loads)
        if edit.whole_surface:
            text = without(text, _REGION)
        if edit.region is not None:
            box: Value = {"min": edit.region.min, "max": edit.region.max}
            text = with_value(text, (*_REGION, "box"), box)
        if edit.stations is not None:
            text = _with_stations(text, edit.stations, form_of(cell).stations)
        return text

    def save(self, text: str, check: Callable[[Path], object]) -> None:
        """Write another text in its place, atomically, if it passes the check.

        Parameters
        ----------
        text : str
            The new one.
        check : callable
            Takes the path of a file beside the cell file, and refuses what is no cell.

        Raises
        ------
        SchemaError
            If the file was changed otherwise since it was read.
        ElastocalError
            If the check refuses the text; nothing is written then.
        """
        if sha256(CellText.read(self.path).text) != sha256(self.text):
            raise SchemaError(f"{self.path} was changed by somebody else: load it anew first")
        temporary = self.path
        mode = self.path.stat().st_mode & 0o777
        try:
            # An edit is a command of its own, for which the cell is an input.
            with ruled(OutputRule(force=True)), replacing(self.path) as temporary:
                data = ((_BOM if self.bom else "") + text).encode("utf-8")
                temporary.write_bytes(data)
                check(temporary)
        except ElastocalError as error:
            named = str(error).replace(str(temporary), str(self.path))
            raise type(error)(named) from error
        self.path.chmod(mode)


def form_of(cell: Cell) -> CellForm:
    """Return the values in the fields of a page for a cell."""
    loads, region = cell.file.load_cases, cell.file.surface.region
    box = None if region is None else region.box
    plain = region is None or (box is not None and "pose" not in region.model_fields_set)
    return CellForm(
        stations=tuple(
            StationForm(
                each.name, _triple(each.position), (_metres(each.range[0]), _metres(each.range[1]))
            )
            for each in cell.file.trackers
        ),
        region=RegionForm(_triple(box.min), _triple(box.max)) if box and plain else None,
        polygon=not plain,
        loads=LoadForm(
            f"{loads.fx:g} N",
            f"{loads.fy:g} N",
            f"{loads.fz:g} N",
            "" if loads.level is None else f"{loads.level:g}",
            loads.cases,
        ),
    )


def region_around(cell: Cell, points: FloatArray) -> RegionForm:
    """Return the region that holds points of the tooling, to start from.

    Parameters
    ----------
    points : ndarray, shape (point, 3)
        In base, in m.
    """
    T = cell.T_base_surface
    own = (points - T[:3, 3]) @ T[:3, :3]
    ends = np.floor(1e3 * own.min(axis=0)) / 1e3, np.ceil(1e3 * own.max(axis=0)) / 1e3
    return RegionForm(*(_triple((float(x), float(y), float(z))) for x, y, z in ends))


def _with_home(text: str, cell: Cell, home: tuple[float, ...]) -> str:
    joints = zip(cell.robot.joint_names, cell.robot.revolute, home, strict=True)
    for name, turns, value in joints:
        unit = "deg" if turns else "mm"
        shown = f"{round(in_unit(value, unit), 2) + 0.0:g} {unit}"
        text = with_value(text, ("motion", "home", name), shown)
    return text


def _with_loads(text: str, loads: LoadForm, before: LoadForm) -> str:
    for key in ("fx", "fy", "fz"):
        if getattr(loads, key) != getattr(before, key):
            text = with_value(text, (*_LOADS, key), getattr(loads, key))
    if loads.cases != before.cases:
        text = with_value(text, (*_LOADS, "cases"), loads.cases)
    if loads.level == before.level:
        return text
    if not loads.level.strip():
        return without(text, (*_LOADS, "level"))
    try:
        level = float(loads.level)
    except ValueError as error:
        raise SchemaError(f"load_cases.level: {loads.level!r} is no number") from error
    return with_value(text, (*_LOADS, "level"), level)


def _with_stations(
    text: str, stations: tuple[StationForm, ...], before: tuple[StationForm, ...]
) -> str:
    """Return the text with other stations: those that stay keep their lines and comments."""
    if not stations:
        return with_value(text, _STATIONS, []) if before else text
    for index in range(count_items(text, _STATIONS) - 1, len(stations) - 1, -1):
        text = without(text, (*_STATIONS, index))
    for index, station in enumerate(stations):
        fields: dict[str, Value] = {
            "name": station.name,
            "position": station.position,
            "range": station.range,
        }
        if index >= count_items(text, _STATIONS):
            text = appended(text, _STATIONS, fields)
            continue
        for key, value in fields.items():
            if getattr(before[index], key) != value:
                text = with_value(text, (*_STATIONS, index, key), value)
    return text


def _with_line_ends(text: str, like: str) -> str:
    """Return a text that a browser has sent, its lines ended as those of another."""
    plain = text.replace("\r\n", "\n")
    return plain.replace("\n", "\r\n") if "\r\n" in like else plain


def _triple(values: tuple[float, float, float]) -> tuple[str, str, str]:
    x, y, z = map(_metres, values)
    return x, y, z


def _metres(value: float) -> str:
    return f"{value:g} m"
