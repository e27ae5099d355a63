"""The production path that a cell file names, in joints, with its forces.

The file is the table that ``elastocal compensate`` reads: joints or tcp poses, forces on the robot
in base or in the tcp frame. A column ``course`` names its sections. Poses are converted to joints
as production would reach them: each course begins on the branch nearest to ``process.start`` and
continues without a jump. Its rail is at the position in the file, or at the one that keeps the
whole course farthest from the joint limits.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell.motion import joint_positions
from elastocal.dataset import PathTable, find_columns, in_file
from elastocal.errors import PathError
from elastocal.records import StrictModel
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.robot.inverse import (
    InverseKinematics,
    RowName,
    check_limits,
    inverse_for,
    joints_along_path,
)

_MOST = 500_000
"""Rows of a file: the robot's controller would take a day of them."""
_FEW = 25
"""Rows of a course at which the positions of the rail are tried."""


class ProcessFile(StrictModel):
    """Path and forces of the production process."""

    file: str
    """CSV with joints or tcp poses and forces (the PATH.csv of `elastocal compensate`), relative to
    the cell file."""
    start: dict[str, str] | None = None
    """Posture that each course of a path of poses is begun from; ``motion.home`` by default."""


@brief_repr
@dataclass(frozen=True, eq=False)
class ProductionPath:
    """Poses and forces of the production, in joints."""

    joint_position: FloatArray
    """Shape (row, joint), in rad or m."""
    force: FloatArray
    """Force on the robot at the tcp in base, shape (row, 3), in N."""
    moment: FloatArray | None = None
    """Moment on the robot about the tcp in base, shape (row, 3), in N·m; None: no columns."""
    course: tuple[str, ...] = ()
    """Name of the course of each row, shape (row,); empty: the path is one course."""

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.joint_position)

    @property
    def courses(self) -> tuple[tuple[str, slice], ...]:
        """Name and rows of each course, in the order of the file."""
        return tuple(_courses(self.course, len(self)))


def read_production(
    path: Path, entry: ProcessFile, robot: Robot, home: FloatArray, external: FloatArray
) -> ProductionPath:
    """Return the production path of a cell.

    Parameters
    ----------
    path : Path
        The CSV file.
    entry : ProcessFile
        What the cell file says of it.
    robot : Robot
        The cell's, with its rail.
    home : ndarray, shape (joint,)
        Where courses of poses begin when the entry says nothing, in rad or m.
    external : ndarray, shape (combination, external axis)
        Positions of the external axes that are searched where the file has no columns for them.

    Raises
    ------
    PathError
        If the file is not of the contract, or a row is out of reach; by its line.
    RobotError, UnitError
        If ``start`` does not fit the robot.
    FileAccessError
        If the file cannot be read.
    """
    start = joint_positions(robot, "start", entry.start) if entry.start else home
    with in_file(path):
        table = PathTable.open(path, lambda header: find_columns(header, robot))
        rows = table.rows(_MOST, "keep every tenth of them")
        names = rows.names("course") or ()
        if rows.T_base_tcp is None:
            check_limits(robot, rows.joints, rows.label, "is programmed")
            q, T = rows.joints, robot.forward(rows.joints)
        else:
            T, posture = rows.T_base_tcp, _PostureSearch(inverse_for(robot), start, external)
            q = np.vstack(
                [
                    posture.joints(T[some], rows.joints[some], rows.part(some).label)
                    for _, some in _courses(names, len(T))
                ]
            )
        return ProductionPath(q, *rows.wrench_in_base(T), names)


def process_forces(path: Path, robot: Robot) -> FloatArray:
    """Return the forces of a production path on the robot in the tcp frame, shape (row, 3), in N.

    Parameters
    ----------
    path : Path
        The CSV file.
    robot : Robot
        With its tool.

    Raises
    ------
    PathError
        If the file is not of the contract; by its line.
    FileAccessError
        If the file cannot be read.
    """
    with in_file(path):
        table = PathTable.open(path, lambda header: find_columns(header, robot))
        rows = table.rows(_MOST, "keep every tenth of them")
        T = robot.forward(rows.joints) if rows.T_base_tcp is None else rows.T_base_tcp
        force: FloatArray = np.einsum("rji,rj->ri", T[:, :3, :3], rows.wrench_in_base(T)[0])
        return force


def _courses(names: Sequence[str], count: int) -> Iterator[tuple[str, slice]]:
    if not names:
        yield "path", slice(0, count)
    start = 0
    for name, rows in groupby(names):
        stop = start + len(list(rows))
        yield name, slice(start, stop)
        start = stop


@dataclass(frozen=True, eq=False)
class _PostureSearch:
    """Turns a course of poses into joints as production would take them."""

    solver: InverseKinematics
    start: FloatArray
    """Posture that a course is begun from, shape (joint,), in rad or m."""
    external: FloatArray
    """Positions of the external axes to choose from, shape (combination, external axis)."""

    def joints(self, T_base_tcp: FloatArray, given: FloatArray, where: RowName) -> FloatArray:
        """Return the joints of a course, shape (row, joint), in rad or m.

        Parameters
        ----------
        T_base_tcp : ndarray, shape (row, 4, 4)
            Poses, in m.
        given : ndarray, shape (row, external axis)
            Positions of the external axes; no columns where the file has none.
        where : callable
            Names a row in a refusal.
        """
        axes = self.solver.robot.external_axes
        if axes and not given.shape[1]:
            given = np.broadcast_to(self._best_position(T_base_tcp), (len(T_base_tcp), axes))
        check_limits(self.solver.robot, given, where, "is programmed")
        return joints_along_path(self.solver, T_base_tcp, given, self.start, where)

    def _best_position(self, T_base_tcp: FloatArray) -> FloatArray:
        """Return the positions of the external axes that keep the arm farthest from its limits."""
        some = np.unique(np.linspace(0, len(T_base_tcp) - 1, _FEW).astype(int))
        arm = slice(self.solver.robot.external_axes, None)
        margins = []
        for place in self.external:
            held = np.broadcast_to(place, (len(some), len(place)))
            try:
                q = joints_along_path(self.solver, T_base_tcp[some], held, self.start, str)
            except PathError:
                margins.append(-np.inf)
            else:
                margins.append(float(self.solver.robot.limits.margin(q)[:, arm].min()))
        best: FloatArray = self.external[int(np.argmax(margins))]
        return best
