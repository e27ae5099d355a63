"""The table that ``elastocal simulate-process`` prints."""

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table as Printed

from elastocal.compensation.process.record import Line, Table, Values


def show(console: Console, table: Table) -> None:
    """Print the table in mm, and the budget below it."""
    title = f"{table.cell}, {table.process}: absolute deviation in mm, before > after (reduction)"
    _show(console, title, table.lines)
    if table.budget:
        _show(console, f"error budget of seed {table.runs[0].seed}", table.budget)


def _show(console: Console, title: str, lines: Sequence[Line]) -> None:
    printed = Printed("", "mean", "max", "st. dev.", "points", title=title)
    for line in lines:
        triples = zip(*map(_three, (line.before, line.after, line.reduction)), strict=True)
        cells = [f"{1e3 * b:.3f} > {1e3 * a:.3f} ({100 * r:.1f} %)" for b, a, r in triples]
        printed.add_row(line.name, *cells, str(line.points))
    console.print(printed)


def _three(values: Values) -> tuple[float, float, float]:
    return values.mean, values.max, values.standard_deviation
