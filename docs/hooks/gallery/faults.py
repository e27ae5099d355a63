"""What every fault does in every phase of a press, drawn from `fault_matrix.json`.

``python tests/support/walk_faults.py docs/hooks/gallery/fault_matrix.json`` walks the matrix.
"""

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from elastocal.report.plots import new_figure, style, write_figure

WALKED = Path(__file__).with_name("fault_matrix.json")


def make(folder: Path) -> dict[str, str]:
    """Make the figure; return what is told of it."""
    rows = json.loads(WALKED.read_text(encoding="utf-8"))
    write_figure(folder / "faults.svg", partial(_draw, rows))
    return {"faults": told(rows)}


def told(rows: list[dict[str, Any]]) -> str:
    """Return what the matrix came to, as a sentence."""
    added = max(row["added"] for row in rows)
    back = max(max(row["again"], row["pushed"]) for row in rows if row["message"])
    held = sum(row["released"] is None for row in rows)
    return (
        f"{len(rows)} cells of the matrix: at most {added:.0f} N added after a fault, at most"
        f" {1e3 * back:.2f} mm back to the surface; in {held} cells the tool stays"
    )


def _draw(rows: list[dict[str, Any]]) -> Figure:
    faults, phases = (list(dict.fromkeys(row[key] for row in rows)) for key in ("fault", "phase"))
    figure = new_figure(8.0, 0.26 * len(faults) + 1.2)
    axes = figure.subplots()
    added = np.full((len(faults), len(phases)), np.nan)
    for row in rows:
        y, x = faults.index(row["fault"]), phases.index(row["phase"])
        added[y, x] = row["added"]
        axes.text(x, y, _word(row), ha="center", va="center", fontsize=7, color=style.INK)
    shown = axes.imshow(added, aspect="auto", cmap="YlOrRd", vmin=0.0, vmax=200.0, alpha=0.7)
    axes.set_xticks(range(len(phases)), phases, fontsize=8)
    axes.set_yticks(range(len(faults)), faults, fontsize=8)
    figure.colorbar(shown, ax=axes, label="force added after the fault, N")
    figure.subplots_adjust(left=0.27, right=1.0, top=0.97, bottom=0.08)
    return figure


def _word(row: dict[str, Any]) -> str:
    """Return the time until the tool let go, or what it did instead."""
    if not row["message"]:
        return "goes on"
    if row["released"] is None:
        return "stays"
    return f"{row['released']:.2f} s" if row["released"] else "free"
