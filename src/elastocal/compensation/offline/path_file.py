"""``PATH.csv`` to ``OUT.csv``: rows corrected block by block, everything else as it stood."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.offline.correct import (
    LARGEST_DEFLECTION,
    CorrectionSummary,
    PathCorrection,
    correct_rows,
)
from elastocal.dataset import (
    PathColumns,
    PathValues,
    find_columns,
    in_file,
    read_layout,
    read_values,
    row_blocks,
    wrench_in_base,
)
from elastocal.errors import FileAccessError, PathError
from elastocal.files import require_file
from elastocal.identification import CalibratedModel
from elastocal.progress import Progress, silent
from elastocal.results import brief_repr
from elastocal.robot.inverse import (
    InverseKinematics,
    RowName,
    check_limits,
    inverse_for,
    joints_along_path,
    nearest_zero_posture,
    posture_jumps,
)
from elastocal.tables import TableRows, new_table

_ROWS_AT_A_TIME = 2000
"""Rows corrected at a time; bounds memory."""
_BYTES_AT_A_TIME = 1 << 20
"""Bytes that are read at a time when lines are counted."""
_ADDED = tuple(f"deflection_{axis}{end}[m]" for end in ("", "_low", "_high") for axis in "xyz")


@brief_repr
@dataclass(frozen=True, eq=False)
class CorrectionSettings:
    """Settings of the correction of a path."""

    start: FloatArray | None = None
    """Posture before the first row of a path of poses, shape (joint,), in rad or m."""
    largest: float = LARGEST_DEFLECTION
    """Largest deflection that is taken for one, in m."""


def compensate_path(
    calibrated: CalibratedModel,
    path: Path,
    out: Path,
    settings: CorrectionSettings | None = None,
    progress: Progress = silent,
) -> CorrectionSummary:
    """Correct a path file; write the same columns corrected, and the predicted deflection.

    Parameters
    ----------
    calibrated : CalibratedModel
        The model.
    path, out : Path
        The file as programmed, and the one to write, atomically.
    settings : CorrectionSettings, optional
        Posture at the start, and the largest deflection.
    progress : Progress
        Hears how many rows are done.

    Raises
    ------
    PathError
        If the file is not of the contract, or a row cannot be corrected; by its line.
    FileAccessError
        If a file cannot be read or written.
    """
    settings = CorrectionSettings() if settings is None else settings
    with in_file(path):
        layout = read_layout(path)
        columns = find_columns(layout.header, calibrated.model.robot)
        robot, solver = calibrated.model.robot, inverse_for(calibrated.model.robot)
        total = _count_lines(path) - len(layout.preamble) - 1
        kept = [i for i, name in enumerate(layout.header) if name.strip() not in _ADDED]
        header = (*(layout.header[i] for i in kept), *_ADDED)
        summary, previous, memory = CorrectionSummary(), settings.start, None
        with new_table(out, replace(layout, header=header)) as write:
            for block in row_blocks(path, layout, _ROWS_AT_A_TIME):
                values = read_values(block, columns)
                labels = [f"row {line}" for line in block.lines]
                q, T = programmed_rows(solver, values, previous, labels.__getitem__)
                found = correct_rows(
                    solver,
                    calibrated,
                    q,
                    T,
                    wrench_in_base(values, columns, T),
                    labels.__getitem__,
                    may_turn=columns.by_pose,
                    largest=settings.largest,
                    memory=memory,
                )
                turned: list[int] = []
                if columns.by_pose:
                    # How the first row is reached is not the path's.
                    before = previous if summary.rows and previous is not None else q[0]
                    turned = posture_jumps(robot, q, before).tolist()
                    if not summary.rows:
                        summary = replace(summary, start=tuple(q[0].tolist()))
                summary = summary.plus(
                    found, found.T_base_tcp[:, :3, 3] - T[:, :3, 3], labels, turned
                )
                previous, memory = q[-1], found.memory
                write(_new_cells(columns, robot.external_axes, block, kept, found))
                progress("rows", summary.rows, total)
    return summary


def programmed_rows(
    solver: InverseKinematics, values: PathValues, previous: FloatArray | None, where: RowName
) -> tuple[FloatArray, FloatArray]:
    """Return joints and poses as programmed, shapes (row, joint) and (row, 4, 4).

    Parameters
    ----------
    solver : InverseKinematics
        Of the robot.
    values : PathValues
        What the file says.
    previous : ndarray, shape (joint,), or None
        Joints before the first row, in rad or m; a rail without columns stays there. None: the
        posture nearest to zero.
    where : callable
        Names a row in a refusal.

    Raises
    ------
    PathError
        If a row is out of reach, or nothing says where the external axes stand.
    """
    robot = solver.robot
    if values.T_base_tcp is None:
        return values.joints, robot.forward(values.joints)
    external, names = values.joints, robot.joint_names[: robot.external_axes]
    if names and not external.shape[1]:
        if previous is None:
            raise PathError(
                f"nothing says where {', '.join(names)} stands: give its column"
                f" ({names[0]}[…]), or hold it where --start has it"
            )
        held = previous[: robot.external_axes]
        external = np.broadcast_to(held, (len(values.T_base_tcp), len(names)))
    check_limits(robot, external, where, "is programmed")
    before = nearest_zero_posture(robot) if previous is None else previous
    return joints_along_path(solver, values.T_base_tcp, external, before, where), values.T_base_tcp


def _new_cells(
    columns: PathColumns,
    external_axes: int,
    block: TableRows,
    kept: list[int],
    found: PathCorrection,
) -> Iterator[list[str]]:
    """Yield the cells of corrected rows; only those that were corrected are new text."""
    new: list[tuple[int, list[str]]] = []
    if columns.by_pose:
        # The orientation is kept, and so is its text.
        position = found.T_base_tcp[:, :3, 3]
        pairs = list(zip(columns.position, position.T, strict=True))
    else:
        pairs = list(zip(columns.joints, found.q.T, strict=True))[external_axes:]
    for column, numbers in pairs:
        new.append((column.index, list(map(repr, (numbers / column.scale).tolist()))))
    deflection = np.hstack([found.deflection, found.low, found.high])
    ends = [list(map(repr, row)) for row in deflection.tolist()]
    for row, (cells, end) in enumerate(zip(block.cells, ends, strict=True)):
        for index, text in new:
            cells[index] = text[row]
        yield [*(cells[i] for i in kept), *end]


def _count_lines(path: Path) -> int:
    """Return the number of lines of a file, for a progress bar."""
    require_file(path)
    try:
        with Path(path).open("rb") as file:
            blocks = iter(lambda: file.read(_BYTES_AT_A_TIME), b"")
            return sum(block.count(b"\n") for block in blocks)
    except OSError as error:
        raise FileAccessError(f"cannot read {path}: {error.strerror or error}") from error
