"""The header of a dataset's CSV file: which column holds what, in which unit (spec section 3)."""

from collections.abc import Sequence
from dataclasses import dataclass

from elastocal.dataset._layout import (
    COLUMN_NAMES,
    JOINT_UNITS,
    SI_JOINT_UNITS,
    TEXT_COLUMNS,
    VECTORS,
    Variable,
    joint_name_problem,
)
from elastocal.errors import DatasetError, UnitError, nearest
from elastocal.tables import Column
from elastocal.units import factor, split_column

_JOINT_HINT = "a joint column is written name[rad], name[deg], name[m] or name[mm]"
_VARIABLE_OF = {column: variable for variable in VECTORS for column in variable.columns}


@dataclass(frozen=True)
class Header:
    """The columns of a file, by what they hold."""

    width: int
    """Number of columns."""
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
    return Header(len(cells), text, joints, _vectors(numbers))


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
        present = [name for name in variable.columns if name in numbers]
        if present or variable.required:
            _check_whole(variable, present)
            vectors[variable.name] = tuple(numbers[name] for name in variable.columns)
    return vectors


def _check_whole(variable: Variable, present: Sequence[str]) -> None:
    for name in variable.columns:
        if name not in present:
            raise DatasetError(f"column '{name}[{variable.column_unit}]' is missing")
