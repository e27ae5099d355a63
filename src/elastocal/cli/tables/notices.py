"""What the commands print that need no table: some lines each.

Results are named for type checkers only: no command imports another one's work.
"""

from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.markup import escape

if TYPE_CHECKING:
    from elastocal.workflows import (
        DemoResult,
        DeriveResult,
        InitResult,
        PredictResult,
        ReportResult,
    )


def show_example(console: Console, result: "InitResult") -> None:
    """Print where an example cell was written, and what comes next."""
    cell, names = escape(str(result.cell)), ", ".join(mesh.name for mesh in result.meshes)
    console.print(
        f"wrote [bold]{cell}[/bold] and {names}: edit it, then `elastocal check {cell}`",
        soft_wrap=True,
    )


def show_derived(console: Console, result: "DeriveResult") -> None:
    """Print what the streams of a run gave."""
    console.print(f"{len(result.dataset.poses)} poses, readings: {result.counts()}")
    for warning in result.summary.warnings:
        console.print(f"warning: {warning}", markup=False, soft_wrap=True)
    folder = result.folder
    console.print(f"wrote {folder.dataset} and {folder.summary.name}", markup=False, soft_wrap=True)


def show_predicted(console: Console, result: "PredictResult", out: Path) -> None:
    """Print how large the predicted deflections are."""
    figures, size = result.summary, result.summary.deflection
    console.print(
        f"{figures.rows} rows: predicted deflection {1e3 * size.mean:.3f} mm mean,"
        f" {1e3 * size.max:.3f} mm max; written to {out}",
        markup=False,
        soft_wrap=True,
    )
    if figures.misfit is None:
        console.print(
            "Note: the model does not know its errors at left-out poses, so that there are no"
            " intervals of what would be measured; calibrate again to have them",
            soft_wrap=True,
        )


def show_report(console: Console, result: "ReportResult") -> None:
    """Print the verdict of a report."""
    verdict = result.verdict
    console.print(f"[bold]{verdict.word}[/bold]{result.light}: {escape(verdict.sentence)}")
    for reason in verdict.reasons:
        console.print(f"   {reason}", markup=False)
    console.print(f"written to {result.files}", markup=False)


def show_demo(console: Console, result: "DemoResult") -> None:
    """Print what a demo came to."""
    for line in result.closing():
        console.print(line, soft_wrap=True, markup=False)
