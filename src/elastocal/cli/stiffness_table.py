"""The table that ``elastocal stiffness`` prints."""

import numpy as np
from rich.console import Console
from rich.table import Table

from elastocal.workflows import ChosenStiffness, ExternalAxis, StiffnessResult


def show(console: Console, result: StiffnessResult) -> None:
    """Print the choices as a table, and the notes on them."""
    summary = result.summary
    table = Table("posture", title=f"stiffness along {result.along} in N/µm")
    # Of several external axes the figure shows the first; choice.csv has all.
    rail = summary.external_axes[:1]
    for name in ("softest", "mean", "spin", *(axis.name for axis in rail), "stations"):
        table.add_column(name, justify="right")
    for choice in summary.choices:
        table.add_row(choice.name, *_cells(choice, rail), str(choice.stations))
    console.print(table)
    postures = summary.postures
    refused = ", ".join(f"{count} by {what}" for what, count in postures.refused.items() if count)
    console.print(
        f"{postures.allowed} of {postures.tried} postures are allowed"
        + (f"; refused: {refused}" if refused else "")
    )
    for note in result.notes:
        console.print(f"Note: {note}")


def _cells(choice: ChosenStiffness, rail: tuple[ExternalAxis, ...]) -> list[str]:
    if not choice.stations:
        return ["none"] * (3 + len(rail))
    spin = "various" if choice.spin is None else f"{np.degrees(choice.spin):.0f} deg"
    numbers = [f"{1e-6 * value:.3g}" for value in (choice.softest, choice.mean)]
    stands = [
        "various" if choice.stand is None else f"{choice.stand:.3g} {axis.unit}" for axis in rail
    ]
    return [*numbers, spin, *stands]
