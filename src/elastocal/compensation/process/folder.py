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
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from elastocal.compensation.process.deviations import DEVIATIONS, read_traces, write_traces
from elastocal.compensation.process.record import SCHEMA, Line, ProcessRecord, Table, Values
from elastocal.compensation.process.table import Figures, compare
from elastocal.errors import CompensationError
from elastocal.files import write_json, write_text
from elastocal.records import read_json

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
    write_traces(folder / DEVIATIONS, record.traces)
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
    record = ProcessRecord(read_table(folder / TABLE), read_traces(folder / DEVIATIONS))
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
