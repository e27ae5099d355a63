"""Rows of joints or poses with a wrench (``PATH.csv``, ``ROWS.csv``): the one reader and writer.

Every command that takes such rows reads them here, in SI units, so that one rule decides which
numbers are refused: not finite, a joint far outside its limits, an angle of more than a turn, an
impossible force. Rows are read in blocks, so that a path of any length fits into memory; other
columns are carried through unchanged. Only finite numbers are written.
"""

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.dataset.path_columns import (
    PathColumns,
    WrenchColumns,
    find_names,
    find_time,
    plausible_range,
)
from elastocal.errors import PathError
from elastocal.results import brief_repr
from elastocal.robot import Robot, T_from_xyzabc
from elastocal.tables import Column, TableError, TableLayout, TableRows, new_table, opened_table

Columns = Mapping[str, ArrayLike]
"""Columns by their headings, each of shape (row,): a dictionary, or a data frame."""
_TURN = 2.0 * np.pi * (1.0 + 1e-6)
"""In rad; controllers write orientations within half a turn, some within a full one."""
_UNIT_NORM = 2e-3
"""Largest distance of the norm of a quaternion from 1: three digits may have been written."""
_BLOCK = 20_000
"""Rows that are read at a time where only some are kept."""


@contextmanager
def in_file(path: Path) -> Iterator[None]:
    """Name the file in a refusal that comes up inside.

    Raises
    ------
    PathError
        The same with the file's name before it.
    """
    try:
        yield
    except PathError as error:
        raise PathError(f"{path}: {error}") from error


@brief_repr
@dataclass(frozen=True, eq=False)
class PathRows:
    """Some rows, joints or poses as the file has them, with the text they were read from."""

    table: TableRows
    header: tuple[str, ...]
    columns: PathColumns
    joints: FloatArray
    """All joints, or the external axes that a path of poses gives, shape (row, …), rad or m."""
    T_base_tcp: FloatArray | None
    """Programmed poses, shape (row, 4, 4), in m; None in a path of joints. Of an orientation
    without a position the latter is 0."""
    force: FloatArray | None
    """Force as in the file, shape (row, 3), in N; `wrench_in_base` rotates it."""
    moment: FloatArray | None
    """The same in N·m."""

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.table)

    def label(self, row: int) -> str:
        """Return a row's name for a person: the line of the file that it ends on."""
        return f"row {self.table.lines[row]}"

    def part(self, rows: slice) -> "PathRows":
        """Return some of the rows."""

        def some(array: FloatArray | None) -> FloatArray | None:
            return None if array is None else array[rows]

        table = replace(self.table, cells=self.table.cells[rows], lines=self.table.lines[rows])
        return replace(
            self,
            table=table,
            joints=self.joints[rows],
            T_base_tcp=some(self.T_base_tcp),
            force=some(self.force),
            moment=some(self.moment),
        )

    def names(self, column: str) -> tuple[str, ...] | None:
        """Return the texts of a column of names, such as ``course``; None where there is none.

        Raises
        ------
        PathError
            If a row has none, or the column is written otherwise.
        """
        place = find_names(self.header, column)
        if place is None:
            return None
        names = tuple(cells[place].strip() for cells in self.table.cells)
        if "" in names:
            row = self.label(names.index(""))
            raise PathError(f"{row}, column {column!r}: empty, but every row is of some {column}")
        return names

    def times(self) -> FloatArray | None:
        """Return the time of each row, shape (row,), in s; None where there is no column.

        Raises
        ------
        PathError
            If the column or a cell of it cannot be read.
        """
        column = find_time(self.header)
        return None if column is None else _numbers(self.table, (column,), None)[:, 0]

    def wrench_in_base(self, T_base_tcp: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Return forces and moments in base axes, shape (row, 3), in N and N·m.

        Parameters
        ----------
        T_base_tcp : ndarray, shape (row, 4, 4)
            Programmed poses.

        Raises
        ------
        PathError
            If there are no forces.
        """
        force = _in_base(self.force, self.columns.force, T_base_tcp)
        if force is None:
            raise PathError("path has no forces")
        return force, _in_base(self.moment, self.columns.moment, T_base_tcp)


@brief_repr
@dataclass(frozen=True)
class PathTable:
    """A file of rows: how it is written, and what its columns hold."""

    path: Path
    layout: TableLayout
    columns: PathColumns
    held: TableRows | None = None
    """Rows that are of no file."""

    @classmethod
    def of(cls, table: Columns, find: Callable[[Sequence[str]], PathColumns]) -> "PathTable":
        """Return the table of columns that are given, such as those of a data frame.

        Parameters
        ----------
        table : mapping
            Column of each heading; the headings are those of a file, with their units.
        find : callable
            As in `open`.

        Raises
        ------
        PathError
            If a column is none, columns differ in length, or the headings do not fit.
        """
        if not hasattr(table, "keys"):
            raise PathError(
                f"rows are {type(table).__name__}: they must be a file, a dataset, or columns by"
                " their headings"
            )
        columns = {str(name): np.asarray(table[name]) for name in table}
        for name, column in columns.items():
            if column.ndim != 1 or len(column) != len(next(iter(columns.values()))):
                raise PathError(
                    f"column {name!r} has shape {column.shape}: every column has one value a row,"
                    " and all are of one length"
                )
        values = [column.tolist() for column in columns.values()]
        cells = [list(map(str, row)) for row in zip(*values, strict=True)]
        layout = TableLayout(tuple(columns))
        if not cells:
            raise PathError("rows have no row")
        held = TableRows(cells, list(range(1, len(cells) + 1)))
        return cls(Path("rows"), layout, find(layout.header), held)

    @classmethod
    def open(cls, path: Path, find: Callable[[Sequence[str]], PathColumns]) -> "PathTable":
        """Return the table of a file, none of its rows read yet.

        Parameters
        ----------
        path : Path
            The file.
        find : callable
            Finds the columns in the header; see `find_columns` and its neighbours.

        Raises
        ------
        PathError
            If there is no header, or its columns do not fit.
        FileAccessError
            If the file cannot be read.
        """
        with _as_path_errors(), opened_table(path) as table:
            layout = table.layout
        if not layout.header:
            raise PathError("file has no header line")
        return cls(path, layout, find(layout.header))

    def blocks(self, size: int) -> Iterator[PathRows]:
        """Yield the rows, up to ``size`` at a time; blank lines are left out.

        Raises
        ------
        PathError
            If there is no row, a row is not as long as the header or its quotes do not match; if a
            number is none, or cannot be meant: by row, column, value and what is allowed.
        FileAccessError
            If the file cannot be read.
        """
        return (self._rows(block) for block in self._pieces(size))

    def rows(self, most: int = sys.maxsize, remedy: str = "") -> PathRows:
        """Return all rows; see `blocks`.

        Parameters
        ----------
        most : int
            Number of rows that fit; any number by default.
        remedy : str
            What to do with more.

        Raises
        ------
        PathError
            If there are more; as for `blocks`.
        FileAccessError
            If the file cannot be read.
        """
        pieces = self._pieces(most)
        first = next(pieces)
        if next(pieces, None) is not None:
            raise PathError(f"path has more than {most} rows: {remedy}")
        return self._rows(first)

    def spread(self, most: int) -> PathRows:
        """Return up to ``most`` rows, evenly spread over the file; see `blocks`."""
        count = sum(map(len, self._pieces(_BLOCK)))
        wanted = set(np.linspace(0, count - 1, min(most, count)).round().astype(int).tolist())
        rows = ((piece, row) for piece in self._pieces(_BLOCK) for row in range(len(piece)))
        chosen = [each for number, each in enumerate(rows) if number in wanted]
        return self._rows(
            TableRows(
                [piece.cells[row] for piece, row in chosen],
                [piece.lines[row] for piece, row in chosen],
                self.layout.delimiter,
            )
        )

    def _pieces(self, size: int) -> Iterator[TableRows]:
        if self.held is not None:
            held, cells = self.held, self.held.cells
            for start in range(0, len(held), min(size, len(held))):
                part = slice(start, start + min(size, len(held)))
                yield replace(held, cells=cells[part], lines=held.lines[part])
            return
        width, empty = len(self.layout.header), True
        with _as_path_errors(), opened_table(self.path) as table:
            for block in table.pieces(size):
                empty = False
                if uneven := block.uneven(width):
                    raise PathError(
                        f"row {uneven[0]} has {uneven[1]} cells, the header has {width}"
                        " (a decimal comma needs another delimiter, such as a semicolon)"
                    )
                yield block
        if empty:
            raise PathError("path has a header but no row")

    def _rows(self, block: TableRows) -> PathRows:
        columns = self.columns
        wrenches = [
            None if each is None else _numbers(block, each.columns, None)
            for each in (columns.force, columns.moment)
        ]
        return PathRows(
            block,
            self.layout.header,
            columns,
            _numbers(block, columns.joints, columns.robot),
            _poses(block, columns) if columns.orientation else None,
            *wrenches,
        )


@contextmanager
def new_rows(
    out: Path, table: PathTable, added: Sequence[str]
) -> Iterator[Callable[[PathRows, FloatArray, Sequence[tuple[Column, FloatArray]]], None]]:
    """Yield a writer of rows of a table with further columns, in the table's own format.

    It takes rows, the numbers of the added columns, shape (row, added), and columns that are
    replaced with their numbers in SI units. The file takes its place when the block ends without
    error.

    Parameters
    ----------
    out : Path
        The file to write.
    table : PathTable
        Where the rows are from.
    added : sequence of str
        Headers of the columns at the end; columns of these names are left out.

    Raises
    ------
    PathError
        If a number is not finite; by its row.
    FileAccessError
        If the file cannot be written.
    """
    header = table.layout.header
    kept = [index for index, name in enumerate(header) if name.strip() not in added]
    layout = replace(table.layout, header=(*(header[index] for index in kept), *added))
    with new_table(out, layout) as write:

        def write_rows(
            rows: PathRows, ends: FloatArray, changed: Sequence[tuple[Column, FloatArray]]
        ) -> None:
            new = np.column_stack([*(values / each.scale for each, values in changed), ends])
            if not (finite := np.isfinite(new).all(axis=1)).all():
                label = rows.label(int(np.argmin(finite)))
                raise PathError(f"{label}: the model gives no finite number for it")
            write(_new_cells(rows.table, kept, new, [each.index for each, _ in changed]))

        yield write_rows


def _new_cells(
    table: TableRows, kept: Sequence[int], new: FloatArray, places: Sequence[int]
) -> Iterator[list[str]]:
    """Yield the cells of rows with new numbers, in given places first, the others at the end."""
    for cells, numbers in zip(table.cells, new.tolist(), strict=True):
        texts = list(map(repr, numbers))
        if table.decimal_comma:
            texts = [text.replace(".", ",") for text in texts]
        own = [*cells]
        for place, text in zip(places, texts, strict=False):
            own[place] = text
        yield [*(own[place] for place in kept), *texts[len(places) :]]


@contextmanager
def _as_path_errors() -> Iterator[None]:
    """Raise what is wrong with a table as what is wrong with a path."""
    try:
        yield
    except TableError as error:
        raise PathError(str(error)) from error


def require_within_a_turn(angles: FloatArray, name: Callable[[int, int], str]) -> None:
    """Refuse angles of an orientation beyond a turn, which are degrees that were called radians.

    Parameters
    ----------
    angles : ndarray, shape (row, 3)
        In rad.
    name : callable
        Names the angle of a row and a column for a person.

    Raises
    ------
    PathError
        If there is one.
    """
    for row, k in np.argwhere(~(np.abs(angles) <= _TURN)).tolist():
        raise PathError(
            f"{name(row, k)} of {np.degrees(angles[row, k]):.4g} deg is more than a turn: is it in"
            " degrees?"
        )


def _numbers(block: TableRows, columns: Sequence[Column], robot: Robot | None) -> FloatArray:
    """Return the numbers of columns, shape (row, column), in SI units, if they can be meant."""
    with _as_path_errors(), np.errstate(over="ignore"):
        numbers = [block.numbers(column) for column in columns]
    for column, values in zip(columns, numbers, strict=True):
        low, high, what = plausible_range(column, robot)
        inside = (values >= low) & (values <= high)
        if not inside.all():
            row = int(np.argmin(inside))
            degrees = column.unit == "rad" and low <= np.radians(values[row]) <= high
            raise PathError(
                f"row {block.lines[row]}, column {column.header!r}:"
                f" {values[row] / column.scale:.4g} {column.unit} is not within"
                f" {low / column.scale:.4g} to {high / column.scale:.4g} {column.unit}, {what}:"
                f" is it in {'degrees' if degrees else 'another unit'}?"
            )
    return np.column_stack([np.empty((len(block), 0)), *numbers])


def _poses(block: TableRows, columns: PathColumns) -> FloatArray:
    """Return the poses of rows, shape (row, 4, 4), in m; without a position it is 0."""
    orientation = _numbers(block, columns.orientation, None)
    position = np.zeros((len(block), 3))
    if columns.position:
        position = _numbers(block, columns.position, None)
    if len(columns.orientation) == 3:
        require_within_a_turn(
            orientation,
            lambda row, k: (
                f"row {block.lines[row]}, column {columns.orientation[k].header!r}: an orientation"
            ),
        )
        return T_from_xyzabc(*position.T, *orientation.T)
    norm = np.linalg.norm(orientation, axis=1)
    unit = np.abs(norm - 1.0) <= _UNIT_NORM
    if not unit.all():
        bad = int(np.argmin(unit))
        raise PathError(
            f"row {block.lines[bad]}: quaternion qx, qy, qz, qw has norm {norm[bad]:.6g}, it must"
            f" be 1 (within {_UNIT_NORM:g})"
        )
    T = np.tile(np.eye(4), (len(block), 1, 1))
    T[:, :3, :3] = Rotation.from_quat(orientation).as_matrix()
    T[:, :3, 3] = position
    return T


def _in_base(
    vectors: FloatArray | None, wrench: WrenchColumns | None, T_base_tcp: FloatArray
) -> FloatArray | None:
    """Return forces or moments, shape (row, 3), in base axes."""
    if vectors is None or wrench is None or not wrench.in_tcp:
        return vectors
    return (T_base_tcp[:, :3, :3] @ vectors[:, :, None])[:, :, 0]
