"""A dataset's CSV file, the lossless twin of the NetCDF file: a row a reading (spec section 3).

The header says which column holds what, in which unit; attributes stand above it as comment lines,
their texts in JSON so that each fits on one line.
"""

import io
import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elastocal.dataset._layout import (
    ATTRIBUTES,
    AXES,
    CF_ATTRIBUTES,
    COLUMN_NAMES,
    JOINT_UNITS,
    MISSING,
    OK,
    SCHEMA,
    SI_JOINT_UNITS,
    STATUSES,
    TEXT_COLUMNS,
    VECTORS,
    BoolArray,
    FloatArray,
    StatusArray,
    joint_name_problem,
)
from elastocal.dataset._structure import assemble
from elastocal.dataset.dataset import Dataset
from elastocal.errors import DatasetError, UnitError, nearest
from elastocal.files import read_text
from elastocal.records import LabelledArrays
from elastocal.tables import Column, TableError, TableReader, TableRows, write_table as write_rows
from elastocal.units import factor, split_column

_JOINT_HINT = "a joint column is written name[rad], name[deg], name[m] or name[mm]"
_VARIABLE_OF = {column: variable for variable in VECTORS for column in variable.columns}
_MEASURED = ("force", "moment", "controller_displacement", "marker_displacement")
"""Vectors that, with the joint positions, make a reading; a row with none of them is missing."""
_ATTRIBUTE = re.compile(r"#\s*(\w+)\s*:\s*(.*)")


@dataclass(frozen=True)
class TableText:
    """A CSV file, cut into cells."""

    attributes: dict[str, object]
    """Attributes of the leading comment lines."""
    header: tuple[str, ...]
    rows: TableRows
    """Rows that are not blank, each as long as the header."""


@dataclass(frozen=True)
class Header:
    """The columns of a file, by what they hold."""

    text: dict[str, int]
    """Position of ``pose``, ``load_case`` and, where present, ``status``."""
    joints: tuple[Column, ...]
    """Joint positions, in the order of the file."""
    vectors: dict[str, tuple[Column, ...]]
    """The x, y and z columns of each vector that is present."""

    @property
    def joint_units(self) -> tuple[str, ...]:
        """SI unit of each joint."""
        return tuple(SI_JOINT_UNITS[JOINT_UNITS[column.unit]] for column in self.joints)


@dataclass(frozen=True)
class _Grid:
    """Where each row belongs among poses and load cases, both in order of first appearance."""

    poses: list[int]
    load_cases: list[str]
    pose: NDArray[np.intp]
    """Position of each row's pose, shape (row,)."""
    load_case: NDArray[np.intp]
    """Position of each row's load case, shape (row,)."""

    def spread(self, values: np.ndarray, fill: float = math.nan) -> np.ndarray:
        """Return values of shape (row, …) as (pose, load_case, …), ``fill`` where no row is."""
        shape = (len(self.poses), len(self.load_cases), *values.shape[1:])
        spread = np.full(shape, fill, dtype=values.dtype)
        spread[self.pose, self.load_case] = values
        return spread


def read_table(path: Path) -> LabelledArrays:
    """Return the contents of a CSV file as labelled arrays in SI units, not validated.

    A reading without a row, or whose row has only empty cells, is missing.

    Raises
    ------
    FileAccessError
        If the file is missing, unreadable, empty or not text.
    DatasetError
        If the header or a cell cannot be read; the message names row and column.
    """
    table = cut(read_text(path))
    header = parse_header(table.header)
    grid = _grid(table, header.text)
    joints = _numbers(table, header.joints)
    vectors = {name: _numbers(table, columns) for name, columns in header.vectors.items()}
    measured = [joints, *(vectors[name] for name in _MEASURED if name in vectors)]
    empty = np.asarray(np.isnan(np.hstack(measured)).all(axis=1))
    arrays = {name: grid.spread(values) for name, values in vectors.items()}
    if "tcp_position" in vectors:
        arrays["tcp_position"] = _per_pose(table, grid, vectors["tcp_position"])
    arrays["joint_position"] = grid.spread(joints)
    arrays["status"] = grid.spread(_statuses(table, header.text, empty), MISSING)
    joint_names = [column.name for column in header.joints]
    return assemble(
        {"pose": grid.poses, "load_case": grid.load_cases, "joint": joint_names},
        arrays,
        header.joint_units,
        {"schema": SCHEMA, **table.attributes},
    )


def write_table(data: Dataset, path: Path) -> None:
    """Write a dataset to a CSV file, whole or not at all.

    Every (pose, load case) has a row; numbers are in SI units with all their digits; NaN is an
    empty cell; the status column is left out when every reading is ok.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    columns: dict[str, list[object]] = {
        "pose": [pose for pose in data.poses for _ in data.load_cases],
        "load_case": [case for _ in data.poses for case in data.load_cases],
    }
    if np.any(data.status != OK):
        columns["status"] = [STATUSES[value] for value in data.status.ravel()]
    joints = zip(data.joint_names, data.joint_units, strict=True)
    for index, (name, unit) in enumerate(joints):
        columns[f"{name}[{unit}]"] = _cells(data.joint_position[..., index])
    for variable in VECTORS:
        values = data.arrays.get(variable.name)
        if values is not None:
            if "load_case" not in variable.dims:
                values = np.broadcast_to(values[:, np.newaxis], (*data.status.shape, len(AXES)))
            for index, name in enumerate(variable.columns):
                columns[f"{name}[{variable.column_unit}]"] = _cells(values[..., index])
    stated = {name: text for name, text in data.attributes.items() if text}
    rows = zip(*columns.values(), strict=True)
    write_rows(path, tuple(columns), rows, tuple(attribute_lines(stated)))


def cut(text: str) -> TableText:
    """Cut the text of a CSV file into attributes, header and rows.

    Raises
    ------
    DatasetError
        If a comment holds a bad attribute, a row is not as long as the header, or there is none.
    """
    try:
        reader = TableReader(io.StringIO(text))
        attributes = _preamble(reader.layout.preamble)
        header = reader.layout.header
        if not header:
            raise DatasetError("file has no header line, only comments")
        rows = reader.rows()
    except TableError as error:
        raise DatasetError(str(error)) from error
    uneven = rows.uneven(len(header))
    if uneven:
        line, cells = uneven
        hint = " (with a decimal comma the delimiter must be another, and the comma a point)"
        raise DatasetError(
            f"row {line} has {cells} cells, the header has {len(header)}"
            f"{hint if cells > len(header) else ''}"
        )
    if not len(rows):
        raise DatasetError("file has a header but no row")
    return TableText(attributes, header, rows)


def attribute_lines(attributes: Mapping[str, str]) -> Iterator[str]:
    """Yield a comment line for each attribute, its text as JSON so that it fits on one line."""
    for name, value in attributes.items():
        yield f"# {name}: {json.dumps(value)}\n"


def _preamble(lines: Sequence[str]) -> dict[str, object]:
    """Return the attributes that the lines above the header state."""
    attributes: dict[str, object] = {}
    for number, line in enumerate(lines, start=1):
        for name, value in _attribute(line.strip(), number).items():
            if name in attributes:
                raise DatasetError(f"row {number}: attribute {name!r} stands twice")
            attributes[name] = value
    return attributes


def _attribute(line: str, number: int) -> dict[str, object]:
    """Return the attribute that a comment line states; none when it is a person's remark."""
    match = _ATTRIBUTE.fullmatch(line)
    if match is None:
        return {}
    known, name = (*ATTRIBUTES, *CF_ATTRIBUTES), match[1]
    try:
        value = json.loads(match[2])
    except ValueError as error:
        if name in ATTRIBUTES:
            raise DatasetError(
                f"row {number}: attribute {name!r} is {match[2]!r:.60}: it must be a text in double"
                " quotes (JSON)"
            ) from error
        return {}
    if name not in known and nearest(name, known):
        raise DatasetError(f"row {number}: attribute {name!r} is not known{nearest(name, known)}")
    return {name: value} if name in known else {}


def parse_header(cells: Sequence[str]) -> Header:
    """Return the columns that a header line names, in any order.

    Raises
    ------
    DatasetError
        If a column is unknown, missing, named twice, or has no unit or a wrong one.
    """
    text: dict[str, int] = {}
    numbers: dict[str, Column] = {}
    for index, cell in enumerate(cells):
        name, unit = _split(cell, index)
        if name in text or name in numbers:
            raise DatasetError(f"column {name!r} stands twice in the header")
        if name in TEXT_COLUMNS:
            if unit is not None:
                raise DatasetError(f"column {cell!r} has a unit: it must be written {name!r}")
            text[name] = index
        else:
            numbers[name] = _number_column(index, name, unit)
    for name in ("pose", "load_case"):
        if name not in text:
            raise DatasetError(f"column {name!r} is missing")
    joints = tuple(column for name, column in numbers.items() if name not in _VARIABLE_OF)
    if not joints:
        raise DatasetError(f"no joint column: {_JOINT_HINT}")
    return Header(text, joints, _vectors(numbers))


def _split(cell: str, index: int) -> tuple[str, str | None]:
    if not cell.strip():
        raise DatasetError(f"column {index + 1} has no name in the header")
    try:
        return split_column(cell)
    except UnitError as error:
        raise DatasetError(str(error)) from error


def _number_column(index: int, name: str, unit: str | None) -> Column:
    variable = _VARIABLE_OF.get(name)
    if variable is None:
        return _joint_column(index, name, unit)
    if not unit:
        raise DatasetError(
            f"column {name!r} has no unit: it is written {name}[{variable.column_unit}]"
        )
    try:
        return Column(index, name, unit, factor(unit, variable.dimension))
    except UnitError as error:
        raise DatasetError(f"column '{name}[{unit}]': {error}") from error


def _joint_column(index: int, name: str, unit: str | None) -> Column:
    """Return a joint's column: every column that is not known otherwise and has a joint's unit."""
    if unit not in JOINT_UNITS:
        shown = name if unit is None else f"{name}[{unit}]"
        hint = nearest(name, COLUMN_NAMES)
        raise DatasetError(f"column {shown!r} is not known{hint} ({_JOINT_HINT})")
    problem = joint_name_problem(name)
    if problem:
        raise DatasetError(f"column '{name}[{unit}]': {problem}")
    return Column(index, name, unit, factor(unit, JOINT_UNITS[unit]))


def _vectors(numbers: dict[str, Column]) -> dict[str, tuple[Column, ...]]:
    """Return the columns of each vector; one that is there must be there whole."""
    vectors: dict[str, tuple[Column, ...]] = {}
    for variable in VECTORS:
        missing = [name for name in variable.columns if name not in numbers]
        if missing and (variable.required or len(missing) < len(variable.columns)):
            raise DatasetError(f"column '{missing[0]}[{variable.column_unit}]' is missing")
        if not missing:
            vectors[variable.name] = tuple(numbers[name] for name in variable.columns)
    return vectors


def _grid(table: TableText, text: Mapping[str, int]) -> _Grid:
    """Return the place of each row; a (pose, load case) that stands twice is refused."""
    poses: dict[int, int] = {}
    cases: dict[str, int] = {}
    line_of: dict[tuple[int, int], int] = {}
    for line, row in zip(table.rows.lines, table.rows.cells, strict=True):
        pose = _pose(row[text["pose"]], line)
        case = row[text["load_case"]].strip()
        if not case:
            raise DatasetError(f"row {line}: load_case is empty: it must be a name")
        place = (poses.setdefault(pose, len(poses)), cases.setdefault(case, len(cases)))
        earlier = line_of.setdefault(place, line)
        if earlier != line:
            raise DatasetError(
                f"pose {pose}, load case {case!r} stands twice, in rows {earlier} and {line}:"
                " a pose that was measured again needs its own label"
            )
    places = np.array(list(line_of), dtype=np.intp)
    return _Grid(list(poses), list(cases), places[:, 0], places[:, 1])


def _pose(cell: str, line: int) -> int:
    try:
        _refuse_underscore(cell)
        return int(cell)
    except ValueError as error:
        raise DatasetError(f"row {line}: pose is {cell!r}: it must be an integer") from error


def _numbers(table: TableText, columns: Sequence[Column]) -> FloatArray:
    """Return columns of numbers in SI units, shape (row, column); an empty cell is NaN."""
    try:
        return np.column_stack([table.rows.numbers(column, _number) for column in columns])
    except TableError as error:
        raise DatasetError(str(error)) from error


def _number(cell: str) -> float:
    if not cell.strip():
        return math.nan
    try:
        _refuse_underscore(cell)
        return float(cell)
    except ValueError:
        hint = " (the decimal sign is a point)" if "," in cell else ""
        raise ValueError(f"is not a number{hint}") from None


def _refuse_underscore(text: str) -> None:
    """Refuse ``1_5``, which is 15 to Python and a slip of the pen in a table."""
    if "_" in text:
        raise ValueError(text)


def _statuses(table: TableText, text: Mapping[str, int], empty: BoolArray) -> StatusArray:
    """Return the status of each row, shape (row,); without a word an empty row is missing."""
    statuses = np.where(empty, MISSING, OK).astype(np.int8)
    if "status" not in text:
        return statuses
    code = {word: value for value, word in enumerate(STATUSES)}
    for index, row in enumerate(table.rows.cells):
        word = row[text["status"]].strip()
        if word and word not in code:
            raise DatasetError(
                f"row {table.rows.lines[index]}: status {word!r} is not known{nearest(word, code)}"
                f" (allowed: {', '.join(code)})"
            )
        statuses[index] = code.get(word, statuses[index])
    return statuses


def _per_pose(table: TableText, grid: _Grid, values: FloatArray) -> FloatArray:
    """Return TCP positions, shape (pose, 3), from rows of which those of a pose must agree."""
    positions, lines = np.full((len(grid.poses), len(AXES)), math.nan), table.rows.lines
    row, axis = np.nonzero(~np.isnan(values))
    positions[grid.pose[row], axis] = values[row, axis]
    for index in np.flatnonzero(positions[grid.pose[row], axis] != values[row, axis]):
        pose, component = grid.pose[row[index]], axis[index]
        other = row[(grid.pose[row] == pose) & (axis == component)][-1]
        raise DatasetError(
            f"tcp_position_{AXES[component]} of pose {grid.poses[pose]} is"
            f" {values[row[index], component]} m in row {lines[row[index]]} but"
            f" {values[other, component]} m in row {lines[other]}: a pose has one unloaded position"
        )
    return positions


def _cells(values: np.ndarray) -> list[object]:
    """Return Python floats, which the csv module writes with all their digits; NaN is empty."""
    return ["" if value != value else value for value in values.ravel().tolist()]
