"""The result of a simulated process: the paper's Table 1 and every point behind it.

Table 1 gives mean, maximum and standard deviation of the absolute deviation, before and after
correction, and the reduction. The folder that keeps them has, lengths in m and reductions as shares
of 1 where no unit is named:

==================  ==============================================================
``table.json``      the table with what it rests on: `SimulateProcessResult`
``table.csv``       the same lines for a spreadsheet, in mm and %
``budget.csv``      the error budget, where it was asked for
``deviations.csv``  a row a cycle: seed, course, time, place, deviation
``path.csv``        the programmed path with its expected forces
==================  ==============================================================
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.process.course import Course
from elastocal.compensation.process.loop import CourseDeviation
from elastocal.errors import CompensationError
from elastocal.records import read_json, record, write_json
from elastocal.results import Result, brief_repr
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


@record()
class DeviationStatistics:
    """Mean, maximum and standard deviation of absolute deviations, or of their reduction."""

    mean: float
    max: float
    standard_deviation: float

    @property
    def values(self) -> tuple[float, float, float]:
        """The three of them, in the order of Table 1."""
        return self.mean, self.max, self.standard_deviation

    @classmethod
    def of(cls, deviation: FloatArray) -> "DeviationStatistics":
        """Return the statistics of signed deviations, shape (point,), in m."""
        size = np.abs(deviation)
        return cls(float(size.mean()), float(size.max()), float(size.std()))


@record()
class DeviationComparison:
    """A line of the table: the same path before and after correction."""

    name: str
    points: int
    before: DeviationStatistics
    """In m."""
    after: DeviationStatistics
    """In m."""
    reduction: DeviationStatistics
    """1 is all of it, below 0 it grew."""

    @property
    def sentence(self) -> str:
        """The line in words."""
        return (
            f"{1e3 * self.before.mean:.3f} mm mean before, {1e3 * self.after.mean:.3f} mm after"
            f" correction ({self.reduction.mean:.1%} less); largest {1e3 * self.before.max:.3f} mm,"
            f" then {1e3 * self.after.max:.3f} mm"
        )

    @classmethod
    def of(
        cls, name: str, points: int, before: DeviationStatistics, after: DeviationStatistics
    ) -> "DeviationComparison":
        """Return a line with the reduction worked out."""
        pairs = zip(before.values, after.values, strict=True)
        reduction = DeviationStatistics(*(1.0 - a / b if b > 0.0 else 0.0 for b, a in pairs))
        return cls(name, points, before, after, reduction)


@record()
class ProcessRun:
    """The files that a seed was run with."""

    seed: int
    model: str
    """File."""
    model_sha256: str
    tool: str | None
    """File; none where the cell's tool was used and the sensor was zeroed in the air."""
    tool_sha256: str | None


@record("elastocal.process/1")
class SimulateProcessResult(Result):
    """The contents of ``table.json``."""

    cell: str
    process: str
    runs: tuple[ProcessRun, ...]
    settings: dict[str, object]
    """Settings of the compensator as they were used, for provenance; SI units."""
    versions: dict[str, str]
    lines: tuple[DeviationComparison, ...]
    """One a seed, in the order of ``runs``; with several seeds a last one over all."""
    budget: tuple[DeviationComparison, ...] = ()
    tool: str = ""
    """The tool that the models are for, in words; empty in files before it was written."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return what a person wants to know first."""
        return (
            ("process", f"{self.process} in cell {self.cell}"),
            *((("tool", self.tool),) if self.tool else ()),
            *((line.name, line.sentence) for line in (*self.lines, *self.budget)),
        )


@brief_repr
@dataclass(frozen=True, eq=False)
class SimulatedProcess:
    """A simulated process, as its folder keeps it."""

    table: SimulateProcessResult
    courses: tuple[CourseDeviation, ...]
    """Every course of every seed."""


def compare_deviations(
    name: str, before: Sequence[FloatArray], after: Sequence[FloatArray]
) -> DeviationComparison:
    """Return a line of the table over all points of some courses.

    Parameters
    ----------
    name : str
        The line's name.
    before, after : sequence of ndarray, shape (point,)
        Signed deviations of each course, in m.
    """
    uncorrected, corrected = np.concatenate(before), np.concatenate(after)
    return DeviationComparison.of(
        name, len(corrected), DeviationStatistics.of(uncorrected), DeviationStatistics.of(corrected)
    )


def pooled(name: str, lines: Sequence[DeviationComparison]) -> DeviationComparison:
    """Return the line over several: every point of each counts, the maximum is that of all."""
    points = np.array([line.points for line in lines])
    before, after = (
        _pooled_statistics(points, side)
        for side in ([line.before for line in lines], [line.after for line in lines])
    )
    return DeviationComparison.of(name, int(points.sum()), before, after)


def _pooled_statistics(
    points: np.ndarray, parts: Sequence[DeviationStatistics]
) -> DeviationStatistics:
    means = np.array([part.mean for part in parts])
    share = points / points.sum()
    mean = float(share @ means)
    # The mean square of all points, less the square of their mean: each part's own mean counts.
    squares = share @ (np.array([part.standard_deviation for part in parts]) ** 2 + means**2)
    spread = float(np.sqrt(max(squares - mean**2, 0.0)))
    return DeviationStatistics(mean, max(part.max for part in parts), spread)


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
    found = []
    for (seed, name), lines in courses:
        own = numbers[list(lines)]
        time, lengths = own[:, 1], 1e-3 * own[:, 2:]
        before, after = lengths[:, 3], lengths[:, 4]
        found.append(CourseDeviation(int(seed), name, time, lengths[:, :3], before, after))
    return tuple(found)


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
