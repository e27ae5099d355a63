"""Print what ``calibrate`` and ``report`` found."""

from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from elastocal.cli.output import bold, print_blocks, print_remarks
from elastocal.identification import CalibrateResult, show_calibration as shown_calibration

if TYPE_CHECKING:
    from elastocal.workflows import ReportResult


def show_calibration(console: Console, result: CalibrateResult, out: Path) -> None:
    """Print the figures of a calibration for a person."""
    figures = result.calibration
    if figures is not None:
        print_blocks(console, shown_calibration(figures))
        print_remarks(console, "warning", figures.warnings)
    console.print(f"\nmodel written to {bold(str(out))}")


def show_report(console: Console, result: "ReportResult") -> None:
    """Print the verdict of a report."""
    verdict = result.verdict
    console.print(f"{bold(verdict.word)}{result.light}: {verdict.meaning} {verdict.sentence}")
    for reason in verdict.reasons:
        console.print(f"   {reason}")
    console.print(f"written to {result.files}")
