"""Edits of the cell that a page asks for: written back whole and checked, or not at all."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.errors import ElastocalError, FileAccessError, SchemaError
from elastocal.files import replacing, require_file, require_size, sha256
from elastocal.outputs import OutputRule, ruled
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.studio.cell_text import Value, appended, count_items, with_value, without

_BOM = "\ufeff"
_REGION, _STATIONS, _LOADS = ("surface", "region"), ("trackers",), ("load_cases",)


@record()
class StationForm:
    """One tracker station, quantities as they stand in the file."""

    name: str
    position: tuple[str, str, str]
    range: tuple[str, str]


@record()
class RegionForm:
    """Corners of a box in the frame of the mesh, quantities as they stand in the file."""

    min: tuple[str, str, str]
    max: tuple[str, str, str]


@brief_repr
@record()
class LoadForm:
    """Load cases, quantities as they stand in the file."""

    fx: str
    fy: str
    fz: str
    level: str
    """Part of ``fz``; empty: none."""
    cases: tuple[str, ...]


@brief_repr
@record()
class CellForm:
    """What of a cell file a page has fields for."""

    stations: tuple[StationForm, ...]
    region: RegionForm | None
    """None: the whole surface, or a polygon."""
    polygon: bool
    """Whether the region is a polygon, or has a frame of its own: edited as text alone."""
    loads: LoadForm


@brief_repr
@record()
class CellEdit:
    """What is to be changed; what is None stays."""

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
            If somebody else has changed the file since it was read.
        ElastocalError
            If the check refuses the text; nothing is written then.
        """
        if sha256(CellText.read(self.path).text) != sha256(self.text):
            raise SchemaError(f"{self.path} was changed by somebody else: load it anew first")
        temporary = self.path
        mode = self.path.stat().st_mode & 0o777
        try:
            # An edit is a command of its own: to whoever opened the cell it is an input.
            with ruled(OutputRule(force=True)), replacing(self.path) as temporary:
                data = ((_BOM if self.bom else "") + text).encode("utf-8")
                temporary.write_bytes(data)
                check(temporary)
        except ElastocalError as error:
            named = str(error).replace(str(temporary), str(self.path))
            raise type(error)(named) from error
        self.path.chmod(mode)


def form_of(cell: Cell) -> CellForm:
    """Return what stands in the fields of a page for a cell."""
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
    cell : Cell
        The cell.
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
        scale, unit = (np.degrees(1.0), "deg") if turns else (1e3, "mm")
        quantity = f"{round(scale * value, 2) + 0.0:g} {unit}"
        text = with_value(text, ("motion", "home", name), quantity)
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
