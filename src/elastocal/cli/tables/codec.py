"""Print what ``codec`` and ``study`` found: verdicts in words, a small table, the advice."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from elastocal.cli.output import bold, print_remarks
from elastocal.codec import CodecSummary
from elastocal.codec.study import Share, StudySummary, micrometres, value_text

_MOST_SIZES = 12


def show_codec(console: Console, result: CodecSummary, out: Path, names: Sequence[str]) -> None:
    """Print the verdicts of a codec."""
    console.print(f"{bold(result.robot)}: {result.settings.sentence}")
    for sentence in result.springs:
        console.print(sentence)
    console.print(_codec_table(result))
    for sentence in result.sentences:
        console.print(sentence)
    print_remarks(console, "note", result.findings)
    console.print(f"\n{', '.join(names)} written to {bold(str(out))}")


def _codec_table(result: CodecSummary) -> Table:
    """Return the median errors at held-out poses, for some numbers of training poses."""
    table = Table(box=None, pad_edge=False, title="error norm at held-out poses, µm: mean / max")
    table.add_column("training poses", justify="right")
    for name in result.variants:
        table.add_column(name, justify="right")
    curves = list(result.variants.values())
    sizes = len(curves[0].n_train)
    for k in np.unique(np.linspace(0, sizes - 1, min(sizes, _MOST_SIZES)).round().astype(int)):
        cells = [
            f"{1e6 * each.error_mean[k]:.1f} / {1e6 * each.error_max[k]:.1f}" for each in curves
        ]
        table.add_row(str(curves[0].n_train[k]), *cells)
    return table


_MOST_CONDITIONS = 40
_CAPTION = (
    "mean and largest error at unseen poses in µm: median over the arms, and what 95 % of them stay"
    " below; good: arms within the target, with a 95 % interval"
)


def show_study(console: Console, summary: StudySummary, out: Path, names: Sequence[str]) -> None:
    """Print what a study says."""
    console.print(f"{bold(summary.cell)}: {summary.sentence}")
    console.print(_study_table(summary))
    if len(summary.conditions) > _MOST_CONDITIONS:
        console.print(f"{len(summary.conditions) - _MOST_CONDITIONS} more conditions in study.json")
    if summary.advice:
        console.print(summary.advice)
    console.print(f"\n{', '.join(names)} written to {bold(str(out))}")


def _study_table(summary: StudySummary) -> Table:
    factors = summary.varied or ("poses",)
    table = Table(caption=_CAPTION, box=SIMPLE, pad_edge=False, padding=(0, 1, 0, 0))
    titles = [name.replace("_", " ") for name in factors]
    titles += ["mean", "95 %", "largest", "95 %"]
    titles += [] if summary.target is None else ["mean good", "largest good"]
    for number, title in enumerate(titles):
        longest = max(map(len, title.split()))
        table.add_column(title, justify="right", no_wrap=number >= len(factors), min_width=longest)
    for each in summary.conditions[:_MOST_CONDITIONS]:
        cells = [value_text(each.factors.value(key)) for key in factors]
        for found in (each.error_mean, each.error_max):
            cells += [micrometres(found.median), micrometres(found.q95)]
        if summary.target is not None:
            cells += [_share(each.mean_reaches), _share(each.max_reaches)]
        table.add_row(*cells)
    return table


def _share(share: Share | None) -> str:
    assert share is not None
    return f"{share.share:.0%} [{100 * share.low:.0f}, {100 * share.high:.0f}]"
