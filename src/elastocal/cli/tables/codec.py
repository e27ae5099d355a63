"""What ``codec`` prints for a person: the verdicts in words, and a small table."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from elastocal.codec import CodecSummary

_MOST_ROWS = 12


def show_codec(console: Console, result: CodecSummary, out: Path, names: Sequence[str]) -> None:
    """Print the verdicts of a codec."""
    console.print(f"[bold]{escape(result.robot)}[/bold]: {result.settings.sentence}")
    console.print(_table(result))
    for sentence in result.sentences:
        console.print(sentence, markup=False)
    for finding in result.findings:
        console.print(f"[yellow]note:[/yellow] {escape(finding)}")
    console.print(f"\n{', '.join(names)} written to [bold]{escape(str(out))}[/bold]")


def _table(result: CodecSummary) -> Table:
    """Return the median errors at held-out poses, for some numbers of training poses."""
    table = Table(box=None, pad_edge=False, title="error norm at held-out poses, µm: mean / max")
    table.add_column("training poses", justify="right")
    for name in result.variants:
        table.add_column(escape(name), justify="right")
    curves = list(result.variants.values())
    sizes = len(curves[0].n_train)
    for k in np.unique(np.linspace(0, sizes - 1, min(sizes, _MOST_ROWS)).round().astype(int)):
        cells = [
            f"{1e6 * each.error_mean[k]:.1f} / {1e6 * each.error_max[k]:.1f}" for each in curves
        ]
        table.add_row(str(curves[0].n_train[k]), *cells)
    return table
