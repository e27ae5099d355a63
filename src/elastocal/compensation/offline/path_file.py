"""``PATH.csv`` to ``OUT.csv``: rows corrected block by block, everything else as it stood."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.offline import (
    PathColumns,
    PathError,
    PathValues,
    count_lines,
    find_columns,
    in_file,
    read_layout,
    read_values,
    row_blocks,
    turned_to_base,
)
from elastocal.compensation.offline.correct import (
    LARGEST_DEFLECTION,
    CorrectionSummary,
    PathCorrection,
    correct_rows,
)
from elastocal.compensation.offline.path_joints import (
    RowName,
    check_limits,
    joints_along_path,
    nearest_zero_posture,
    posture_jumps,
)
from elastocal.identification import CalibratedModel
from elastocal.progress import Progress, silent
from elastocal.results import brief_repr
from elastocal.robot.inverse import InverseKinematics, inverse_for
from elastocal.tables import TableRows, new_table

_ROWS_AT_A_TIME = 2000
"""Rows corrected at a time; bounds memory."""
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
        solver = inverse_for(calibrated.model.robot)
        job = _Job(calibrated, solver, columns, settings)
        total = count_lines(path) - len(layout.preamble) - 1
        kept = [i for i, name in enumerate(layout.header) if name.strip() not in _ADDED]
        header = (*(layout.header[i] for i in kept), *_ADDED)
        with new_table(out, replace(layout, header=header)) as write:
            return _correct_blocks(
                job,
                row_blocks(path, layout, _ROWS_AT_A_TIME),
                lambda block, found: write(_new_cells(job, block, kept, found)),
                lambda done: progress("rows", done, total),
            )


@dataclass(frozen=True, eq=False)
class _Job:
    calibrated: CalibratedModel
    solver: InverseKinematics
    columns: PathColumns
    settings: CorrectionSettings


def _correct_blocks(
    job: _Job,
    blocks: Iterable[TableRows],
    write: Callable[[TableRows, PathCorrection], None],
    done: Callable[[int], None],
) -> CorrectionSummary:
    summary, previous = CorrectionSummary(), job.settings.start
    for block in blocks:
        values = read_values(block, job.columns)
        labels = [f"row {line}" for line in block.lines]
        q, T = programmed_rows(job.solver, values, previous, labels.__getitem__)
        found = _corrected(job, values, q, T, labels.__getitem__)
        shift = found.T_base_tcp[:, :3, 3] - T[:, :3, 3]
        turned: list[int] = []
        if job.columns.by_pose:
            # How the first row is reached is not the path's.
            before = previous if summary.rows and previous is not None else q[0]
            turned = posture_jumps(job.solver.robot, q, before).tolist()
            summary = summary if summary.rows else replace(summary, start=tuple(q[0].tolist()))
        summary = summary.plus(found, shift, labels, turned)
        previous = q[-1]
        write(block, found)
        done(summary.rows)
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


def _corrected(
    job: _Job, values: PathValues, q: FloatArray, T: FloatArray, where: RowName
) -> PathCorrection:
    force = turned_to_base(values.force, job.columns.force, T)
    moment = turned_to_base(values.moment, job.columns.moment, T)
    if force is None:
        raise PathError("path has no forces")
    wrench, largest = (force, moment), job.settings.largest
    return correct_rows(
        job.solver,
        job.calibrated,
        q,
        T,
        wrench,
        where,
        may_turn=job.columns.by_pose,
        largest=largest,
    )


def _new_cells(
    job: _Job, block: TableRows, kept: list[int], found: PathCorrection
) -> Iterator[list[str]]:
    """Yield the cells of corrected rows; only those that were corrected are new text."""
    columns, robot = job.columns, job.solver.robot
    new: list[tuple[int, list[str]]] = []
    if columns.by_pose:
        # The orientation is kept, and so is its text.
        position = found.T_base_tcp[:, :3, 3]
        pairs = list(zip(columns.position, position.T, strict=True))
    else:
        pairs = list(zip(columns.joints, found.q.T, strict=True))[robot.external_axes :]
    for column, numbers in pairs:
        new.append((column.index, list(map(repr, (numbers / column.scale).tolist()))))
    deflection = np.hstack([found.deflection, found.low, found.high])
    ends = [list(map(repr, row)) for row in deflection.tolist()]
    for row, (cells, end) in enumerate(zip(block.cells, ends, strict=True)):
        for index, text in new:
            cells[index] = text[row]
        yield [*(cells[i] for i in kept), *end]
