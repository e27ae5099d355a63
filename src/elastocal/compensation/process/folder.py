"""The folder of a simulated process: the table, the budget, and the deviation at every cycle.

==================  ==============================================================
``table.json``      the table with what it rests on: `result.SimulateProcessResult`
``table.csv``       the same lines for a spreadsheet, in mm and %
``budget.csv``      the error budget, where it was asked for
``deviations.csv``  a row a cycle: seed, course, time, place, deviation
``path.csv``        the programmed path with its expected forces
==================  ==============================================================
"""

from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.process.course import Course
from elastocal.compensation.process.loop import CourseDeviation
from elastocal.compensation.process.result import (
    DeviationComparison,
    DeviationStatistics,
    SimulatedProcess,
    SimulateProcessResult,
    compare_deviations,
)
from elastocal.errors import CompensationError
from elastocal.records import read_json, write_json
from elastocal.tables import TableError, TableRows, opened_table, write_table

TABLE = "table.json"
"""Name of the file by which the folder is known."""
DEVIATIONS = "deviations.csv"
PROGRAMMED_PATH = "path.csv"
_HEADER = ("seed", "course", "time[s]", "x[mm]", "y[mm]", "z[mm]", "before[mm]", "after[mm]")
"""Columns of ``deviations.csv``; the place is the programmed tool centre point in base."""
_ALIKE = 1e-8
"""Deviations are written to the nanometre; figures that differ by more, in m, are of others."""
_UNITS = {"angle": "rad", "length": "m"}


def write_process(folder: Path, process: SimulatedProcess) -> None:
    """Write every file of a simulated process but the programmed path, ``table.json`` last.

    Parameters
    ----------
    folder : Path
        An existing folder.
    process : SimulatedProcess
        The table and the deviations behind it.

    Raises
    ------
    FileAccessError
        If a file cannot be written.
    """
    folder = Path(folder)
    _write_lines(folder / "table.csv", process.table.lines)
    if process.table.budget:
        _write_lines(folder / "budget.csv", process.table.budget)
    _write_deviations(folder / DEVIATIONS, process.courses)
    write_json(folder / TABLE, process.table)


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


def read_table(path: Path) -> SimulateProcessResult:
    """Return the validated contents of a ``table.json``.

    Raises
    ------
    SchemaError
        If it is not JSON, has another schema or does not fit.
    FileAccessError
        If it cannot be read.
    """
    return read_json(path, SimulateProcessResult)


def read_process(folder: Path) -> SimulatedProcess:
    """Return what `write_process` wrote.

    Raises
    ------
    SchemaError
        If ``table.json`` does not fit.
    CompensationError
        If ``deviations.csv`` does not fit, or is not that of the table.
    FileAccessError
        If a file cannot be read.
    """
    folder = Path(folder)
    process = SimulatedProcess(read_table(folder / TABLE), _read_deviations(folder / DEVIATIONS))
    _require_same_process(folder, process)
    return process


def _require_same_process(folder: Path, process: SimulatedProcess) -> None:
    """Refuse deviations that are not those of the table."""
    for run, stated in zip(process.table.runs, process.table.lines, strict=False):
        own = [course for course in process.courses if course.seed == run.seed]
        if not own:
            raise CompensationError(f"{folder / DEVIATIONS} has no row of seed {run.seed}")
        found = compare_deviations(stated.name, [c.before for c in own], [c.after for c in own])
        if not (
            found.points == stated.points
            and _alike(found.before, stated.before)
            and _alike(found.after, stated.after)
        ):
            raise CompensationError(
                f"{folder / DEVIATIONS} does not belong to {TABLE}: seed {run.seed} has"
                f" {found.points} points with {1e3 * found.after.mean:.6f} mm mean after"
                f" correction, the table says {stated.points} with"
                f" {1e3 * stated.after.mean:.6f} mm"
            )


def _alike(a: DeviationStatistics, b: DeviationStatistics) -> bool:
    return all(abs(x - y) <= _ALIKE for x, y in zip(a.values, b.values, strict=True))


def _write_lines(path: Path, lines: Sequence[DeviationComparison]) -> None:
    kinds = ("mean", "max", "st_dev")
    header = [f"{side}_{kind}[mm]" for side in ("before", "after") for kind in kinds]
    rows: list[list[object]] = []
    for line in lines:
        sizes = [f"{1e3 * value:.6f}" for value in (*line.before.values, *line.after.values)]
        shares = [f"{100 * share:.3f}" for share in line.reduction.values]
        rows.append([line.name, *sizes, *shares, line.points])
    columns = ["line", *header, *(f"reduction_{kind}[%]" for kind in kinds), "points"]
    write_table(path, columns, rows)


def _write_deviations(path: Path, courses: Sequence[CourseDeviation]) -> None:
    rows: list[list[object]] = []
    for course in courses:
        lengths = np.column_stack([course.position, course.before, course.after])
        for time, row in zip(course.time.tolist(), (1e3 * lengths).tolist(), strict=True):
            numbers = [f"{value:.6f}" for value in row]
            rows.append([course.seed, course.course, f"{time:.6f}", *numbers])
    write_table(path, _HEADER, rows)


def _read_deviations(path: Path) -> tuple[CourseDeviation, ...]:
    """Return the courses of a ``deviations.csv``; refuse what is not as written, by line."""
    try:
        with opened_table(path) as table:
            header, rows = table.layout.header, table.rows()
    except TableError as error:
        raise CompensationError(f"{path}: {error}") from error
    if header != _HEADER:
        raise CompensationError(
            f"{path}: header {','.join(header)!r} is not that of deviations, {','.join(_HEADER)!r}"
        )
    if not rows:
        raise CompensationError(f"{path} has no rows")
    if uneven := rows.uneven(len(_HEADER)):
        raise CompensationError(
            f"{path}: line {uneven[0]} has {uneven[1]} fields, not {len(_HEADER)}"
        )
    numbers = _numbers(path, rows)
    courses = groupby(range(len(rows)), key=lambda n: (numbers[n, 0], rows.cells[n][1]))
    return tuple(
        _course_deviation(int(seed), name, numbers[list(lines), 1:])
        for (seed, name), lines in courses
    )


def _numbers(path: Path, rows: TableRows) -> FloatArray:
    """Return all columns but the course, shape (row, 7)."""
    names = [name for name in _HEADER if name != "course"]
    places = [_HEADER.index(name) for name in names]
    found = np.empty((len(rows), len(names)))
    for row, (line, cells) in enumerate(zip(rows.lines, rows.cells, strict=True)):
        for column, (name, place) in enumerate(zip(names, places, strict=True)):
            value = cells[place]
            try:
                number = int(value) if name == "seed" else float(value)
            except ValueError:
                number = np.nan
            if not np.isfinite(number):
                raise CompensationError(f"{path}: line {line}: {name} {value!r} is not a number")
            found[row, column] = number
    return found


def _course_deviation(seed: int, course: str, numbers: FloatArray) -> CourseDeviation:
    time, lengths = numbers[:, 0], 1e-3 * numbers[:, 1:]
    return CourseDeviation(seed, course, time, lengths[:, :3], lengths[:, 3], lengths[:, 4])
