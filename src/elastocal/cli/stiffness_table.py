"""What ``elastocal stiffness`` tells a person."""

from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from elastocal.cli.coverage import NOT_COVERED
from elastocal.cli.stiffness_answer import Answer


def show(console: Console, found: Answer, figures: dict[str, Any]) -> None:
    """Print the choices as a table, and what is to be known of them."""
    table = Table("posture", title=f"stiffness along {found.along} in N/µm")
    # Of several external axes the figure shows the first; choice.csv has all.
    rail = figures["external_axes"][:1]
    for name in ("softest", "mean", "spin", *(axis["name"] for axis in rail), "stations"):
        table.add_column(name, justify="right")
    for choice in figures["choices"]:
        table.add_row(choice["name"], *_cells(choice, rail), str(choice["stations"]))
    console.print(table)
    postures = figures["postures"]
    refused = ", ".join(
        f"{count} by {what}" for what, count in postures["refused"].items() if count
    )
    console.print(
        f"{postures['allowed']} of {postures['tried']} postures are allowed"
        + (f"; refused: {refused}" if refused else "")
    )
    for note in _notes(found, figures):
        console.print(f"Note: {note}")


def _cells(choice: dict[str, Any], rail: list[dict[str, str]]) -> list[str]:
    if not choice["stations"]:
        return ["none"] * (3 + len(rail))
    spin = "various" if choice["spin"] is None else f"{np.degrees(choice['spin']):.0f} deg"
    numbers = [f"{1e-6 * choice[name]:.3g}" for name in ("softest", "mean")]
    stands = [
        "various" if choice["stand"] is None else f"{choice['stand']:.3g} {axis['unit']}"
        for axis in rail
    ]
    return [*numbers, spin, *stands]


def _notes(found: Answer, figures: dict[str, Any]) -> list[str]:
    notes = []
    for choice in figures["choices"]:
        turns = choice["posture_jumps"]
        if choice["spin"] is not None and turns:
            where = "1 station" if turns == 1 else f"{turns} stations"
            notes.append(f"{choice['name']}: at {where} a joint turns by more than 90 deg")
    if found.choice.one is None:
        notes.append("no single posture is allowed at every station")
    return notes + ([] if found.covered else [NOT_COVERED])
