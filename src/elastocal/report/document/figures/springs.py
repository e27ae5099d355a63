"""Compliances with their intervals, those without a value of their own marked as such."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from elastocal.report import style
from elastocal.report.printed import new_figure, plain

_ROW, _FOOT = 0.23, 0.75
"""Heights of a spring and of what stands below a panel, in inches."""


@dataclass(frozen=True)
class SpringBar:
    """One spring in the unit that people read."""

    name: str
    value: float
    low: float
    high: float
    group: int | None
    """Number of the group of springs that it cannot be told apart from."""


def spring_figure(panels: Sequence[tuple[str, Sequence[SpringBar]]]) -> Figure:
    """Return the figure: a panel for each unit, springs downwards.

    Parameters
    ----------
    panels : sequence of (str, sequence of SpringBar)
        Unit and its springs; none is empty.
    """
    rows = [len(bars) for _, bars in panels]
    height = _ROW * sum(rows) + _FOOT * len(panels)
    figure = new_figure(9.0, height)
    bottom = height
    for (unit, bars), count in zip(panels, rows, strict=True):
        bottom -= _ROW * count + _FOOT
        box = (0.14, (bottom + _FOOT - 0.1) / height, 0.84, _ROW * count / height)
        _draw(figure.add_axes(box), unit, bars)
    return figure


def _draw(axes: Axes, unit: str, bars: Sequence[SpringBar]) -> None:
    own = [k for k, bar in enumerate(bars) if bar.group is None]
    value, low, high = (
        np.array([getattr(bar, key) for bar in bars]) for key in ("value", "low", "high")
    )
    top = (
        float(np.max(np.where([bar.group is None for bar in bars], high, value), initial=0.0))
        or 1.0
    )
    axes.hlines(own, low[own], high[own], color=style.BLUE, lw=3.5, alpha=0.45)
    axes.scatter(value[own], own, s=26, c=style.BLUE, zorder=3)
    for k, bar in enumerate(bars):
        if bar.group is not None:
            axes.scatter(
                bar.value, k, s=26, facecolors="none", edgecolors=style.REFUSED, marker="D"
            )
            left = bar.value > 0.75 * top
            axes.text(
                bar.value + (-0.015 if left else 0.015) * top, k,
                f"not by itself, group {bar.group}", ha="right" if left else "left",
                va="center", fontsize=7.5, color=style.MUTED, style="italic",
            )  # fmt: skip
    axes.set_yticks(range(len(bars)), [plain(bar.name) for bar in bars], fontsize=8)
    axes.set_ylim(len(bars) - 0.4, -0.6)
    axes.set_xlim(-0.02 * top, 1.05 * top)
    axes.set_xlabel(f"compliance in {unit}; band: 95 % interval")
    axes.grid(axis="both", color="#e6e6e2", lw=0.5)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(length=0)
