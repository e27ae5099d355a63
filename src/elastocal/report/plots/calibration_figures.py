"""Printed figures of one calibration: readings, registration and springs (paper Fig. 8g, 12b)."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.elastic import Unit
from elastocal.identification import CalibratedModel
from elastocal.report.plots import style
from elastocal.report.plots.style import literal, new_figure, variant_styles
from elastocal.results import brief_repr

_WIDTH, _HEIGHT = 9.0, 4.0
_MM = 1e3
_ROW, _FOOT = 0.23, 0.75
"""Heights of a spring and of what stands below a panel, in inches."""
_CELL, _HEAD, _AXIS, _LEFT = 0.3, 0.55, 0.5, 0.9
"""In inches."""
_MANY = 45
"""Poses beyond which numbers no longer fit."""


@dataclass(frozen=True)
class SpringBar:
    """One spring in the unit that people read."""

    name: str
    unit: Unit
    value: float
    low: float
    high: float
    group: int | None
    """Number of the group of springs that it cannot be told apart from."""


@brief_repr
@dataclass(frozen=True, eq=False)
class StationResiduals:
    """Residuals of the registration of one tracker station."""

    station: str
    poses: tuple[int, ...]
    residual: FloatArray
    """Shape (pose, 3), in m."""


def displacement_figure(
    pose: IndexArray, commanded: FloatArray, residual: FloatArray, used: BoolArray
) -> Figure:
    """Return the figure.

    Parameters
    ----------
    pose : ndarray, shape (reading,)
        Label of the pose of each reading, in order.
    commanded, residual : ndarray, shape (reading,)
        Norms, in m.
    used : ndarray, shape (reading,), bool
        Whether a reading entered the fit.
    """
    figure = new_figure(_WIDTH, _HEIGHT)
    main, side = figure.subplots(1, 2, width_ratios=(6, 1), sharey=True)
    x = np.arange(len(pose))
    for number in np.unique(pose)[1::2]:
        of = np.flatnonzero(pose == number)
        main.axvspan(of[0] - 0.5, of[-1] + 0.5, color="#f4f4f1", lw=0, zorder=0)
    series = (
        ("commanded displacement of the tcp", commanded, style.VERMILLION, "^"),
        ("residual of the fit", residual, style.BLUE, "o"),
    )
    edges = np.linspace(0.0, _MM * float(max(commanded.max(), residual.max())), 40)
    for name, values, colour, marker in series:
        main.scatter(x, _MM * values, s=13, c=colour, marker=marker, lw=0, label=name, zorder=2)
        side.hist(
            _MM * values, bins=edges, orientation="horizontal", color=colour, alpha=0.75, lw=0
        )
    if not np.all(used):
        main.scatter(
            x[~used], _MM * residual[~used], s=60, facecolors="none", edgecolors=style.INK,
            marker="s", label="set aside as a blunder", zorder=3,
        )  # fmt: skip
    main.set_ylim(bottom=0.0)
    main.set_xlim(-1, len(pose))
    main.set(xlabel="reading, pose by pose", ylabel="norm in mm")
    main.legend(loc="upper center", bbox_to_anchor=(0.5, 1.13), ncols=3, frameon=False)
    side.set_xlabel("readings")
    side.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=3))
    for axes in (main, side):
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(axis="y", color="#dcdcd8", lw=0.5)
        axes.set_axisbelow(True)
    figure.subplots_adjust(left=0.07, right=0.99, bottom=0.13, top=0.9, wspace=0.05)
    return figure


def pose_grid(
    panels: Sequence[tuple[str, FloatArray]], poses: Sequence[int], cases: Sequence[str]
) -> Figure:
    """Return the figure: a panel below the other, load cases downwards, poses across.

    Parameters
    ----------
    panels : sequence of (str, ndarray)
        Title, and values of shape (pose, load_case) in mm; NaN where there is none.
    poses : sequence of int
        Their labels.
    cases : sequence of str
        Names of the load cases.
    """
    each = _HEAD + _CELL * len(cases)
    height = each * len(panels) + _AXIS
    figure = new_figure(_WIDTH, height)
    for number, (title, values) in enumerate(panels):
        bottom = height - each * (number + 1) + 0.05
        box = (
            _LEFT / _WIDTH,
            bottom / height,
            (_WIDTH - _LEFT - 0.1) / _WIDTH,
            _CELL * len(cases) / height,
        )
        axes = figure.add_axes(box)
        _draw_shades(axes, title, values, poses, cases)
        if number == len(panels) - 1:
            axes.set_xlabel("pose; a cross: no usable reading")
    return figure


def _draw_shades(
    axes: Axes, title: str, values: FloatArray, poses: Sequence[int], cases: Sequence[str]
) -> None:
    top = float(np.nanmax(values)) if np.any(np.isfinite(values)) else 1.0
    shades = matplotlib.colormaps[style.SEQUENTIAL]
    axes.imshow(values.T, cmap=shades, vmin=0.0, vmax=top or 1.0, aspect="auto")
    axes.set_title(literal(title), loc="left", fontsize=9.0, weight="bold")
    axes.set_yticks(range(len(cases)), [literal(case) for case in cases])
    step = max(1, len(poses) // 40 + (len(poses) > 40))
    axes.set_xticks(range(0, len(poses), step), [str(label) for label in poses[::step]])
    axes.tick_params(length=0, labelsize=7.5)
    axes.spines[:].set_visible(False)
    for (pose, case), value in np.ndenumerate(values):
        if not np.isfinite(value):
            axes.text(pose, case, "×", ha="center", va="center", color=style.VERMILLION)
        elif len(poses) <= _MANY:
            ink = style.INK if value > 0.55 * top else style.PAPER
            axes.text(pose, case, _brief(value), ha="center", va="center", color=ink, fontsize=6.0)


def _brief(value: float) -> str:
    """Return a number in little room.

    >>> _brief(1.234), _brief(0.0412)
    ('1.23', '.041')
    """
    return f"{value:.2f}" if value >= 1.0 else f"{value:.3f}".lstrip("0")


def spring_bars(model: CalibratedModel) -> list[SpringBar]:
    """Return the compliances of a model, each with the first group that it is mixed up in."""
    numbered = list(enumerate(model.observability.unobservable, start=1))
    groups = {term.spring: number for number, group in reversed(numbered) for term in group}
    low, high = model.interval()
    bars = []
    for k, parameter in enumerate(model.model.parameters):
        factor = parameter.unit.factor
        by_itself = model.observability.observable[k]
        bars.append(
            SpringBar(
                parameter.name,
                parameter.unit,
                factor * float(model.compliance[k]),
                factor * float(low[k]),
                factor * float(high[k]),
                None if by_itself else groups.get(parameter.name, 0),
            )
        )
    return bars


def spring_figure(springs: Sequence[SpringBar]) -> Figure:
    """Return the figure: a panel for each unit, springs downwards.

    Parameters
    ----------
    springs : sequence of SpringBar
        From `spring_bars`; not empty.
    """
    counts = Counter(bar.unit for bar in springs)
    # The unit of most springs comes first, so that a rail does not stand above the joints.
    panels = [
        (unit.shown, [bar for bar in springs if bar.unit == unit])
        for unit, _ in counts.most_common()
    ]
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
    axes.set_yticks(range(len(bars)), [literal(bar.name) for bar in bars], fontsize=8)
    axes.set_ylim(len(bars) - 0.4, -0.6)
    axes.set_xlim(-0.02 * top, 1.05 * top)
    axes.set_xlabel(f"compliance in {unit}; band: 95 % interval")
    axes.grid(axis="both", color="#e6e6e2", lw=0.5)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(length=0)


def station_figure(stations: Sequence[StationResiduals]) -> Figure:
    """Return the figure: length of the residual vector at each pose, a style a station.

    Parameters
    ----------
    stations : sequence of StationResiduals
        At least one.
    """
    figure = new_figure(9.0, 2.6)
    axes = figure.subplots()
    names = [f"{each.station}, {len(each.poses)} poses" for each in stations]
    for each, drawn in zip(stations, variant_styles(names), strict=True):
        size = 1e6 * np.linalg.norm(each.residual, axis=1)
        axes.vlines(each.poses, 0.0, size, color=drawn.colour, lw=1.0)
        axes.scatter(
            each.poses, size, s=18, c=drawn.colour, marker=drawn.marker, label=literal(drawn.name)
        )
    axes.set(xlabel="pose", ylabel="residual in µm")
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.22), ncols=4, frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis="y", color="#dcdcd8", lw=0.5)
    axes.set_axisbelow(True)
    figure.subplots_adjust(left=0.07, right=0.99, bottom=0.19, top=0.86)
    return figure
