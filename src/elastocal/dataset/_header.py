"""The header of a dataset's CSV file: its attributes, and which column holds what in which unit.

Attributes stand above the header as comment lines, their texts in JSON so that each fits on one
line.
"""

import difflib
import io
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from elastocal.dataset._layout import (
    ATTRIBUTES,
    CF_ATTRIBUTES,
    COLUMN_NAMES,
    JOINT_PREFIXES,
    JOINT_UNITS,
    SI_JOINT_UNITS,
    SIMILAR,
    TEXT_COLUMNS,
    VECTORS,
    Variable,
    joint_name_problem,
)
from elastocal.errors import DatasetError, UnitError, nearest
from elastocal.records import parse_json
from elastocal.tables import Column, TableError, TableReader, TableRows
from elastocal.units import factor, split_column

_JOINT_HINT = "a joint column is written name[rad], name[deg], name[m] or name[mm]"
_VARIABLE_OF = {column: variable for variable in VECTORS for column in variable.columns}
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
    """Position of ``pose``, ``load_case`` and, where present, ``status``, ``sequence`` and
    ``campaign``."""
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
    """Return the attribute that a comment line states; none when it is a person's remark."""
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
