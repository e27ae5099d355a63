"""What every example cell reaches on every truth, drawn from `process_figures.json`."""

from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from process_tables import DEMOS, TRUTHS

from elastocal.compensation.process import PAPER
from elastocal.report.plots import new_figure, style, write_figure
from gallery.process_figures import ProcessFigures, quoted

_SPREAD = 0.3
"""Half the height that the seeds of one truth take, in rows."""


def make(folder: Path) -> dict[str, str]:
    """Make the figure; return what is told of it."""
    found = [each for each in quoted() if (each.campaign, each.springs) == ("template", "auto")]
    write_figure(folder / "demos.svg", partial(_draw, found))
    seeds = sorted({each.case.seed for each in found})
    return {
        "demos": f"Means in mm, a line a seed, {len(seeds)} seeds a truth, springs by `auto`; all"
        " of it held out: no reading of the process, or of the pose, has entered the fit"
    }


def _draw(found: list[ProcessFigures]) -> Figure:
    figure = new_figure(9.0, 3.4)
    panels = figure.subplots(1, len(DEMOS), sharey=True)
    for axes, (kind, demo) in zip(panels, DEMOS.items(), strict=True):
        _draw_cell(axes, kind, [each for each in found if each.case.kind == kind])
        axes.set_title(demo.name, fontsize=9)
        axes.set_xlabel(f"{demo.counted}, mm", fontsize=8)
    rows = [*TRUTHS, "paper"]
    panels[0].set_yticks(range(len(rows)), rows)
    panels[0].set_ylim(len(rows) - 0.5, -0.5)
    shapes = (
        ("o", style.VERMILLION, "none", "without correction (UR20: prediction)"),
        ("o", style.BLUE, style.BLUE, "with it"),
    )
    handles = [
        panels[0].plot([], [], marker, color=edge, mfc=fill, label=label)[0]
        for marker, edge, fill, label in shapes
    ]
    figure.legend(handles=handles, loc="lower center", ncols=2, fontsize=8, frameon=False)
    figure.subplots_adjust(left=0.08, right=0.99, top=0.92, bottom=0.26, wspace=0.06)
    return figure


def _draw_cell(axes: Axes, kind: str, found: list[ProcessFigures]) -> None:
    for row, truth in enumerate(TRUTHS):
        some = [each.deviations[0].mean for each in found if each.case.preset == truth]
        for place, pair in zip(_places(row, len(some)), some, strict=True):
            _draw_pair(axes, place, pair)
    if kind in PAPER:
        paper = PAPER[kind]
        _draw_pair(axes, len(TRUTHS), (1e-3 * paper.before[0], 1e-3 * paper.after[0]))
    else:
        axes.text(0.02, len(TRUTHS), "not in the paper", va="center", size=8, color=style.MUTED)
    axes.set_xlim(0.0, None)
    style.open_frame(axes, grid="x")


def _places(row: int, count: int) -> np.ndarray:
    return row + (np.linspace(-_SPREAD, _SPREAD, count) if count > 1 else np.zeros(count))


def _draw_pair(axes: Axes, place: float, pair: tuple[float, float]) -> None:
    before, after = (1e3 * each for each in pair)
    axes.plot([before, after], [place, place], color=style.FAINT, lw=1.0, zorder=1)
    axes.plot(before, place, "o", ms=5, color=style.VERMILLION, mfc="none", zorder=2)
    axes.plot(after, place, "o", ms=5, color=style.BLUE, zorder=3)
