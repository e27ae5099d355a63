"""The numbers of a path's rows, in SI units."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.compensation.path.angles import beyond_a_turn
from elastocal.compensation.path.columns import EULER, PathColumns, Wrench
from elastocal.compensation.path.errors import PathError
from elastocal.compensation.path.text import Piece
from elastocal.robot import T_from_xyzabc
from elastocal.tables import Column

_UNIT_NORM = 1e-3
"""How far the norm of a quaternion may be from 1."""


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


def read_values(piece: Piece, columns: PathColumns) -> PathValues:
    """Return the numbers of some rows.

    Raises
    ------
    PathError
        If a cell is not a finite number, a quaternion is not of unit length, or an angle is more
        than a turn.
    """

    def numbers(some: Sequence[Column]) -> FloatArray:
        return np.column_stack([np.empty((len(piece.cells), 0)), *(_read(piece, c) for c in some)])

    pose = None
    if columns.by_pose:
        position, orientation = numbers(columns.position), numbers(columns.orientation)
        if len(columns.orientation) == len(EULER):
            _check_angles(piece, columns.orientation, orientation)
        pose = _poses(piece, position, orientation)
    wrenches = [
        None if each is None else numbers(each.columns) for each in (columns.force, columns.moment)
    ]
    return PathValues(numbers(columns.joints), pose, *wrenches)


def turned_to_base(
    vectors: FloatArray | None, wrench: Wrench | None, T_base_tcp: FloatArray
) -> FloatArray | None:
    """Return forces or moments in base axes.

    Parameters
    ----------
    vectors : ndarray, shape (row, 3), or None
        As the file has them.
    wrench : Wrench or None
        The columns that they are from.
    T_base_tcp : ndarray, shape (row, 4, 4)
        Programmed poses.
    """
    if vectors is None or wrench is None or not wrench.in_tcp:
        return vectors
    turned: FloatArray = (T_base_tcp[:, :3, :3] @ vectors[:, :, None])[:, :, 0]
    return turned


def _read(piece: Piece, column: Column) -> FloatArray:
    index = column.index
    try:
        values = np.array([float(row[index]) for row in piece.cells])
    except ValueError:
        values = np.array([_or_nan(row[index]) for row in piece.cells])
    finite = np.isfinite(values)
    if not finite.all():
        bad = int(np.argmin(finite))
        cell = piece.cells[bad][index]
        raise PathError(
            f"row {piece.lines[bad]}, column {_named(column)!r}: {cell!r} is not a finite number"
        )
    return values * column.scale


def _or_nan(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return np.nan


def _named(column: Column) -> str:
    return column.header if column.unit else column.name


def _check_angles(piece: Piece, columns: Sequence[Column], angles: FloatArray) -> None:
    found = beyond_a_turn(angles)
    if found is not None:
        row, k = found
        raise PathError(
            f"row {piece.lines[row]}, column {_named(columns[k])!r}: an orientation of"
            f" {np.degrees(angles[row, k]):.4g} deg is more than a turn: is it in degrees?"
        )


def _poses(piece: Piece, position: FloatArray, orientation: FloatArray) -> FloatArray:
    if orientation.shape[1] == 3:
        return T_from_xyzabc(*position.T, *orientation.T)
    norm = np.linalg.norm(orientation, axis=1)
    unit = np.abs(norm - 1.0) <= _UNIT_NORM
    if not unit.all():
        bad = int(np.argmin(unit))
        raise PathError(
            f"row {piece.lines[bad]}: quaternion qx, qy, qz, qw has norm {norm[bad]:.6g}, it must"
            f" be 1 (within {_UNIT_NORM:g})"
        )
    T = np.tile(np.eye(4), (len(position), 1, 1))
    T[:, :3, :3] = Rotation.from_quat(orientation).as_matrix()
    T[:, :3, 3] = position
    return T
