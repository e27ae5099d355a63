"""``PATH.csv`` to ``OUT.csv``: rows corrected block by block, everything else unchanged."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.offline.correct import (
    LARGEST_DEFLECTION,
    PathCorrection,
    Unloaded,
    correct_rows,
)
from elastocal.compensation.offline.summary import CorrectionSummary
from elastocal.dataset import PathRows, PathTable, find_columns, in_file, new_rows
from elastocal.errors import PathError
from elastocal.files import readable
from elastocal.identification import CalibratedModel
from elastocal.progress import Progress, silent
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.robot.inverse import (
    InverseKinematics,
    RowName,
    check_limits,
    inverse_for,
    joints_along_path,
    nearest_zero_posture,
    posture_jumps,
)
from elastocal.tables import Column

_ROWS_AT_A_TIME = 2000
"""Rows corrected at a time; bounds memory."""
_BYTES_AT_A_TIME = 1 << 20
"""Bytes that are read at a time when lines are counted."""
_ADDED = tuple(f"deflection_{axis}{end}[m]" for end in ("", "_low", "_high") for axis in "xyz")

HearRows = Callable[[FloatArray, FloatArray, RowName], None]
"""Hears joints, shape (row, joint), and poses, shape (row, 4, 4), of rows with their names."""


@brief_repr
@dataclass(frozen=True, eq=False)
class CorrectionSettings:
    """Settings of the correction of a path."""

    start: FloatArray | None = None
    """Posture before the first row of a path of poses, shape (joint,), in rad or m."""
    largest: float = LARGEST_DEFLECTION
    """Largest correction, whatever it is made of, in m."""
    unloaded: Unloaded | None = None
    """True tcp position without process force; by default the nominal one."""
    controller: Robot | None = None
    """The arm as its controller knows it, which paths are written for; by default the model's."""
    hear: Sequence[HearRows] = ()
    """Hear the corrected rows, block by block; what one raises leaves no file."""


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
        Posture at the start, the largest deflection, and who hears the rows.
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
    robot = settings.controller or calibrated.model.robot
    solver = inverse_for(robot)
    with in_file(path):
        table = PathTable.open(path, lambda header: find_columns(header, robot))
        total = _count_lines(path) - len(table.layout.preamble) - 1
        summary, previous, memory = CorrectionSummary(), settings.start, None
        with new_rows(out, table, _ADDED) as write:
            for rows in table.blocks(_ROWS_AT_A_TIME):
                q, T = programmed_rows(solver, rows.joints, rows.T_base_tcp, previous, rows.label)
                found = correct_rows(
                    solver,
                    calibrated,
                    q,
                    T,
                    rows.wrench_in_base(T),
                    rows.label,
                    may_turn=table.columns.by_pose,
                    largest=settings.largest,
                    memory=memory,
                    unloaded=settings.unloaded,
                )
                turned: list[int] = []
                if table.columns.by_pose:
                    # How the first row is reached is not the path's.
                    before = previous if summary.rows and previous is not None else q[0]
                    turned = posture_jumps(robot, q, before).tolist()
                    if not summary.rows:
                        summary = replace(summary, start=tuple(q[0].tolist()))
                shift = found.T_base_tcp[:, :3, 3] - T[:, :3, 3]
                labels = [rows.label(row) for row in range(len(rows))]
                summary = summary.plus(found, shift, labels, turned)
                previous, memory = q[-1], found.memory
                ends = np.hstack([found.deflection, found.low, found.high])
                write(rows, ends, _corrected_columns(rows, found, robot.external_axes))
                for hear in settings.hear:
                    hear(found.q, found.T_base_tcp, rows.label)
                progress("rows", summary.rows, total)
    return summary


def programmed_rows(
    solver: InverseKinematics,
    joints: FloatArray,
    T_base_tcp: FloatArray | None,
    previous: FloatArray | None,
    where: RowName,
) -> tuple[FloatArray, FloatArray]:
    """Return joints and poses as programmed, shapes (row, joint) and (row, 4, 4).

    Parameters
    ----------
    solver : InverseKinematics
        Solver of the robot.
    joints : ndarray, shape (row, …)
        All joints, or the external axes that a path of poses gives, in rad or m.
    T_base_tcp : ndarray, shape (row, 4, 4), or None
        Poses; None in a path of joints.
    previous : ndarray, shape (joint,), or None
        Joints before the first row, in rad or m; a rail without columns stays there. None: the
        posture nearest to zero.
    where : callable
        Names a row in a refusal.

    Raises
    ------
    PathError
        If a row is out of reach, or the positions of the external axes are not given.
    """
    robot = solver.robot
    if T_base_tcp is None:
        return joints, robot.forward(joints)
    external, names = joints, robot.joint_names[: robot.external_axes]
    if names and not external.shape[1]:
        if previous is None:
            raise PathError(
                f"nothing says where {', '.join(names)} stands: give its column"
                f" ({names[0]}[…]), or hold it where --start has it"
            )
        external = np.broadcast_to(previous[: len(names)], (len(T_base_tcp), len(names)))
    check_limits(robot, external, where, "is programmed")
    before = nearest_zero_posture(robot) if previous is None else previous
    return joints_along_path(solver, T_base_tcp, external, before, where), T_base_tcp


def _corrected_columns(
    rows: PathRows, found: PathCorrection, external_axes: int
) -> list[tuple[Column, FloatArray]]:
    """Return the columns that a correction replaces, with their numbers."""
    if rows.columns.by_pose:
        # The orientation is kept, and so is its text.
        return list(zip(rows.columns.position, found.T_base_tcp[:, :3, 3].T, strict=True))
    return list(zip(rows.columns.joints, found.q.T, strict=True))[external_axes:]


def _count_lines(path: Path) -> int:
    """Return the number of lines of a file, for a progress bar."""
    with readable(path), Path(path).open("rb") as file:
        blocks = iter(lambda: file.read(_BYTES_AT_A_TIME), b"")
        return sum(block.count(b"\n") for block in blocks)
