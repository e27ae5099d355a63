"""``deviations.csv``: a row a cycle, with the place on the path and the deviation there."""

import csv
import io
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.process.trace import Trace
from elastocal.errors import CompensationError
from elastocal.files import read_text, write_text

DEVIATIONS = "deviations.csv"
HEADER = ("seed", "course", "time[s]", "x[mm]", "y[mm]", "z[mm]", "before[mm]", "after[mm]")
"""Place: the programmed tool centre point in base."""


def write_traces(path: Path, traces: Sequence[Trace]) -> None:
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


def read_traces(path: Path) -> tuple[Trace, ...]:
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


def _trace(seed: int, course: str, numbers: FloatArray) -> Trace:
    time, lengths = numbers[:, 0], 1e-3 * numbers[:, 1:]
    return Trace(seed, course, time, lengths[:, :3], lengths[:, 3], lengths[:, 4])
