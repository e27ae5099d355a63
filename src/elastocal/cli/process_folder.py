"""The files and the table that ``elastocal simulate-process`` makes."""

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from elastocal.cli.process_bench import Outcome
from elastocal.compensation.process.table import Comparison, Figures
from elastocal.files import write_json

SCHEMA = "elastocal.process/1"
LAST = "table.json"


def figures(
    facts: dict[str, Any], lines: Sequence[Comparison], budget: Sequence[Comparison]
) -> dict[str, Any]:
    """Return what ``table.json`` holds; SI units."""
    return {
        "schema": SCHEMA,
        **facts,
        "lines": [_line(line) for line in lines],
        "budget": [_line(line) for line in budget],
    }


def write_folder(
    folder: Path,
    found: dict[str, Any],
    lines: Sequence[Comparison],
    budget: Sequence[Comparison],
    outcomes: dict[int, Outcome],
) -> None:
    """Write table, budget and the deviation at every cycle.

    Raises
    ------
    FileAccessError
        If a file cannot be written.
    """
    _write_lines(folder / "table.csv", lines)
    if budget:
        _write_lines(folder / "budget.csv", budget)
    with (folder / "deviations.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["seed", "course", "time[s]", "before[mm]", "after[mm]"])
        for seed, outcome in outcomes.items():
            for before, after in zip(outcome.before, outcome.after, strict=True):
                rows = zip(
                    before.time.tolist(),
                    before.deviation.tolist(),
                    after.deviation.tolist(),
                    strict=True,
                )
                name = before.course.name
                writer.writerows(
                    [seed, name, f"{t:.3f}", f"{1e3 * b:.6f}", f"{1e3 * a:.6f}"] for t, b, a in rows
                )
    write_json(folder / LAST, found)


def show(
    console: Console, title: str, lines: Sequence[Comparison], budget: Sequence[Comparison]
) -> None:
    """Print the table in mm, and the budget below it."""
    _show(console, f"{title}: absolute deviation in mm, before > after (reduction)", lines)
    if budget:
        _show(console, "error budget of the first seed", budget)


def _show(console: Console, title: str, lines: Sequence[Comparison]) -> None:
    table = Table("", "mean", "max", "st. dev.", "points", title=title)
    for line in lines:
        pairs = zip(_values(line.before), _values(line.after), line.reduction, strict=True)
        cells = [f"{1e3 * b:.3f} > {1e3 * a:.3f} ({100 * r:.1f} %)" for b, a, r in pairs]
        table.add_row(line.name, *cells, str(line.after.points))
    console.print(table)


def _values(side: Figures) -> tuple[float, float, float]:
    return side.mean, side.largest, side.deviation


def _line(line: Comparison) -> dict[str, Any]:
    def of(values: tuple[float, float, float]) -> dict[str, float]:
        return dict(zip(("mean", "max", "standard_deviation"), values, strict=True))

    return {
        "name": line.name,
        "points": line.after.points,
        "before": of(_values(line.before)),
        "after": of(_values(line.after)),
        "reduction": of(line.reduction),
    }


def _write_lines(path: Path, lines: Sequence[Comparison]) -> None:
    kinds = ("mean", "max", "st_dev")
    header = [f"{side}_{kind}[mm]" for side in ("before", "after") for kind in kinds]
    rows = [
        [line.name]
        + [f"{1e3 * value:.6f}" for value in (*_values(line.before), *_values(line.after))]
        + [f"{100 * share:.3f}" for share in line.reduction]
        + [str(line.after.points)]
        for line in lines
    ]
    reductions = [f"reduction_{kind}[%]" for kind in kinds]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["line", *header, *reductions, "points"])
        writer.writerows(rows)
