"""The rows of a path file, read in blocks so that any length fits into memory, as SI numbers."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.compensation.offline.path_columns import PathColumns, PathError, WrenchColumns
from elastocal.errors import FileAccessError
from elastocal.results import brief_repr
from elastocal.robot import T_from_xyzabc
from elastocal.tables import Column, TableError, TableLayout, TableRows, opened_table

_BLOCK = 1 << 20
_MOST = 2.0 * np.pi * (1.0 + 1e-6)
"""In rad; controllers write orientations within half a turn, some within a whole one."""
_UNIT_NORM = 1e-3
"""Largest distance of the norm of a quaternion from 1."""


def read_layout(path: Path) -> TableLayout:
    """Return how a path file is written, so that it is written back the same way.

    Raises
    ------
    PathError
        If it has no header.
    FileAccessError
        If it cannot be read.
    """
    with _as_path_errors(), opened_table(path) as table:
        if not table.layout.header:
            raise PathError("file has no header line")
        return table.layout


def row_blocks(path: Path, layout: TableLayout, size: int) -> Iterator[TableRows]:
    """Yield the rows of a path file, up to ``size`` at a time; blank lines are left out.

    Raises
    ------
    PathError
        If there is no row, a row is not as long as the header, or its quotes do not match.
    FileAccessError
        If the file cannot be read.
    """
    width, empty = len(layout.header), True
    with _as_path_errors(), opened_table(path) as table:
        for block in table.pieces(size):
            empty = False
            if uneven := block.uneven(width):
                raise PathError(
                    f"row {uneven[0]} has {uneven[1]} cells, the header has {width}"
                    " (a decimal comma needs another delimiter, and the comma made a point)"
                )
            yield block
    if empty:
        raise PathError("path has a header but no row")


def count_lines(path: Path) -> int:
    """Return the number of lines of a file, for a progress bar.

    Raises
    ------
    FileAccessError
        If it cannot be read.
    """
    try:
        with Path(path).open("rb") as file:
            return sum(block.count(b"\n") for block in iter(lambda: file.read(_BLOCK), b""))
    except OSError as error:
        raise FileAccessError(f"cannot read {path}: {error.strerror or error}") from error


@contextmanager
def _as_path_errors() -> Iterator[None]:
    """Raise what is wrong with a table as what is wrong with a path."""
    try:
        yield
    except TableError as error:
        raise PathError(str(error)) from error


def beyond_a_turn(angles: FloatArray) -> tuple[int, int] | None:
    """Return row and column of the first angle of an orientation that is more than a turn.

    >>> beyond_a_turn(np.array([[0.0, 3.1, -6.28], [0.0, 90.0, 0.0]]))
    (1, 1)

    Parameters
    ----------
    angles : ndarray, shape (row, 3)
        In rad.
    """
    found = np.argwhere(~(np.abs(angles) <= _MOST))
    return (int(found[0, 0]), int(found[0, 1])) if len(found) else None


@brief_repr
@dataclass(frozen=True, eq=False)
class PathValues:
    """Some rows of a path; joints or poses, as the file has them."""

    joints: FloatArray
    """All joints, or the external axes that a path of poses gives, shape (row, …), rad or m."""
    T_base_tcp: FloatArray | None
    """Programmed poses, shape (row, 4, 4), in m; None in a path of joints."""
    force: FloatArray | None
    """As the file has it, shape (row, 3), in N; `turned_to_base` turns it."""
    moment: FloatArray | None
    """The same in N·m."""


def read_values(block: TableRows, columns: PathColumns) -> PathValues:
    """Return the numbers of some rows.

    Raises
    ------
    PathError
        If a cell is not a finite number, a quaternion is not of unit length, or an angle is more
        than a turn.
    """

    def numbers(some: Sequence[Column]) -> FloatArray:
        with _as_path_errors():
            return np.column_stack(
                [
                    np.empty((len(block.cells), 0)),
                    *(block.numbers(column, _finite) for column in some),
                ]
            )

    pose = None
    if columns.by_pose:
        position, orientation = numbers(columns.position), numbers(columns.orientation)
        if len(columns.orientation) == 3:
            _check_angles(block, columns.orientation, orientation)
        pose = _poses(block, position, orientation)
    wrenches = [
        None if each is None else numbers(each.columns) for each in (columns.force, columns.moment)
    ]
    return PathValues(numbers(columns.joints), pose, *wrenches)


def turned_to_base(
    vectors: FloatArray | None, wrench: WrenchColumns | None, T_base_tcp: FloatArray
) -> FloatArray | None:
    """Return forces or moments in base axes.

    Parameters
    ----------
    vectors : ndarray, shape (row, 3), or None
        As the file has them.
    wrench : WrenchColumns or None
        The columns that they are from.
    T_base_tcp : ndarray, shape (row, 4, 4)
        Programmed poses.
    """
    if vectors is None or wrench is None or not wrench.in_tcp:
        return vectors
    return (T_base_tcp[:, :3, :3] @ vectors[:, :, None])[:, :, 0]


def _finite(cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise ValueError("is not a finite number")
    return value


def _check_angles(block: TableRows, columns: Sequence[Column], angles: FloatArray) -> None:
    found = beyond_a_turn(angles)
    if found is not None:
        row, k = found
        raise PathError(
            f"row {block.lines[row]}, column {columns[k].header!r}: an orientation of"
            f" {np.degrees(angles[row, k]):.4g} deg is more than a turn: is it in degrees?"
        )


def _poses(block: TableRows, position: FloatArray, orientation: FloatArray) -> FloatArray:
    if orientation.shape[1] == 3:
        return T_from_xyzabc(*position.T, *orientation.T)
    norm = np.linalg.norm(orientation, axis=1)
    unit = np.abs(norm - 1.0) <= _UNIT_NORM
    if not unit.all():
        bad = int(np.argmin(unit))
        raise PathError(
            f"row {block.lines[bad]}: quaternion qx, qy, qz, qw has norm {norm[bad]:.6g}, it must"
            f" be 1 (within {_UNIT_NORM:g})"
        )
    T = np.tile(np.eye(4), (len(position), 1, 1))
    T[:, :3, :3] = Rotation.from_quat(orientation).as_matrix()
    T[:, :3, 3] = position
    return T
