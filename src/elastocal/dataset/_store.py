"""Dataset files: NetCDF, or its lossless twin in CSV with a row a reading, as the suffix says.

The header of a dataset's CSV file: its attributes, and which column holds what in which unit.

Attributes precede the header as comment lines, their texts in JSON so that each fits on one line.
"""

import difflib
import io
import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elastocal.dataset._layout import (
    ATTRIBUTES,
    CF_ATTRIBUTES,
    COLUMN_NAMES,
    CONTACTS,
    JOINT_PREFIXES,
    JOINT_UNITS,
    MADE_FROM,
    MISSING,
    OK,
    SCHEMA_2,
    SEQUENCE,
    SI_JOINT_UNITS,
    SIMILAR,
    STATUSES,
    TEXT_COLUMNS,
    VARIABLES,
    VECTORS,
    BoolArray,
    FloatArray,
    IntArray,
    StatusArray,
    Variable,
    joint_name_problem,
)
from elastocal.dataset._structure import assemble
from elastocal.dataset.dataset import Dataset
from elastocal.errors import DatasetError, SchemaError, UnitError, nearest
from elastocal.files import as_path, read_text
from elastocal.records import LabelledArrays, arrays_sha256, parse_json, read_arrays, write_arrays
from elastocal.tables import (
    Column,
    TableError,
    TableReader,
    TableRows,
    number_in_cell,
    plain_text,
    write_table as write_rows,
)
from elastocal.units import factor, parse_number, split_column

_JOINT_HINT = "a joint column is written name[rad], name[deg], name[m] or name[mm]"
_VARIABLE_OF = {column: variable for variable in VECTORS for column in variable.columns}
_MOST_COUNTED = 10**15
"""Largest label of a pose, and place in the order of the readings."""
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
    """Position of ``pose``, ``load_case`` and, where present, ``status``, ``sequence``,
    ``contacts`` and ``campaign``."""
    joints: tuple[Column, ...]
    """Joint positions, in the order of the file."""
    vectors: dict[str, tuple[Column, ...]]
    """The x, y and z columns of each vector that is present."""
    other_joints: dict[str, tuple[Column, ...]]
    """The columns of each further variable of joints that is present, in the joints' order."""

    @property
    def joint_units(self) -> tuple[str, ...]:
        """SI unit of each joint."""
        return tuple(SI_JOINT_UNITS[JOINT_UNITS[column.unit]] for column in self.joints)

    def components(self, variable: Variable) -> tuple[str, ...]:
        """Return each component of a variable as an SI column is headed."""
        if variable.name in self.vectors:
            return tuple(f"{name}[{variable.column_unit}]" for name in variable.columns)
        columns = zip(self.other_joints[variable.name], self.joint_units, strict=True)
        return tuple(f"{column.name}[{unit}]" for column, unit in columns)


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
    """Return the attribute that a comment line states; None for any other comment."""
    match = _ATTRIBUTE.fullmatch(line)
    if match is None:
        return {}
    known, name = (*ATTRIBUTES, *CF_ATTRIBUTES), match[1]
    try:
        value = parse_json(match[2], f"row {number}")
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
    joints, others = _joints([each for name, each in numbers.items() if name not in _VARIABLE_OF])
    if not joints:
        raise DatasetError(f"no joint column: {_JOINT_HINT}")
    return Header(text, joints, _vectors(numbers), others)


def _joints(
    columns: Sequence[Column],
) -> tuple[tuple[Column, ...], dict[str, tuple[Column, ...]]]:
    """Return the columns of the joint positions, and those of each further variable of joints."""
    known = {column.name: column for column in columns}
    others = {prefix + name for prefix in JOINT_PREFIXES for name in known} & set(known)
    joints = tuple(column for column in columns if column.name not in others)
    for column in joints:
        rest = next((each.name for each in joints if column.name.endswith(f"_{each.name}")), None)
        prefixed = [] if rest is None else [prefix + rest for prefix in JOINT_PREFIXES]
        similar = difflib.get_close_matches(column.name, prefixed, n=1, cutoff=SIMILAR)
        if similar:
            raise DatasetError(
                f"column {column.header!r} is not known; did you mean {similar[0]!r}?"
            )
    found: dict[str, tuple[Column, ...]] = {}
    for prefix, variable in JOINT_PREFIXES.items():
        named = [known.get(prefix + joint.name) for joint in joints]
        present = tuple(column for column in named if column is not None)
        if present:
            _check_columns(prefix, joints, named)
            found[variable.name] = present
    return joints, found


def _check_columns(prefix: str, joints: Sequence[Column], columns: Sequence[Column | None]) -> None:
    """Refuse a variable of joints that lacks a joint, or has another kind of unit than it."""
    for joint, column in zip(joints, columns, strict=True):
        units = [unit for unit, kind in JOINT_UNITS.items() if kind == JOINT_UNITS[joint.unit]]
        if column is None:
            raise DatasetError(f"column '{prefix}{joint.name}[{units[0]}]' is missing")
        if column.unit not in units:
            raise DatasetError(
                f"column {column.header!r}: the unit must be {' or '.join(units)}, as that of"
                f" {joint.header!r}"
            )


def missing_column(column: str, variable: Variable) -> DatasetError:
    return DatasetError(f"column '{column}[{variable.column_unit}]' is missing")


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
        needed = variable.required and not variable.optional_in
        if missing and (needed or len(missing) < len(variable.columns)):
            raise missing_column(missing[0], variable)
        if not missing:
            vectors[variable.name] = tuple(numbers[name] for name in variable.columns)
    return vectors


_MEASURED = ("force", "moment", "controller_displacement", "marker_displacement")
"""Vectors that, with the joint positions, make a reading; a row with none of them is missing."""
_SUFFIXES = (".nc", ".csv")


def read(path: Path | str) -> Dataset:
    """Return the dataset in a file, validated and plausible.

    Parameters
    ----------
    path : path-like
        A NetCDF4 file (``.nc``) or its CSV twin (``.csv``).

    Raises
    ------
    DatasetError
        If the suffix is unknown or the contents break the contract; the message names the file.
    SchemaError
        If the schema of the file is not known.
    FileAccessError
        If the file cannot be read.
    """
    path = as_path(path, "path")
    arrays = _read_netcdf(path) if _suffix(path) == ".nc" else None
    try:
        dataset = Dataset.from_labelled(arrays or read_table(path))
        dataset.require_plausible()
    except (DatasetError, SchemaError) as error:
        raise type(error)(f"{path}: {error}") from error
    return dataset


def write(dataset: Dataset, path: Path | str) -> None:
    """Write a dataset to a file, whole or not at all.

    Parameters
    ----------
    dataset : Dataset
        What to write.
    path : path-like
        A file name that ends in ``.nc`` or ``.csv``.

    Raises
    ------
    DatasetError
        If the suffix is unknown.
    FileAccessError
        If the file cannot be written.
    """
    path = Path(path)
    if _suffix(path) == ".nc":
        write_arrays(path, dataset.to_labelled())
    else:
        write_table(dataset, path)


def content_sha256(dataset: Dataset) -> str:
    """Return the SHA-256 of what a dataset says: the same for a NetCDF file and its CSV twin.

    Its origin does not count, so that a run that is moved and derived again has the same.
    """
    return arrays_sha256(dataset.to_labelled(), without=("provenance", MADE_FROM))


def _suffix(path: Path) -> str:
    suffix = path.suffix.lower()
    if suffix not in _SUFFIXES:
        raise DatasetError(
            f"{path}: suffix {path.suffix!r} is not that of a dataset: allowed are"
            f" {', '.join(_SUFFIXES)}"
        )
    return suffix


def _read_netcdf(path: Path) -> LabelledArrays:
    try:
        return read_arrays(path)
    except SchemaError as error:
        raise DatasetError(str(error)) from error


read_dataset = read
"""`read` under its name in the public face of `elastocal`."""


@dataclass(frozen=True)
class _Grid:
    """Position of each row among poses and load cases, both in order of first appearance."""

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
    for variable in VECTORS:
        needed = variable.required and variable.optional_in != table.attributes.get("schema")
        if needed and variable.name not in header.vectors:
            raise missing_column(variable.columns[0], variable)
    grid = _grid(table, header.text)
    joints = _numbers(table, header.joints)
    vectors = {name: _numbers(table, columns) for name, columns in header.vectors.items()}
    measured = [joints, *(vectors[name] for name in _MEASURED if name in vectors)]
    empty = np.asarray(np.isnan(np.hstack(measured)).all(axis=1))
    vectors |= {name: _numbers(table, columns) for name, columns in header.other_joints.items()}
    arrays: dict[str, np.ndarray] = {"joint_position": grid.spread(joints)}
    for variable in VARIABLES:
        values = vectors.get(variable.name)
        if values is not None:
            by_pose = "load_case" not in variable.dims
            names = header.components(variable)
            spread = _per_pose(table, grid, names, values) if by_pose else grid.spread(values)
            arrays[variable.name] = spread
    statuses = _statuses(table, header.text, empty)
    arrays["status"] = grid.spread(statuses, MISSING)
    if SEQUENCE.name in header.text:
        places = _whole_numbers(table, header.text[SEQUENCE.name], SEQUENCE.name, statuses)
        arrays[SEQUENCE.name] = grid.spread(places, -1)
    if CONTACTS.name in header.text:
        stacked = _whole_numbers(table, header.text[CONTACTS.name], CONTACTS.name, statuses)
        arrays[CONTACTS.name] = grid.spread(stacked, 1)
    labels: dict[str, ArrayLike | None] = {
        "pose": grid.poses,
        "load_case": grid.load_cases,
        "joint": [column.name for column in header.joints],
        "campaign": _campaigns(table, grid, header.text) if "campaign" in header.text else None,
    }
    return assemble(labels, arrays, header.joint_units, {"schema": SCHEMA_2, **table.attributes})


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
    if data.sequence is not None:
        columns["sequence"] = list(data.sequence.ravel().tolist())
    if data.contacts is not None:
        columns["contacts"] = list(data.contacts.ravel().tolist())
    if data.campaigns:
        columns["campaign"] = [name for name in data.campaigns for _ in data.load_cases]
    prefixes = {variable: prefix for prefix, variable in JOINT_PREFIXES.items()}
    for variable in VARIABLES:
        values = data.arrays.get(variable.name)
        if values is None:
            continue
        if "load_case" not in variable.dims:
            values = np.broadcast_to(values[:, None], (*data.status.shape, values.shape[-1]))
        heads = [f"{name}[{variable.column_unit}]" for name in variable.columns]
        if "joint" in variable.dims:
            joints = zip(data.joint_names, data.joint_units, strict=True)
            heads = [f"{prefixes.get(variable, '')}{name}[{unit}]" for name, unit in joints]
        for index, head in enumerate(heads):
            columns[head] = _cells(values[..., index])
    stated = {name: text for name, text in data.attributes.items() if text}
    rows = zip(*columns.values(), strict=True)
    write_rows(path, tuple(columns), rows, tuple(attribute_lines(stated)))


def _grid(table: TableText, text: Mapping[str, int]) -> _Grid:
    """Return the position of each row; a repeated (pose, load case) is refused."""
    poses: dict[int, int] = {}
    cases: dict[str, int] = {}
    line_of: dict[tuple[int, int], int] = {}
    for line, row in zip(table.rows.lines, table.rows.cells, strict=True):
        pose = _integer("pose", row[text["pose"]], line)
        case = plain_text(row[text["load_case"]].strip())
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


def _integer(name: str, cell: str, line: int) -> int:
    try:
        parse_number(cell)
        number = int(cell)
    except ValueError as error:
        raise DatasetError(f"row {line}: {name} is {cell!r}: it must be an integer") from error
    if not -_MOST_COUNTED <= number <= _MOST_COUNTED:
        raise DatasetError(
            f"row {line}: {name} is {cell!r}: it must lie within ±{_MOST_COUNTED:.0e}"
        )
    return number


def _numbers(table: TableText, columns: Sequence[Column]) -> FloatArray:
    """Return columns of numbers in SI units, shape (row, column); an empty cell is NaN."""
    try:
        return np.column_stack([table.rows.numbers(column, _number) for column in columns])
    except TableError as error:
        raise DatasetError(str(error)) from error


def _number(cell: str) -> float:
    if not cell.strip():
        return math.nan
    return number_in_cell(cell)


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


def _whole_numbers(table: TableText, column: int, name: str, statuses: StatusArray) -> IntArray:
    """Return a column of whole numbers, shape (row,); a missing reading may have none: -1."""
    numbers = np.full(len(table.rows), -1, dtype=np.int64)
    for index, row in enumerate(table.rows.cells):
        cell = row[column]
        if cell.strip() or statuses[index] != MISSING:
            numbers[index] = _integer(name, cell, table.rows.lines[index])
    return numbers


def _campaigns(table: TableText, grid: _Grid, text: Mapping[str, int]) -> list[str]:
    """Return the campaign of each pose, shape (pose,), on which its rows must agree."""
    campaigns = [""] * len(grid.poses)
    for index, row in enumerate(table.rows.cells):
        name, pose = plain_text(row[text["campaign"]].strip()), int(grid.pose[index])
        if campaigns[pose] not in ("", name):
            raise DatasetError(
                f"row {table.rows.lines[index]}: campaign of pose {grid.poses[pose]} is {name!r},"
                f" but {campaigns[pose]!r} above: a pose belongs to one campaign"
            )
        campaigns[pose] = name
    return campaigns


def _per_pose(
    table: TableText, grid: _Grid, columns: Sequence[str], values: FloatArray
) -> FloatArray:
    """Return the single value of each pose, shape (pose, column), from rows that must agree on it.

    ``columns`` are the headers of the values in SI units.
    """
    ones, lines = np.full((len(grid.poses), values.shape[1]), math.nan), table.rows.lines
    row, column = np.nonzero(~np.isnan(values))
    ones[grid.pose[row], column] = values[row, column]
    for index in np.flatnonzero(ones[grid.pose[row], column] != values[row, column]):
        pose, component = grid.pose[row[index]], column[index]
        other = row[(grid.pose[row] == pose) & (column == component)][-1]
        name, unit = split_column(columns[component])
        raise DatasetError(
            f"{name} of pose {grid.poses[pose]} is {values[row[index], component]} {unit} in row"
            f" {lines[row[index]]} but {values[other, component]} {unit} in row {lines[other]}:"
            f" a pose has one {'unloaded position' if name.startswith('tcp_') else 'reference'}"
        )
    return ones


def _cells(values: np.ndarray) -> list[object]:
    """Return Python floats, which the csv module writes with all their digits; NaN is empty."""
    return ["" if value != value else value for value in values.ravel().tolist()]
