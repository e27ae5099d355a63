"""A controller's program corrected: new numbers at its points, everything else unchanged."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.offline import (
    CorrectionSettings,
    CorrectionSummary,
    PathCorrection,
    correct_rows,
)
from elastocal.compensation.programs.krl import read_krl
from elastocal.compensation.programs.program import (
    ControllerProgram,
    CorrectedPoint,
    Move,
    ProgramPoint,
)
from elastocal.dataset import (
    PathRows,
    PathTable,
    find_wrench_columns,
    in_file,
)
from elastocal.errors import PathError, nearest
from elastocal.identification import CalibratedModel
from elastocal.results import brief_repr
from elastocal.robot import inverse_transform
from elastocal.robot.inverse import (
    InverseKinematics,
    RowName,
    check_limits,
    inverse_for,
    joints_along_path,
)

PROGRAM_READERS: Mapping[str, Callable[[Path], ControllerProgram]] = {".src": read_krl}
"""Readers of programs by the suffix of their main file."""
_POINT = "point"
"""The column that names the points in a table of forces."""
_SAME = 1e-3
"""Postures nearer than this in every joint (rad or m) are one."""


@brief_repr
@dataclass(frozen=True)
class ProgramCorrection:
    """A program that was corrected."""

    program: ControllerProgram
    """Program as it was read."""
    summary: CorrectionSummary
    files: tuple[Path, ...]
    """The files that were written, the main one first."""
    assumed: tuple[str, ...]
    """Motions whose posture nothing in the program says: the last known is taken."""
    notes: tuple[str, ...]
    """Further notes for the user."""


def compensate_program(
    calibrated: CalibratedModel,
    path: Path,
    forces: Path,
    out: Path,
    settings: CorrectionSettings | None = None,
    T_base_frame: FloatArray | None = None,
) -> ProgramCorrection:
    """Correct the targets of all straight motions, and other targets that have a force.

    Parameters
    ----------
    calibrated : CalibratedModel
        The model; its tcp is the program's tool.
    path : Path
        Main file of a program of one of the controllers in `PROGRAM_READERS`.
    forces : Path
        CSV with the column ``point`` and forces as in a path.
    out : Path
        Main file to write.
    settings : CorrectionSettings, optional
        Posture at the start, and the largest deflection.
    T_base_frame : ndarray, shape (4, 4), optional
        The frame of the program's points in the model's base; the same by default.

    Raises
    ------
    PathError
        If the program is not understood, by line; a target has no force, a force no target; or
        a point cannot be corrected.
    FileAccessError
        If a file cannot be read or written.
    """
    settings = CorrectionSettings() if settings is None else settings
    program = PROGRAM_READERS[path.suffix.lower()](path)
    with in_file(forces):
        table = _read_forces(forces)
    placed = np.eye(4) if T_base_frame is None else T_base_frame
    robot = settings.controller or calibrated.model.robot
    follower = _PostureFollower(inverse_for(robot), program, placed)
    text, data = program.files
    with in_file(text):
        targets = _targets(program, table, forces)
        postures, assumed = follower.postures(targets, settings.start)
    with in_file(data):
        found, summary = _corrected(calibrated, follower, table, postures, settings)
    T_frame_base = inverse_transform(placed)
    arm = slice(robot.external_axes, None)
    corrected = {
        name: CorrectedPoint(found.q[row, arm], T_frame_base @ found.T_base_tcp[row])
        for row, name in enumerate(postures)
    }
    files = program.write(out, corrected)
    notes = program.notes(assumed, files[0], T_base_frame is not None)
    return ProgramCorrection(program, summary, files, assumed, notes)


@dataclass(frozen=True, eq=False)
class _PointForces:
    """Forces and moments by point."""

    rows: dict[str, int]
    """Row of each point, by its name in capitals."""
    values: PathRows


def _read_forces(path: Path) -> _PointForces:
    table = PathTable.open(path, find_wrench_columns)
    values = table.rows()
    names = values.names(_POINT)
    if names is None:
        raise PathError(
            f"one column {_POINT!r} must name the points; the columns are"
            f" {', '.join(map(str.strip, values.header))}"
        )
    rows: dict[str, int] = {}
    for row, name in enumerate(map(str.upper, names)):
        if name in rows:
            raise PathError(f"{values.label(row)}: point {name!r} stands twice")
        rows[name] = row
    return _PointForces(rows, values)


def _targets(program: ControllerProgram, table: _PointForces, forces: Path) -> frozenset[str]:
    """Return the points that are corrected: straight ones, and those that have a force."""
    targets: set[str] = set()
    for move in program.moves:
        if move.name is None or not (move.straight or move.name in table.rows):
            continue
        if move.name not in program.points:
            raise PathError(
                f"line {move.line}: {move.order} {move.name} goes to a point that"
                f" {program.words.declarations} does not declare with a value"
            )
        if move.straight and program.points[move.name].by_axes:
            raise PathError(
                f"line {move.line}: {move.order} {move.name} goes to axis positions"
                f" ({program.points[move.name].kind}): a straight motion must go to a frame"
            )
        if move.name not in table.rows:
            raise PathError(
                f"line {move.line}: {move.order} {move.name} has no force in {forces}"
                f"{nearest(move.name, table.rows)}"
            )
        targets.add(move.name)
    for name in table.rows:
        if name not in targets:
            raise PathError(
                f"no motion goes to point {name!r} of {forces}{nearest(name, sorted(targets))}"
            )
    return frozenset(targets)


def _corrected(
    calibrated: CalibratedModel,
    follower: "_PostureFollower",
    table: _PointForces,
    postures: dict[str, FloatArray],
    settings: CorrectionSettings,
) -> tuple[PathCorrection, CorrectionSummary]:
    points = [follower.program.points[name] for name in postures]
    q = np.array(list(postures.values()))
    labels = [f"point {point.name}" for point in points]
    T = np.array([follower.pose(point, q[row]) for row, point in enumerate(points)])
    rows = [table.rows[name] for name in postures]
    T_of_row = np.tile(np.eye(4), (len(table.values), 1, 1))
    T_of_row[rows] = T
    force, moment = table.values.wrench_in_base(T_of_row)
    # A point given by axes is taken by its joints; the rotation of a frame is the controller's.
    frames = not any(point.by_axes for point in points)
    found = correct_rows(
        follower.solver,
        calibrated,
        q,
        T,
        (force[rows], None if moment is None else moment[rows]),
        labels.__getitem__,
        may_turn=frames,
        largest=settings.largest,
        unloaded=settings.unloaded,
    )
    for hear in settings.hear:
        hear(found.q, found.T_base_tcp, labels.__getitem__)
    shift = found.T_base_tcp[:, :3, 3] - T[:, :3, 3]
    return found, CorrectionSummary().plus(found, shift, labels, [])


@dataclass(frozen=True, eq=False)
class _PostureFollower:
    """A robot that goes from point to point, as the text of the program says."""

    solver: InverseKinematics
    program: ControllerProgram
    T_base_frame: FloatArray
    """Frame of the program's points in the model's base, shape (4, 4), in m."""

    def postures(
        self, targets: frozenset[str], start: FloatArray | None
    ) -> tuple[dict[str, FloatArray], tuple[str, ...]]:
        """Return the joints at each target by its name, and the motions that were assumed.

        Targets are in the order in which they are first reached. Points that are no targets count
        for the posture from which the next is reached.

        Parameters
        ----------
        targets : frozenset of str
            Points that are corrected.
        start : ndarray, shape (joint,), or None
            Joints before the first move, in rad or m.

        Raises
        ------
        PathError
            If a target is out of reach, outside the limits, reached in two postures, or nothing
            says in which posture.
        """
        reached: dict[str, FloatArray] = {}
        assumed: list[str] = []
        previous, certain = start, True
        for move in self.program.moves:
            point = move.axes or self.program.points.get(move.name or "")
            if point is None or not (move.name in targets or point.by_axes):
                # A free motion to a frame, or to a point declared elsewhere, may change the
                # posture: what a frame says of it is not read.
                certain = False
                continue
            q = self._joints(move, point, previous)
            if move.name in targets:
                check_limits(self.solver.robot, q[None], _row_name(move), "is programmed")
                self._require_one_posture(move, reached.setdefault(point.name.upper(), q), q)
                assumed += [] if certain or point.by_axes else [move.label]
            previous, certain = q, True
        return reached, tuple(assumed)

    def pose(self, point: ProgramPoint, q: FloatArray) -> FloatArray:
        """Return T_base_tcp of a point that is reached with joints ``q``, shape (4, 4)."""
        if point.by_axes:
            return np.asarray(self.solver.robot.forward(q), dtype=float)
        return np.asarray(self.T_base_frame @ point.T_frame_tcp(), dtype=float)

    def _joints(self, move: Move, point: ProgramPoint, previous: FloatArray | None) -> FloatArray:
        external = self._external(move, point, previous)
        if point.by_axes:
            return np.concatenate([external, point.arm_joints()])
        if previous is None:
            words = self.program.words
            raise PathError(
                f"{move.label}: nothing says in which posture: no motion to {words.axis_position}"
                f" of {words.declarations} comes before it, give --start"
            )
        T = self.pose(point, previous)
        q = joints_along_path(self.solver, T[None], external[None], previous, _row_name(move))
        return np.asarray(q[0], dtype=float)

    def _external(self, move: Move, point: ProgramPoint, previous: FloatArray | None) -> FloatArray:
        """Return the external axes of the point, or those of the point before."""
        robot = self.solver.robot
        external = point.external_joints(robot.revolute[: robot.external_axes])
        if external is None:
            if previous is None:
                axis = self.program.words.external_axis
                raise PathError(f"{move.label} has no {axis}: give --start")
            return np.asarray(previous[: robot.external_axes], dtype=float)
        check_limits(robot, external[None], _row_name(move), "is programmed")
        return external

    def _require_one_posture(self, move: Move, before: FloatArray, q: FloatArray) -> None:
        gap = np.where(self.solver.robot.revolute, np.angle(np.exp(1j * (q - before))), 0.0)
        if not np.abs(gap).max() <= _SAME:
            raise PathError(
                f"{move.label}: is reached in another posture than before: it deflects otherwise"
                " there, make it two points"
            )


def _row_name(move: Move) -> RowName:
    return lambda _: move.label
