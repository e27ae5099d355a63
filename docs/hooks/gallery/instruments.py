"""What is left of a process by each instrument, drawn from `process_figures.json`."""

from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from process_tables import INSTRUMENTS

from elastocal.report.plots import new_figure, style, write_figure
from gallery.process_figures import TEMPLATE, TYPICAL, ProcessFigures, quoted

_COLOURS = dict(zip(TEMPLATE.springs, (style.VERMILLION, style.BLUE), strict=True))
_APART = 0.16
"""Distance of the rows of two layouts from the middle of their instrument's."""
_KINDS = {"afp": "Fibre placement", "machining": "Roughing"}


def make(folder: Path) -> dict[str, str]:
    """Make the figure; return what is told of it."""
    found = [
        each
        for each in quoted()
        if each.case.preset == TYPICAL and each.campaign in INSTRUMENTS and each.case.kind in _KINDS
    ]
    kinds = [kind for kind in _KINDS if _seeds(found, kind)]
    write_figure(folder / "instruments.svg", partial(_draw, found, kinds))
    return {
        "instruments": "Mean deviation that is left at the programmed load, over that without"
        " correction: a dot a seed, a line their mean"
    }


def _seeds(found: list[ProcessFigures], kind: str) -> set[int]:
    """Return the seeds of which every instrument has figures."""
    seeds = [
        {each.case.seed for each in found if (each.case.kind, each.campaign) == (kind, name)}
        for name in INSTRUMENTS
    ]
    return set.intersection(*seeds)


def _draw(found: list[ProcessFigures], kinds: list[str]) -> Figure:
    figure = new_figure(9.0, 1.2 + 2.0 * len(kinds))
    panels = np.atleast_2d(figure.subplots(len(kinds), 2, sharey=True))
    for kind, row in zip(kinds, panels, strict=True):
        seeds = _seeds(found, kind)
        own = [each for each in found if each.case.kind == kind and each.case.seed in seeds]
        for number, axes in enumerate(row):
            _draw_measure(axes, own, number)
            axes.set_title(f"{_KINDS[kind]}, {own[0].deviations[number].name}", fontsize=9)
    for axes in panels[-1]:
        axes.set_xlabel("left of the mean deviation, %", fontsize=8)
    panels[0, 0].set_ylim(len(INSTRUMENTS) - 0.5, -0.5)
    handles = [
        panels[0, 0].plot([], [], "o", color=colour, label=f"springs {springs}")[0]
        for springs, colour in _COLOURS.items()
    ]
    figure.legend(handles=handles, loc="lower center", ncols=2, fontsize=8, frameon=False)
    bottom = 0.75 / figure.get_figheight()
    figure.subplots_adjust(left=0.2, right=0.99, top=0.92, bottom=bottom, wspace=0.06, hspace=0.4)
    return figure


def _draw_measure(axes: Axes, found: list[ProcessFigures], number: int) -> None:
    for row, name in enumerate(INSTRUMENTS):
        for springs, colour in _COLOURS.items():
            some = [
                100.0 * after / before
                for each in found
                if (each.campaign, each.springs) == (name, springs)
                for before, after in [each.deviations[number].mean]
            ]
            place = row + (_APART if springs == "auto" else -_APART)
            axes.plot(some, np.full(len(some), place), "o", ms=4, color=colour, alpha=0.6)
            mean = float(np.mean(some))
            axes.plot([mean, mean], [place - _APART, place + _APART], color=colour, lw=2.0)
    axes.set_yticks(range(len(INSTRUMENTS)), list(INSTRUMENTS.values()), fontsize=8)
    axes.set_xlim(0.0, None)
    style.open_frame(axes, grid="x")
