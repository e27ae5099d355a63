"""The forces at the points of a program: a table with the column ``point``."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.offline import (
    PathColumns,
    PathError,
    WrenchColumns,
    find_wrench_columns,
    in_file,
    read_layout,
    read_values,
    row_blocks,
)

_POINT = "point"
_BLOCK = 10_000


@dataclass(frozen=True, eq=False)
class PointForces:
    """Forces and moments by point."""

    rows: dict[str, int]
    """Row of each point, by its name in capitals."""
    force: FloatArray
    """As the table has it, shape (row, 3), in N."""
    moment: FloatArray | None
    """The same in N·m."""
    force_columns: WrenchColumns
    moment_columns: WrenchColumns | None


def read_forces(path: Path) -> PointForces:
    """Return the forces of a table.

    Raises
    ------
    PathError
        If a column is missing, a cell is not a number, or a point stands twice.
    FileAccessError
        If the file cannot be read.
    """
    with in_file(path):
        return _read(path)


def _read(path: Path) -> PointForces:
    layout = read_layout(path)
    force, moment = find_wrench_columns(layout.header)
    header = [name.strip() for name in layout.header]
    if header.count(_POINT) != 1:
        raise PathError(
            f"one column {_POINT!r} must name the points; the columns are {', '.join(header)}"
        )
    place, columns = header.index(_POINT), PathColumns((), (), (), force, moment)
    rows: dict[str, int] = {}
    forces: list[FloatArray] = []
    moments: list[FloatArray] = []
    for block in row_blocks(path, layout, _BLOCK):
        for line, cells in zip(block.lines, block.cells, strict=True):
            name = cells[place].strip().upper()
            if not name or name in rows:
                raise PathError(f"row {line}: point {name!r} stands twice or has no name")
            rows[name] = len(rows)
        values = read_values(block, columns)
        forces += [] if values.force is None else [values.force]
        moments += [] if values.moment is None else [values.moment]
    return PointForces(
        rows, np.vstack(forces), np.vstack(moments) if moments else None, force, moment
    )
