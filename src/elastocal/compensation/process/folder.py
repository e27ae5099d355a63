"""The folder of a simulated process: the table, the budget, and the deviation at every cycle.

==================  ==============================================================
``table.json``      the table with what it rests on, SI units: `record.Table`
``table.csv``       the same lines for a spreadsheet, in mm and %
``budget.csv``      the error budget, where it was asked for
``deviations.csv``  a row a cycle: seed, course, time, place, deviation
``path.csv``        the programmed path with its expected forces: `programme`
==================  ==============================================================
"""

import csv
import io
from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.process.course import Course
from elastocal.compensation.process.loop import CourseDeviation
from elastocal.compensation.process.record import SCHEMA, Line, ProcessRecord, Table, Values
from elastocal.compensation.process.table import Figures, compare
from elastocal.errors import CompensationError
from elastocal.files import read_text, write_json, write_text
from elastocal.schema import read_json

DEVIATIONS = "deviations.csv"
HEADER = ("seed", "course", "time[s]", "x[mm]", "y[mm]", "z[mm]", "before[mm]", "after[mm]")
"""Place: the programmed tool centre point in base."""


def _write_deviations(path: Path, traces: Sequence[CourseDeviation]) -> None:
    """Write courses cycle by cycle, atomically.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(HEADER)
    for trace in traces:
        lengths = np.column_stack([trace.position, trace.before, trace.after])
        for time, row in zip(trace.time.tolist(), (1e3 * lengths).tolist(), strict=True):
            numbers = [f"{value:.6f}" for value in row]
            table.writerow([trace.seed, trace.course, f"{time:.6f}", *numbers])
    write_text(path, text.getvalue())


def _read_deviations(path: Path) -> tuple[CourseDeviation, ...]:
    """Return the courses of a ``deviations.csv``.

    Raises
    ------
    CompensationError
        If header, row or number is not as written, by line.
    FileAccessError
        If the file cannot be read.
    """
    header, *rows = csv.reader(io.StringIO(read_text(path)))
    if tuple(header) != HEADER:
        raise CompensationError(
            f"{path}: header {','.join(header)!r} is not that of deviations, {','.join(HEADER)!r}"
        )
    if not rows:
        raise CompensationError(f"{path} has no rows")
    short = [n for n, row in enumerate(rows, start=2) if len(row) != len(HEADER)]
    if short:
        raise CompensationError(
            f"{path}: line {short[0]} has {len(rows[short[0] - 2])} fields, not {len(HEADER)}"
        )
    numbers = np.array([_numbers(path, n, row) for n, row in enumerate(rows, start=2)])
    courses = groupby(range(len(rows)), key=lambda n: (numbers[n, 0], rows[n][1]))
    return tuple(
        _trace(int(seed), name, numbers[list(lines), 1:]) for (seed, name), lines in courses
    )


def _numbers(path: Path, line: int, row: Sequence[str]) -> list[float]:
    found = []
    for name, value in zip(HEADER, row, strict=True):
        if name == "course":
            continue
        try:
            number = int(value) if name == "seed" else float(value)
        except ValueError:
            number = np.nan
        if not np.isfinite(number):
            raise CompensationError(f"{path}: line {line}: {name} {value!r} is not a number")
        found.append(number)
    return found


def _trace(seed: int, course: str, numbers: FloatArray) -> CourseDeviation:
    time, lengths = numbers[:, 0], 1e-3 * numbers[:, 1:]
    return CourseDeviation(seed, course, time, lengths[:, :3], lengths[:, 3], lengths[:, 4])


TABLE = "table.json"
"""Name of the file by which the folder is known."""
_ALIKE = 1e-8
"""Deviations are written to the nanometre; figures that differ by more, in m, are of others."""


def process_figures(table: Table) -> dict[str, Any]:
    """Return a table as JSON-ready data, with its schema."""
    return table.stated(SCHEMA)


def write_process(folder: Path, record: ProcessRecord) -> None:
    """Write every file of a simulated process, ``table.json`` last.

    Parameters
    ----------
    folder : Path
        An existing folder.
    record : ProcessRecord
        What to write.

    Raises
    ------
    FileAccessError
        If a file cannot be written.
    """
    folder = Path(folder)
    write_text(folder / "table.csv", _lines(record.table.lines))
    if record.table.budget:
        write_text(folder / "budget.csv", _lines(record.table.budget))
    _write_deviations(folder / DEVIATIONS, record.traces)
    write_json(folder / TABLE, process_figures(record.table))


def read_table(path: Path) -> Table:
    """Return the validated contents of a ``table.json``.

    Raises
    ------
    SchemaError
        If it is not JSON, has another schema or does not fit.
    FileAccessError
        If it cannot be read.
    """
    return read_json(path, Table, SCHEMA)


def read_process(folder: Path) -> ProcessRecord:
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
    record = ProcessRecord(read_table(folder / TABLE), _read_deviations(folder / DEVIATIONS))
    _require_own(folder, record)
    return record


def _require_own(folder: Path, record: ProcessRecord) -> None:
    """Refuse deviations that are not those of the table."""
    for run, line in zip(record.table.runs, record.table.lines, strict=False):
        own = [trace for trace in record.traces if trace.seed == run.seed]
        if not own:
            raise CompensationError(f"{folder / DEVIATIONS} has no row of seed {run.seed}")
        found = compare(line.name, [t.before for t in own], [t.after for t in own])
        stated = line.comparison
        if not (_alike(found.before, stated.before) and _alike(found.after, stated.after)):
            raise CompensationError(
                f"{folder / DEVIATIONS} does not belong to {TABLE}: seed {run.seed} has"
                f" {found.after.points} points with {1e3 * found.after.mean:.6f} mm mean after"
                f" correction, the table says {stated.after.points} with"
                f" {1e3 * stated.after.mean:.6f} mm"
            )


def _alike(a: Figures, b: Figures) -> bool:
    pairs = ((a.mean, b.mean), (a.largest, b.largest), (a.deviation, b.deviation))
    return a.points == b.points and all(abs(x - y) <= _ALIKE for x, y in pairs)


def _lines(lines: Sequence[Line]) -> str:
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    kinds = ("mean", "max", "st_dev")
    header = [f"{side}_{kind}[mm]" for side in ("before", "after") for kind in kinds]
    table.writerow(["line", *header, *(f"reduction_{kind}[%]" for kind in kinds), "points"])
    for line in lines:
        sizes = [f"{1e3 * value:.6f}" for value in (*_three(line.before), *_three(line.after))]
        shares = [f"{100 * share:.3f}" for share in _three(line.reduction)]
        table.writerow([line.name, *sizes, *shares, line.points])
    return text.getvalue()


def _three(values: Values) -> tuple[float, float, float]:
    return values.mean, values.max, values.standard_deviation


PROGRAMMED_PATH = "path.csv"
"""Name of the file in a process's folder."""
_UNITS = {"angle": "rad", "length": "m"}


def write_programmed_path(path: Path, courses: Sequence[Course], joint_units: Mapping[str, str]) -> None:
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
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    names = [f"{name}[{_UNITS[dimension]}]" for name, dimension in joint_units.items()]
    table.writerow(["course", "time[s]", *names, *(f"force_{axis}[N]" for axis in "xyz")])
    for course in courses:
        time = course.step * np.arange(len(course.q))
        for t, q, force in zip(
            time.tolist(), course.q.tolist(), course.force.tolist(), strict=True
        ):
            row = [f"{value:.9f}" for value in q] + [f"{value:.3f}" for value in force]
            table.writerow([course.name, f"{t:.3f}", *row])
    write_text(path, text.getvalue())
