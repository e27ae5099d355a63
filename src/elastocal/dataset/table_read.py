"""Read a dataset's CSV file: a row a reading (spec section 3)."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from elastocal.dataset.assembly import assemble
from elastocal.dataset.layout import AXES, MISSING, OK, SCHEMA, STATUSES, FloatArray
from elastocal.dataset.table_header import Column, parse_header
from elastocal.dataset.table_text import TableText, cut
from elastocal.errors import DatasetError, nearest
from elastocal.files import read_text

BoolArray = NDArray[np.bool_]

_MEASURED = ("force", "moment", "controller_displacement", "marker_displacement")
"""Vectors that, with the joint positions, make a reading; a row with none of them is missing."""


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


def read_table(path: Path) -> xr.Dataset:
    """Return the contents of a CSV file as a labelled dataset in SI units, not validated.

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
    arrays: dict[str, Any] = {name: grid.spread(values) for name, values in vectors.items()}
    if "tcp_position" in vectors:
        arrays["tcp_position"] = _per_pose(table, grid, vectors["tcp_position"])
    arrays["joint_position"] = grid.spread(joints)
    arrays["status"] = grid.spread(_statuses(table, header.text, empty), MISSING)
    labels: dict[str, Sequence[Any]] = {
        "pose": grid.poses,
        "load_case": grid.load_cases,
        "joint": [column.name for column in header.joints],
    }
    attributes = {"schema": SCHEMA, **table.attributes}
    return assemble(labels, arrays, header.joint_units, attributes)


def _grid(table: TableText, text: Mapping[str, int]) -> _Grid:
    """Return the place of each row; a (pose, load case) that stands twice is refused."""
    poses: dict[int, int] = {}
    cases: dict[str, int] = {}
    line_of: dict[tuple[int, int], int] = {}
    for line, row in zip(table.lines, table.rows, strict=True):
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
    values = np.empty((len(table.rows), len(columns)))
    for position, column in enumerate(columns):
        cells = [row[column.index] for row in table.rows]
        try:
            _refuse_underscore("".join(cells))
            values[:, position] = [float(cell) if cell else math.nan for cell in cells]
        except ValueError:
            # Rarely taken: some cell is blank or no number, and its row has to be found.
            values[:, position] = [
                _number(cell, line, column) for line, cell in zip(table.lines, cells, strict=True)
            ]
    # x * 1.0 is x, bit for bit: data in SI units pass unchanged.
    scaled: FloatArray = values * [column.scale for column in columns]
    return scaled


def _number(cell: str, line: int, column: Column) -> float:
    if not cell.strip():
        return math.nan
    try:
        _refuse_underscore(cell)
        return float(cell)
    except ValueError as error:
        hint = " (the decimal sign is a point)" if "," in cell else ""
        raise DatasetError(
            f"row {line}, column {column.header!r}: {cell!r} is not a number{hint}"
        ) from error


def _refuse_underscore(text: str) -> None:
    """Refuse ``1_5``, which is 15 to Python and a slip of the pen in a table."""
    if "_" in text:
        raise ValueError(text)


def _statuses(table: TableText, text: Mapping[str, int], empty: BoolArray) -> np.ndarray:
    """Return the status of each row, shape (row,); without a word an empty row is missing."""
    statuses = np.where(empty, MISSING, OK).astype(np.int8)
    if "status" not in text:
        return statuses
    code = {word: value for value, word in enumerate(STATUSES)}
    for index, row in enumerate(table.rows):
        word = row[text["status"]].strip()
        if word and word not in code:
            raise DatasetError(
                f"row {table.lines[index]}: status {word!r} is not known{nearest(word, code)}"
                f" (allowed: {', '.join(code)})"
            )
        statuses[index] = code.get(word, statuses[index])
    return statuses


def _per_pose(table: TableText, grid: _Grid, values: FloatArray) -> FloatArray:
    """Return TCP positions, shape (pose, 3), from rows of which those of a pose must agree."""
    positions = np.full((len(grid.poses), len(AXES)), math.nan)
    row, axis = np.nonzero(~np.isnan(values))
    positions[grid.pose[row], axis] = values[row, axis]
    for index in np.flatnonzero(positions[grid.pose[row], axis] != values[row, axis]):
        pose, component = grid.pose[row[index]], axis[index]
        other = row[(grid.pose[row] == pose) & (axis == component)][-1]
        raise DatasetError(
            f"tcp_position_{AXES[component]} of pose {grid.poses[pose]} is"
            f" {values[row[index], component]} m in row {table.lines[row[index]]} but"
            f" {values[other, component]} m in row {table.lines[other]}: a pose has one unloaded"
            " position"
        )
    return positions
