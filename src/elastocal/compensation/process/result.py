"""The result of a simulated process: the paper's Table 1 and every point behind it.

Its folder has, lengths in m and reductions as shares of 1 where no unit is named:

==================  ==============================================================
``table.json``      the table with what it rests on: `SimulateProcessResult`
``table.csv``       the same lines for a spreadsheet, in mm and %
``budget.csv``      the error budget, where it was asked for
``deviations.csv``  a row a cycle: seed, course, time, place, deviation
``path.csv``        the programmed path with its expected forces
==================  ==============================================================
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.blocks import Block
from elastocal.compensation.process.loop import CourseRun
from elastocal.compensation.process.statistics import (
    DeviationComparison,
    DeviationStatistics,
    LoadLines,
    PostureGain,
    SeedMeans,
    compare_deviations,
)
from elastocal.errors import CompensationError
from elastocal.identification import ProductionCoverage
from elastocal.records import read_json, record, write_json
from elastocal.results import Result, brief_repr
from elastocal.tables import TableError, TableRows, opened_table, write_table
from elastocal.units import parse_number

TABLE = "table.json"
"""Name of the file by which the folder is known."""
DEVIATIONS = "deviations.csv"
PROGRAMMED_PATH = "path.csv"
_OLD_HEADER = ("seed", "course", "time[s]", "x[mm]", "y[mm]", "z[mm]", "before[mm]", "after[mm]")
"""Columns of older ``deviations.csv``, without the 3-D deviation."""
_HEADER = (*_OLD_HEADER, "before_3d[mm]", "after_3d[mm]")
"""Columns of ``deviations.csv``; the place is the programmed tool centre point in base."""
_ALIKE = 1e-8
"""Deviations are written to the nanometre; figures that differ by more than this, in m, belong to
other data."""


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
    arm_state: str | None = None
    """File of the state of the arm; none: nothing was known of it."""
    arm_state_sha256: str | None = None


@record("elastocal.process/1", sealed=True)
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
    direction: str = ""
    """Component that ``lines`` describe, in a word."""
    spatial: tuple[DeviationComparison, ...] = ()
    """As ``lines``, for the 3-D deviation (the length of the shift)."""
    loads: tuple[LoadLines, ...] = ()
    """The same process at other shares of its load, where that was asked for."""
    posture: PostureGain | None = None
    """Course for which the stiffest posture was chosen; None: postures as programmed."""
    means: tuple[SeedMeans, ...] = ()
    """Means of each measure at each load over the seeds; without interval for a single seed."""
    path: str = ""
    """File of a user's own process; empty: one of the built-in ones."""
    path_sha256: str = ""
    preset: str = ""
    """Preset of the cell's truth; see `elastocal.sim.truth`."""
    process_stiffness: float = 0.0
    r"""Change of the force by a shift along the surface's normal, in N/m; 0: forces are given."""
    notes: tuple[str, ...] = ()
    """Notes for the user."""
    coverage: ProductionCoverage | None = None
    """Share of the process that the first model's calibration covers; None where it is not
    known."""
    landing_seconds: float | None = None
    """Longest time that press and reading of its offset take a course, in s; None: courses begin at
    once."""

    def __post_init__(self) -> None:
        """Refuse a table of nothing."""
        if not self.runs or len(self.lines) < len(self.runs):
            raise ValueError(f"{len(self.lines)} lines for {len(self.runs)} runs")

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        return (
            ("process", f"{self.process} in cell {self.cell}"),
            *((("tool", self.tool),) if self.tool else ()),
            *((line.name, line.sentence) for line in (*self.lines, *self.budget)),
            *((f"{line.name}, 3-D", line.sentence) for line in self.spatial[-1:]),
            *(("note", text) for text in self.notes),
        )

    def show(self) -> Iterator[Block]:
        """Yield the table beside the paper's, the error budget and the notes."""
        from elastocal.compensation.process.show import show_process

        return show_process(self)


@brief_repr
@dataclass(frozen=True, eq=False)
class CourseDeviation:
    """One course of one seed, at every cycle, without and with correction."""

    seed: int
    course: str
    time: FloatArray
    """Since the course began, shape (cycle,), in s."""
    position: FloatArray
    """Programmed tool centre point in base, shape (cycle, 3), in m."""
    before: FloatArray
    """Signed deviation without correction, shape (cycle,), in m."""
    after: FloatArray
    """Signed deviation with correction, shape (cycle,), in m."""
    spatial: FloatArray | None = None
    """3-D deviation (length of the shift) without and with correction, shape (cycle, 2), in m."""

    @classmethod
    def of(cls, seed: int, before: CourseRun, after: CourseRun) -> "CourseDeviation":
        """Return the deviations of a course that was run twice."""
        name, position = before.course.name, before.position
        spatial = np.stack([before.spatial, after.spatial], axis=1)
        return cls(seed, name, before.time, position, before.deviation, after.deviation, spatial)


@brief_repr
@dataclass(frozen=True, eq=False)
class SimulatedProcess:
    """A simulated process, as its folder keeps it."""

    table: SimulateProcessResult
    courses: tuple[CourseDeviation, ...]
    """Every course of every seed."""


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
    """Return the files that `write_process` wrote.

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
        if course.spatial is not None:
            lengths = np.hstack([lengths, course.spatial])
        for time, row in zip(course.time.tolist(), (1e3 * lengths).tolist(), strict=True):
            numbers = [f"{value:.6f}" for value in row]
            rows.append([course.seed, course.course, f"{time:.6f}", *numbers])
    has_spatial = all(course.spatial is not None for course in courses)
    write_table(path, _HEADER if has_spatial else _OLD_HEADER, rows)


def _read_deviations(path: Path) -> tuple[CourseDeviation, ...]:
    """Return the courses of a ``deviations.csv``; refuse a changed file, naming the line."""
    try:
        with opened_table(path) as table:
            header, rows = table.layout.header, table.rows()
    except TableError as error:
        raise CompensationError(f"{path}: {error}") from error
    if header not in (_HEADER, _OLD_HEADER):
        raise CompensationError(
            f"{path}: header {','.join(header)!r} is not that of deviations, {','.join(_HEADER)!r}"
        )
    if not rows:
        raise CompensationError(f"{path} has no rows")
    if uneven := rows.uneven(len(header)):
        raise CompensationError(
            f"{path}: line {uneven[0]} has {uneven[1]} fields, not {len(header)}"
        )
    numbers = _numbers(path, header, rows)
    courses = groupby(range(len(rows)), key=lambda n: (numbers[n, 0], rows.cells[n][1]))
    found = []
    for (seed, name), lines in courses:
        own = numbers[list(lines)]
        time, lengths = own[:, 1], 1e-3 * own[:, 2:]
        before, after = lengths[:, 3], lengths[:, 4]
        spatial = lengths[:, 5:7] if header == _HEADER else None
        found.append(CourseDeviation(int(seed), name, time, lengths[:, :3], before, after, spatial))
    return tuple(found)


def _numbers(path: Path, header: Sequence[str], rows: TableRows) -> FloatArray:
    """Return all columns but the course, shape (row, 7 or 9)."""
    names = [name for name in header if name != "course"]
    places = [header.index(name) for name in names]
    found = np.empty((len(rows), len(names)))
    for row, (line, cells) in enumerate(zip(rows.lines, rows.cells, strict=True)):
        for column, (name, place) in enumerate(zip(names, places, strict=True)):
            value = cells[place]
            try:
                number = float(int(value)) if name == "seed" else parse_number(value)
            except (ValueError, OverflowError):
                number = np.nan
            if not np.isfinite(number):
                raise CompensationError(f"{path}: line {line}: {name} {value!r} is not a number")
            found[row, column] = number
    return found
