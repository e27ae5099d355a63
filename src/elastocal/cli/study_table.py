"""What ``study`` prints for a person: a row a condition, and the advice."""

from collections.abc import Sequence
from pathlib import Path

from rich.box import SIMPLE
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from elastocal.codec.study import Share, StudySummary, micrometres, value_text

_MOST_ROWS = 40
_CAPTION = (
    "mean and largest error at unseen poses in µm: median over the arms, and what 95 % of them stay"
    " below; good: arms within the target, with a 95 % interval"
)


def show_study(console: Console, summary: StudySummary, out: Path, names: Sequence[str]) -> None:
    """Print what a study says."""
    console.print(f"[bold]{escape(summary.cell)}[/bold]: {escape(summary.sentence)}")
    console.print(_table(summary))
    if len(summary.conditions) > _MOST_ROWS:
        console.print(f"{len(summary.conditions) - _MOST_ROWS} more conditions in study.json")
    if summary.advice:
        console.print(summary.advice, markup=False)
    console.print(f"\n{', '.join(names)} written to [bold]{escape(str(out))}[/bold]")


def _table(summary: StudySummary) -> Table:
    factors = summary.varied or ("poses",)
    table = Table(caption=_CAPTION, box=SIMPLE, pad_edge=False, padding=(0, 1, 0, 0))
    titles = [escape(name.replace("_", " ")) for name in factors]
    titles += ["mean", "95 %", "largest", "95 %"]
    titles += [] if summary.target is None else ["mean good", "largest good"]
    for number, title in enumerate(titles):
        longest = max(map(len, title.split()))
        table.add_column(title, justify="right", no_wrap=number >= len(factors), min_width=longest)
    for each in summary.conditions[:_MOST_ROWS]:
        cells = [value_text(each.factors.value(key)) for key in factors]
        for found in (each.error_mean, each.error_max):
            cells += [micrometres(found.median), micrometres(found.q95)]
        if summary.target is not None:
            cells += [_share(each.mean_reaches), _share(each.max_reaches)]
        table.add_row(*map(escape, cells))
    return table


def _share(share: Share | None) -> str:
    assert share is not None
    return f"{share.share:.0%} [{100 * share.low:.0f}, {100 * share.high:.0f}]"
