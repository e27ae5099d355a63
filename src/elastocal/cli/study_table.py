"""What ``study`` prints for a person: a row a condition, and the advice."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from elastocal.codec.study import StudyRecord
from elastocal.codec.study.settings import written
from elastocal.codec.study.summary import Share

MOST_ROWS = 40
_CAPTION = (
    "errors in µm: median over the arms and, in brackets, its 5 % and 95 % quantiles; shares with"
    " 95 % intervals"
)


def show_study(console: Console, record: StudyRecord, out: Path, names: Sequence[str]) -> None:
    """Print what a study says."""
    console.print(
        f"[bold]{escape(record.cell)}[/bold]: {record.samples} simulated arms, errors at"
        f" {record.verification} unseen poses under {', '.join(record.load_cases)}"
    )
    console.print(_table(record))
    if len(record.conditions) > MOST_ROWS:
        console.print(f"{len(record.conditions) - MOST_ROWS} more conditions in study.csv")
    if record.advice:
        console.print(record.advice, markup=False)
    console.print(f"\n{', '.join(names)} written to [bold]{escape(str(out))}[/bold]")


def _table(record: StudyRecord) -> Table:
    factors = record.varied or ("poses",)
    table = Table(caption=_CAPTION)
    for name in (*factors, "mean", "largest", "none"):
        table.add_column(escape(name), justify="right")
    if record.target is not None:
        table.add_column("mean good", justify="right")
        table.add_column("largest good", justify="right")
    for each in record.conditions[:MOST_ROWS]:
        condition = each.factors.condition
        cells = [written(condition.value(key)) for key in factors]
        for found in (each.error_mean, each.error_max):
            cells.append(f"{1e6 * found.median:.3g} [{1e6 * found.q05:.3g}, {1e6 * found.q95:.3g}]")
        cells.append(f"{1e6 * each.deflection_mean.median:.0f}")
        if record.target is not None:
            cells += [_share(each.mean_reaches), _share(each.max_reaches)]
        table.add_row(*map(escape, cells))
    return table


def _share(share: Share | None) -> str:
    assert share is not None
    return f"{share.share:.0%} [{share.low:.0%}, {share.high:.0%}]"
