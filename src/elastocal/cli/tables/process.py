"""The table that ``elastocal simulate-process`` prints."""

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table as Printed

from elastocal.compensation.process import DeviationComparison, SimulateProcessResult


def show_process(console: Console, table: SimulateProcessResult) -> None:
    """Print the table in mm, and the budget below it."""
    points = f"{table.lines[-1].points} points"
    title = f"{table.cell}, {table.process}: absolute deviation in mm at {points}"
    console.print(_printed(title, table.lines))
    if table.budget:
        console.print(_printed(f"error budget of seed {table.runs[0].seed}", table.budget))


def _printed(title: str, lines: Sequence[DeviationComparison]) -> Printed:
    """Return a table with two lines of text a line: before and after, reduction below."""
    printed = Printed("before > after, reduction", title=title, show_lines=True)
    for name in ("mean", "max", "st. dev."):
        printed.add_column(name, justify="right", no_wrap=True)
    for line in lines:
        triples = zip(line.before.values, line.after.values, line.reduction.values, strict=True)
        cells = [f"{1e3 * b:.3f} > {1e3 * a:.3f}\n{100 * r:.1f} %" for b, a, r in triples]
        printed.add_row(line.name, *cells)
    return printed
