"""The rows of a path file, read in blocks so that any length fits into memory, as SI numbers."""

import csv
import itertools
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.compensation.offline.path_columns import PathColumns, PathError, WrenchColumns
from elastocal.errors import FileAccessError
from elastocal.robot import T_from_xyzabc
from elastocal.tables import DELIMITERS, Column

_BLOCK = 1 << 20


@dataclass(frozen=True)
class TextLayout:
    """The layout of a file's text, so that it is written back the same way."""

    preamble: tuple[str, ...]
    """Comment and blank lines above the header, with their line ends."""
    header: tuple[str, ...]
    delimiter: str
    line_end: str


@dataclass(frozen=True)
class RowBlock:
    """Some consecutive rows."""

    cells: list[list[str]]
    """As they stand in the file."""
    lines: list[int]
    """Line of the file that each row ends on, from 1."""


def read_layout(path: Path) -> TextLayout:
    """Return how a path file is written.

    Raises
    ------
    PathError
        If it has no header.
    FileAccessError
        If it cannot be read.
    """
    with _opened(path) as file:
        preamble, line = _above(file)
    delimiter = max(DELIMITERS, key=line.count)
    bare = line.rstrip("\r\n")
    header = tuple(next(csv.reader([bare], delimiter=delimiter)))
    return TextLayout(tuple(preamble), header, delimiter, line[len(bare) :] or "\n")


def row_blocks(path: Path, layout: TextLayout, size: int) -> Iterator[RowBlock]:
    """Yield the rows of a path file, up to ``size`` at a time; blank lines are left out.

    Raises
    ------
    PathError
        If there is no row, a row is not as long as the header, or its quotes do not match.
    FileAccessError
        If the file cannot be read.
    """
    width, above, empty = len(layout.header), len(layout.preamble) + 1, True
    with _opened(path) as file:
        _above(file)
        reader = csv.reader(file, delimiter=layout.delimiter, strict=True)
        numbered = ((above + reader.line_num, row) for row in reader if any(map(str.strip, row)))
        while True:
            try:
                some = list(itertools.islice(numbered, size))
            except csv.Error as error:
                raise PathError(f"row {above + reader.line_num}: {error}") from error
            if not some:
                break
            empty = False
            for number, row in some:
                if len(row) != width:
                    raise PathError(
                        f"row {number} has {len(row)} cells, the header has {width}"
                        " (a decimal comma needs another delimiter, and the comma made a point)"
                    )
            yield RowBlock([row for _, row in some], [number for number, _ in some])
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


def _above(file: TextIO) -> tuple[list[str], str]:
    """Return the lines above the header, and the header's."""
    preamble: list[str] = []
    for line in file:
        if line.strip() and not line.startswith("#"):
            return preamble, line
        preamble.append(line)
    raise PathError("file has no header line")


@contextmanager
def _opened(path: Path) -> Iterator[TextIO]:
    """Yield a text file; its troubles are raised as ours."""
    try:
        with Path(path).open(encoding="utf-8-sig", newline="") as file:
            yield file
    except UnicodeDecodeError as error:
        raise FileAccessError(f"cannot read {path}: not a UTF-8 text file") from error
    except OSError as error:
        if isinstance(error, FileAccessError):
            raise
        raise FileAccessError(f"cannot read {path}: {error.strerror or error}") from error


_MOST = 2.0 * np.pi * (1.0 + 1e-6)
"""In rad; controllers write orientations within half a turn, some within a whole one."""


def beyond_a_turn(angles: FloatArray) -> tuple[int, int] | None:
    """Return row and column of the first angle of an orientation that is more than a turn.

    Parameters
    ----------
    angles : ndarray, shape (row, 3)
        In rad.

    >>> beyond_a_turn(np.array([[0.0, 3.1, -6.28], [0.0, 90.0, 0.0]]))
    (1, 1)
    """
    found = np.argwhere(~(np.abs(angles) <= _MOST))
    return (int(found[0, 0]), int(found[0, 1])) if len(found) else None


_UNIT_NORM = 1e-3
"""Largest distance of the norm of a quaternion from 1."""


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


def read_values(block: RowBlock, columns: PathColumns) -> PathValues:
    """Return the numbers of some rows.

    Raises
    ------
    PathError
        If a cell is not a finite number, a quaternion is not of unit length, or an angle is more
        than a turn.
    """

    def numbers(some: Sequence[Column]) -> FloatArray:
        return np.column_stack([np.empty((len(block.cells), 0)), *(_read(block, c) for c in some)])

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
    turned: FloatArray = (T_base_tcp[:, :3, :3] @ vectors[:, :, None])[:, :, 0]
    return turned


def _read(block: RowBlock, column: Column) -> FloatArray:
    index = column.index
    try:
        values = np.array([float(row[index]) for row in block.cells])
    except ValueError:
        values = np.array([_or_nan(row[index]) for row in block.cells])
    finite = np.isfinite(values)
    if not finite.all():
        bad = int(np.argmin(finite))
        cell = block.cells[bad][index]
        raise PathError(
            f"row {block.lines[bad]}, column {_named(column)!r}: {cell!r} is not a finite number"
        )
    return values * column.scale


def _or_nan(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return np.nan


def _named(column: Column) -> str:
    return column.header if column.unit else column.name


def _check_angles(block: RowBlock, columns: Sequence[Column], angles: FloatArray) -> None:
    found = beyond_a_turn(angles)
    if found is not None:
        row, k = found
        raise PathError(
            f"row {block.lines[row]}, column {_named(columns[k])!r}: an orientation of"
            f" {np.degrees(angles[row, k]):.4g} deg is more than a turn: is it in degrees?"
        )


def _poses(block: RowBlock, position: FloatArray, orientation: FloatArray) -> FloatArray:
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
