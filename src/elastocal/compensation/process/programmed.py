"""The programmed path of a process, as a file: courses written, and a user's own courses read.

It is the table that ``elastocal compensate`` reads: joints or tcp poses, forces on the robot in
base or in the tcp frame. Two more columns make it a process: ``course``, a name for each section of
path under force (without it the file is one course), and ``time[s]``, which may begin again with
every course (without it the tool moves at constant speed).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from elastocal.arrays import FloatArray
from elastocal.compensation.offline import programmed_rows
from elastocal.compensation.process.course import Course, arc_length, unit_tangents
from elastocal.dataset import (
    PathRows,
    PathTable,
    find_columns,
    in_file,
)
from elastocal.errors import PathError, present
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.robot.inverse import InverseKinematics, check_limits, inverse_for
from elastocal.tables import write_table
from elastocal.units import parse_number

_UNITS = {"angle": "rad", "length": "m"}
_STEP = 0.02
"""Time between the rows of a course that a file was read into, about, in s."""
_MOST = 200_000
"""Rows of a file: the truth costs a millisecond and more a row."""
_FLAT = 1e-3
"""Sine of the angle between feed and tool axis below which there is no side to deviate to."""
LATERAL, NORMAL = "lateral", "normal"


@brief_repr
@dataclass(frozen=True)
class PathTiming:
    """Options that turn a path file into courses in time."""

    speed: float | None = None
    """Speed of the tool along the path, in m/s; None: the file's column ``time[s]`` says it."""
    cycle: float = 0.004
    """Cycle of the compensator, in s; the time between rows is a multiple of it."""
    start: FloatArray | None = None
    """Posture before the first row of a path of poses, shape (joint,), in rad or m."""

    @property
    def step(self) -> float:
        """Time between the rows of a course, in s."""
        return max(1, round(_STEP / self.cycle)) * self.cycle


def read_programmed_path(
    path: Path, robot: Robot, timing: PathTiming, direction: str = LATERAL
) -> tuple[Course, ...]:
    """Return the courses of a path file, at even steps of time.

    Between rows of joints the joints change evenly, between poses the pose does.

    Parameters
    ----------
    path : Path
        CSV as for `elastocal.compensation.offline.compensate_path`, with columns ``course`` and
        ``time[s]`` where there are any.
    robot : Robot
        That follows it.
    timing : PathTiming
        Speed, step and start.
    direction : str
        What the deviation counts along: ``lateral``, square to feed and tool axis; ``normal``,
        along the tool's axis, out of the surface; or a vector in base, ``"1,0,0"``.

    Raises
    ------
    PathError
        If the file is not of the contract, a row is out of reach, time does not advance, there is
        neither time nor speed, or a course has no side to deviate to; by its line.
    FileAccessError
        If the file cannot be read.
    """
    solver = inverse_for(robot)
    with in_file(path):
        table = PathTable.open(path, lambda header: find_columns(header, robot))
        rows = table.rows(_MOST, "simulate a part of it")
        time = rows.times()
        if timing.speed is None and time is None:
            raise PathError("nothing says how fast the path is run: give column time[s] or --speed")
        courses, previous = [], timing.start
        for name, some in _runs(rows):
            of_course = None if time is None else time[some]
            stretch = _Stretch(name, rows.part(some), of_course)
            course = _course(solver, stretch, timing, previous)
            courses.append(_directed(course, direction))
            previous = course.q[-1]
        return tuple(courses)


def write_programmed_path(
    path: Path, courses: Sequence[Course], joint_units: Mapping[str, str]
) -> None:
    """Write programmed joints and expected forces, a row a cycle, atomically.

    The columns are those that ``elastocal compensate`` and ``elastocal predict`` read; forces are
    on the robot, in base.

    Parameters
    ----------
    path : Path
        A CSV file.
    courses : sequence of Course
        With joints.
    joint_units : mapping of str to str
        The robot's joints, from base to tip, with their dimension: ``angle`` or ``length``.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    names = [f"{name}[{_UNITS[dimension]}]" for name, dimension in joint_units.items()]
    rows: list[list[str]] = []
    for course in courses:
        time = course.step * np.arange(len(course.q))
        numbers = zip(time.tolist(), course.q.tolist(), course.force.tolist(), strict=True)
        for t, q, force in numbers:
            row = [f"{value:.9f}" for value in q] + [f"{value:.3f}" for value in force]
            rows.append([course.name, f"{t:.3f}", *row])
    header = ["course", "time[s]", *names, *(f"force_{axis}[N]" for axis in "xyz")]
    write_table(path, header, rows)


@dataclass(frozen=True, eq=False)
class _Stretch:
    """The rows of one course, as the file has them."""

    name: str
    rows: PathRows
    time: FloatArray | None
    """Time as in the file, shape (row,), in s; None: not given."""


def _runs(rows: PathRows) -> Iterator[tuple[str, slice]]:
    """Yield courses with their rows; a name that comes back is another course's."""
    seen: set[str] = set()
    names = rows.names("course") or ("path",) * len(rows)
    for name, indices in groupby(range(len(names)), key=names.__getitem__):
        run = list(indices)
        first = rows.label(run[0])
        if name in seen:
            raise PathError(f"{first}: course {name!r} begins a second time: name each once")
        if len(run) < 2:
            raise PathError(f"{first}: course {name!r} has a single row, it must have two")
        seen.add(name)
        yield name, slice(run[0], run[-1] + 1)


def _course(
    solver: InverseKinematics, stretch: _Stretch, timing: PathTiming, previous: FloatArray | None
) -> Course:
    """Return a course at even steps, its direction not known yet."""
    robot, rows = solver.robot, stretch.rows
    if rows.T_base_tcp is None:
        check_limits(robot, rows.joints, rows.label, "is programmed")
    given = robot.forward(rows.joints) if rows.T_base_tcp is None else rows.T_base_tcp
    time = _times(stretch, given, timing.speed)
    at = np.arange(0.0, time[-1] + 1e-9, timing.step)
    if len(at) < 3:
        raise PathError(
            f"{rows.label(0)}: course {stretch.name!r} takes {time[-1]:.3g} s, it must take"
            f" {2.0 * timing.step:.3g} s and more"
        )
    # Forces are turned at the file's own rows: the tool may turn in between.
    force = _interpolated(time, rows.wrench_in_base(given)[0], at)
    poses = None if rows.T_base_tcp is None else _poses_at(time, rows.T_base_tcp, at)
    joints = _interpolated(time, rows.joints, at)
    nearest = np.searchsorted(time, at, side="right") - 1
    q, T = programmed_rows(
        solver, joints, poses, previous, lambda row: f"after {rows.label(int(nearest[row]))}"
    )
    nowhere = np.zeros((len(q), 3))
    return Course(stretch.name, timing.step, T, force, nowhere, q=q)


def _times(stretch: _Stretch, T_base_tcp: FloatArray, speed: float | None) -> FloatArray:
    """Return the time of each row of the file since the first, shape (row,), in s."""
    if speed is not None:
        time = arc_length(T_base_tcp[:, :3, 3]) / speed
        problem = "does not move on: a path without --speed may stand, with column time[s]"
    else:
        stated = present(stretch.time, "time")
        time = stated - stated[0]
        problem = "time does not advance from the row before"
    back = ~(np.diff(time) > 0.0)
    if back.any():
        raise PathError(f"{stretch.rows.label(int(np.argmax(back)) + 1)}: {problem}")
    return time


def _interpolated(time: FloatArray, columns: FloatArray, at: FloatArray) -> FloatArray:
    if not columns.shape[1]:
        return np.zeros((len(at), 0))
    return np.stack([np.interp(at, time, column) for column in columns.T], axis=1)


def _poses_at(time: FloatArray, T_base_tcp: FloatArray, at: FloatArray) -> FloatArray:
    T = np.tile(np.eye(4), (len(at), 1, 1))
    T[:, :3, :3] = Slerp(time, Rotation.from_matrix(T_base_tcp[:, :3, :3]))(at).as_matrix()
    T[:, :3, 3] = _interpolated(time, T_base_tcp[:, :3, 3], at)
    return T


def _directed(course: Course, direction: str) -> Course:
    """Return a course with the unit vectors that its deviation counts along."""
    axis = course.T_base_tcp[:, :3, 2]
    if direction == NORMAL:
        along = -axis
    elif direction == LATERAL:
        with np.errstate(invalid="ignore"):
            along = np.cross(axis, unit_tangents(course.T_base_tcp[:, :3, 3]))
    else:
        along = np.tile(_vector(direction), (len(axis), 1))
    length = np.linalg.norm(along, axis=1, keepdims=True)
    if not np.all(length > _FLAT):
        raise PathError(
            f"course {course.name!r} stands or goes along the tool's axis at"
            f" {course.step * int(np.argmin(length > _FLAT)):.2f} s: it has no side to deviate to;"
            f" give --direction {NORMAL} or a vector"
        )
    return replace(course, direction=along / length)


def _vector(text: str) -> FloatArray:
    try:
        vector = np.array([parse_number(part) for part in text.split(",")])
    except ValueError:
        vector = np.zeros(0)
    if vector.shape != (3,) or not 0.0 < float(np.linalg.norm(vector)) < np.inf:
        raise PathError(
            f"direction {text!r} must be {LATERAL!r}, {NORMAL!r} or three numbers, not all 0,"
            " e.g. '1,0,0'"
        )
    unit: FloatArray = vector / np.linalg.norm(vector)
    return unit
