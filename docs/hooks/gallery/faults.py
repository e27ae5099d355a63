"""What every fault does in every phase of a press, drawn from `fault_matrix.json`.

``python tests/support/walk_faults.py docs/hooks/gallery/fault_matrix.json`` walks the matrix.
"""

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from elastocal.report.plots import new_figure, style, write_figure

WALKED = Path(__file__).with_name("fault_matrix.json")
_LEAST_FORCE = 1.0
"""Force added that is written into a cell, in N."""


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
    time = np.full((len(faults), len(phases)), np.nan)
    for row in rows:
        y, x = faults.index(row["fault"]), phases.index(row["phase"])
        word, colour = _said(row)
        if colour is None:
            time[y, x] = row["released"]
        else:
            axes.add_patch(Rectangle((x - 0.5, y - 0.5), 1.0, 1.0, color=colour, linewidth=0.0))
        added = f" +{row['added']:.0f} N" if row["added"] >= _LEAST_FORCE else ""
        axes.text(x, y, word + added, ha="center", va="center", fontsize=7, color=style.INK)
    shown = axes.imshow(time, aspect="auto", cmap="Blues", vmin=0.0, vmax=8.0)
    axes.set_xticks(range(len(phases)), phases, fontsize=8)
    axes.set_yticks(range(len(faults)), faults, fontsize=8)
    figure.colorbar(shown, ax=axes, label="time until the tool let go, s")
    figure.subplots_adjust(left=0.27, right=1.0, top=0.97, bottom=0.08)
    return figure


def _said(row: dict[str, Any]) -> tuple[str, str | None]:
    """Return the time until the tool let go, or what it did instead, and the colour of that."""
    if not row["message"]:
        return "goes on", "#eeeeee"
    if row["released"] is None:
        return "stays", "#f6cf9a"
    return (f"{row['released']:.2f} s", None) if row["released"] else ("free", "#ffffff")
