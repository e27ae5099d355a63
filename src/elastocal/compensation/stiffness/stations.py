"""The tool poses of a path at which postures are compared."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.offline import (
    PathError,
    find_columns,
    in_file,
    programmed_rows,
    read_layout,
    read_values,
    row_blocks,
)
from elastocal.robot.inverse import InverseKinematics
from elastocal.tables import TableRows

_BLOCK = 20_000


@dataclass(frozen=True, eq=False)
class PathStations:
    """Rows of a path, evenly taken."""

    lines: tuple[int, ...]
    """Lines of the file, from 1."""
    T_base_tcp: FloatArray
    """Shape (station, 4, 4), in m."""
    q: FloatArray
    """As programmed, or on the branch nearest to the row before, shape (station, joint)."""

    def __len__(self) -> int:
        return len(self.lines)

    @property
    def arc_length(self) -> FloatArray:
        """Length of the path up to each station, straight from one to the next, in m."""
        steps = np.linalg.norm(np.diff(self.T_base_tcp[:, :3, 3], axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])

    @property
    def normal(self) -> FloatArray:
        """Axis of the tool, into the surface, shape (station, 3)."""
        return self.T_base_tcp[:, :3, 2]


def read_stations(
    path: Path, solver: InverseKinematics, most: int, start: FloatArray | None
) -> PathStations:
    """Return up to ``most`` rows of a path, evenly spread; forces are not needed.

    Parameters
    ----------
    path : Path
        CSV as for `elastocal.compensation.offline.compensate_path`.
    solver : InverseKinematics
        Of the model's robot.
    most : int
        Number of stations.
    start : ndarray, shape (joint,), or None
        Posture before the first row of a path of poses, in rad or m.

    Raises
    ------
    PathError
        If the path is not of the contract, or a station is out of reach; by its line.
    FileAccessError
        If the file cannot be read.
    """
    if not most >= 1:
        raise PathError(f"{most} stations: there must be at least 1")
    with in_file(path):
        layout = read_layout(path)
        columns = find_columns(layout.header, solver.robot, forces=False)
        count = sum(len(block.lines) for block in row_blocks(path, layout, _BLOCK))
        wanted = np.unique(np.linspace(0, count - 1, min(most, count)).round().astype(int))
        block = _rows(path, wanted)
        values = read_values(block, columns)
        labels = [f"row {line}" for line in block.lines]
        q, T = programmed_rows(solver, values, start, labels.__getitem__)
    return PathStations(tuple(block.lines), T, q)


def _rows(path: Path, wanted: np.ndarray) -> TableRows:
    """Return some rows of a file by their numbers, in ascending order."""
    cells: list[list[str]] = []
    lines: list[int] = []
    first = 0
    for block in row_blocks(path, read_layout(path), _BLOCK):
        for row in wanted[(wanted >= first) & (wanted < first + len(block.lines))]:
            cells.append(block.cells[row - first])
            lines.append(block.lines[row - first])
        first += len(block.lines)
    return TableRows(cells, lines)
