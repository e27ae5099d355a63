"""Rows of joints and forces, to predict deflections for (``ROWS.csv``).

Every other column is carried through untouched, in its place.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elastocal.dataset._header import cut
from elastocal.dataset._layout import AXES, FloatArray
from elastocal.errors import DatasetError, UnitError, nearest
from elastocal.files import read_text
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.tables import Column, TableError, TableRows, write_table
from elastocal.units import factor, split_column

LARGEST_FORCE, LARGEST_MOMENT = 1e5, 1e5
"""In N and N·m: what no sensor on a robot reads. Beyond, a number is no reading."""
_BEYOND = 0.1
"""Distance from a joint's limit, in rad or m, that the limits of a drawing may be wrong by; degrees
that were called radians lie farther off."""
_LARGEST_POSITION = 200.0 * np.pi
"""Of a joint without limits, in rad or m: 100 turns."""
_VISIT = "visit"
_EXAMPLES = {"angle": "rad", "length": "m", "force": "N", "moment": "N*m"}


@brief_repr
@dataclass(frozen=True, eq=False)
class LoadRows:
    """Configurations under load, with the text they were read from."""

    joint_position: FloatArray
    """Shape (row, joint), in rad or m."""
    force: FloatArray
    """Force on the robot at the tcp in base, shape (row, 3), in N."""
    moment: FloatArray | None
    """Moment on the robot about the tcp in base, shape (row, 3), in N·m; None: no columns."""
    visit: tuple[str, ...] | None
    """Rows with one text follow one another in time, shape (row,); None: no column, each row is a
    visit of its own."""
    header: tuple[str, ...]
    cells: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]
    """Line of the file that each row ends on."""


def read_robot_rows(path: Path, robot: Robot) -> LoadRows:
    """Return the rows of a CSV file for a robot, if it can stand and be loaded like that.

    Parameters
    ----------
    path : Path
        The file; its header names a unit for each quantity.
    robot : Robot
        The robot; its joints are columns of the file.

    Raises
    ------
    DatasetError
        If the file cannot be used (see `read_load_rows`), a joint is far outside its limits, or a
        force or moment is larger than any at a robot; by row, name, value and what is allowed.
    FileAccessError
        If the file cannot be read.
    """
    with np.errstate(over="ignore"):
        rows = read_load_rows(path, joint_dimensions(robot.joint_names, robot.revolute))
    limits, largest = robot.limits, np.full(len(robot.joint_names), _LARGEST_POSITION)
    low, high = np.maximum(limits.lower, -largest), np.minimum(limits.upper, largest)
    near = (rows.joint_position >= low - _BEYOND) & (rows.joint_position <= high + _BEYOND)
    for row, joint in np.argwhere(~near)[:1].tolist():
        value, unit = rows.joint_position[row, joint], "rad" if robot.revolute[joint] else "m"
        in_degrees = robot.revolute[joint] and low[joint] <= np.radians(value) <= high[joint]
        raise DatasetError(
            f"{path}: row {rows.lines[row]}: {robot.joint_names[joint]} of {value:.4g} {unit} is"
            f" outside its limits {low[joint]:.4g} to {high[joint]:.4g} {unit}"
            f"{': is it in degrees?' if in_degrees else ''}"
        )
    for name, values, most, unit in (
        ("force", rows.force, LARGEST_FORCE, "N"),
        ("moment", rows.moment, LARGEST_MOMENT, "N·m"),
    ):
        if values is None:
            continue
        for row, axis in np.argwhere(~(np.abs(values) <= most))[:1].tolist():
            raise DatasetError(
                f"{path}: row {rows.lines[row]}: {name}_{AXES[axis]} of {values[row, axis]:.4g}"
                f" {unit} is beyond {most:.0e} {unit}, more than any at a robot: is it in another"
                " unit?"
            )
    return rows


def read_load_rows(path: Path, joint_units: Mapping[str, str]) -> LoadRows:
    """Return the rows of a CSV file.

    Parameters
    ----------
    path : Path
        The file; its header names a unit for each quantity.
    joint_units : mapping of str to str
        The robot's joints, in its order, with their dimension: ``angle`` or ``length``.

    Raises
    ------
    DatasetError
        If a column is missing, has no unit or a wrong one, a cell is not a finite number, or a row
        is of no visit where others are.
    FileAccessError
        If the file cannot be read.
    """
    try:
        table = cut(read_text(path))
        columns = _columns(table.header)
        joints = [(name, dimension) for name, dimension in joint_units.items()]
        force = [(f"force_{axis}", "force") for axis in AXES]
        moment = [(f"moment_{axis}", "moment") for axis in AXES]
        has_moment = any(name in columns for name, _ in moment)
        wanted = [*joints, *force, *(moment if has_moment else [])]
        values = np.column_stack(
            [table.rows.numbers(_column(columns, *column)) for column in wanted]
        )
        visit = _visits(table.rows, columns)
    except (DatasetError, TableError, UnitError) as error:
        raise DatasetError(f"{path}: {error}") from error
    n = len(joints)
    return LoadRows(
        values[:, :n],
        values[:, n : n + 3],
        values[:, n + 3 :] if has_moment else None,
        visit,
        table.header,
        tuple(tuple(row) for row in table.rows.cells),
        tuple(table.rows.lines),
    )


def write_load_rows(path: Path, rows: LoadRows, added: Mapping[str, FloatArray]) -> None:
    """Write the rows with columns added at the end, atomically.

    Parameters
    ----------
    path : Path
        The file.
    rows : LoadRows
        As read.
    added : mapping of str to ndarray, shape (row,)
        Header and values of each new column; a column of that name is replaced.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    kept = [index for index, name in enumerate(rows.header) if name not in added]
    numbers = np.column_stack([*added.values()]).tolist()
    write_table(
        path,
        [*(rows.header[index] for index in kept), *added],
        (
            [*(cells[index] for index in kept), *new]
            for cells, new in zip(rows.cells, numbers, strict=True)
        ),
    )


def joint_dimensions(names: Sequence[str], revolute: Sequence[bool]) -> dict[str, str]:
    """Return the dimension of each joint's position, by name."""
    return {
        name: "angle" if turns else "length" for name, turns in zip(names, revolute, strict=True)
    }


def _columns(header: Sequence[str]) -> dict[str, tuple[int, str | None]]:
    columns: dict[str, tuple[int, str | None]] = {}
    for index, cell in enumerate(header):
        name, unit = split_column(cell)
        if name in columns:
            raise DatasetError(f"column {name!r} stands twice in the header")
        columns[name] = (index, unit)
    return columns


def _visits(
    rows: TableRows, columns: Mapping[str, tuple[int, str | None]]
) -> tuple[str, ...] | None:
    """Return the text of the column `visit`, which names visits as one likes."""
    if _VISIT not in columns:
        # Carried through as any other column it would cost the friction's memory, unseen.
        for name in columns:
            if name.casefold().removesuffix("s") == _VISIT:
                raise DatasetError(f"column {name!r} is written {_VISIT!r}")
        return None
    index, unit = columns[_VISIT]
    if unit is not None:
        raise DatasetError(f"column {_VISIT!r} is written without a unit, not in {unit}")
    visits = tuple(cells[index].strip() for cells in rows.cells)
    if "" in visits:
        line = rows.lines[visits.index("")]
        raise DatasetError(f"row {line}, column {_VISIT!r}: empty, but every row is of some visit")
    return visits


def _column(columns: Mapping[str, tuple[int, str | None]], name: str, dimension: str) -> Column:
    if name not in columns:
        raise DatasetError(
            f"column '{name}[…]' is missing{nearest(name, columns)} (columns: {', '.join(columns)})"
        )
    index, unit = columns[name]
    if unit is None:
        example = _EXAMPLES[dimension]
        raise DatasetError(f"column {name!r} has no unit: it is written {name}[{example}]")
    return Column(index, name, unit, factor(unit, dimension))
