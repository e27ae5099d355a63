"""Printable map of a survey: stiffness by spin and by rail along the path, and what to choose.

Colour tells how stiff the stiffest allowed posture is; hatched cells have none. Below, the curves
of the postures as programmed and chosen, with their 95 % intervals.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from elastocal.arrays import FloatArray
from elastocal.compensation import (
    PathStations,
    PostureSurvey,
)
from elastocal.report.plots import style
from elastocal.report.plots.printing import new_figure, write_figure
from elastocal.results import brief_repr

_WIDTH, _MAP, _CURVES = 6.6, 2.3, 2.3
"""In inches: of the figure, height of a map and of the curves."""
_HEAD, _FOOT, _BETWEEN, _LEFT, _RIGHT = 0.75, 0.6, 0.75, 0.75, 1.05
_PER_MICROMETRE = 1e-6
_COLOURS = (style.INK, style.BLUE, style.VERMILLION)
_LINES = ("-", "--", ":")
_WIDTHS = (2.6, 1.9, 1.3)
_SIZES = (10.0, 7.0, 4.0)
"""Widths of lines and sizes of single dots, in points: each shows under the next one."""
_CASING = 2.0


@brief_repr
@dataclass(frozen=True, eq=False)
class Curve:
    """One choice of postures along the path."""

    name: str
    stiffness: FloatArray
    """Shape (station,), in N/m; NaN where there is no posture."""
    low: FloatArray
    high: FloatArray
    spin: FloatArray
    """Shape (station,), in rad."""
    rail: FloatArray
    """Position of the first external axis, shape (station,), in m or rad; NaN without one."""


def write_stiffness_figure(
    path: Path, title: str, stations: PathStations, survey: PostureSurvey, curves: Sequence[Curve]
) -> Path:
    """Write the figure, atomically; return its path.

    Parameters
    ----------
    path : Path
        Its suffix decides the kind: SVG, PNG or PDF.
    title : str
        Of the figure.
    stations : PathStations
        Where along the path.
    survey : PostureSurvey
        All postures there.
    curves : sequence of Curve
        Up to three choices.

    Raises
    ------
    FileAccessError
        If the suffix is another or the file cannot be written.
    """
    return write_figure(path, lambda: stiffness_figure(title, stations, survey, curves))


def stiffness_figure(
    title: str, stations: PathStations, survey: PostureSurvey, curves: Sequence[Curve]
) -> Figure:
    """Return the figure; see `write_stiffness_figure`."""
    rail = survey.grid.external.shape[1] == 1 and len(survey.grid.external) > 1
    heights = [_MAP] * (1 + rail) + [_CURVES]
    size = (_WIDTH, _HEAD + sum(heights) + _BETWEEN * (len(heights) - 1) + _FOOT)
    figure = new_figure(*size)
    figure.text(0.5, 1.0 - 0.1 / size[1], title.replace("$", r"\$"), ha="center", va="top", size=11)
    boxes = _boxes(size, heights)
    axes = [figure.add_axes(box) for box in boxes]
    along = _along(stations)
    degrees = [np.degrees(curve.spin) for curve in curves]
    maps = [("Spin of the tool in °", np.degrees(survey.grid.spins), survey.best_by_spin, degrees)]
    if rail:
        held = [curve.rail for curve in curves]
        maps.append(("Rail in m", survey.grid.external[:, 0], survey.best_by_external, held))
    for place, box, (label, values, best, chosen) in zip(axes, boxes, maps, strict=False):
        drawn = _draw_map(place, along, values, best)
        place.set_ylabel(label)
        _mark(place, along, chosen, wrap=180.0 if place is axes[0] else np.inf)
        left, bottom, width, height = box
        bar = figure.add_axes((left + width + 0.015, bottom, 0.02, height))
        figure.colorbar(drawn, cax=bar).set_label("Stiffest allowed posture in N/µm", size=8)
    axes[0].set_yticks(range(0, 361, 90))
    low, *_, high = _edges(maps[0][1]).tolist()
    axes[0].set_ylim(low, high)
    _draw_curves(axes[-1], along, curves)
    axes[-1].set_xlim(axes[0].get_xlim())
    if len(along) == 1:
        for place in axes:
            place.set_xticks(along)
    lines, names = axes[-1].get_legend_handles_labels()
    height = 1.0 - 0.32 / size[1]
    figure.legend(
        lines, names, ncol=3, frameon=False, loc="upper center", bbox_to_anchor=(0.5, height)
    )
    return figure


def _boxes(
    size: tuple[float, float], heights: list[float]
) -> list[tuple[float, float, float, float]]:
    boxes, top = [], size[1] - _HEAD
    for height in heights:
        top -= height
        width = (size[0] - _LEFT - _RIGHT) / size[0]
        boxes.append((_LEFT / size[0], top / size[1], width, height / size[1]))
        top -= _BETWEEN
    return boxes


def _draw_map(axes: Axes, along: FloatArray, values: FloatArray, best: FloatArray) -> Any:
    axes.set_facecolor(style.PAPER)
    axes.patch.set(hatch="////", edgecolor=style.FAINT)
    masked = np.ma.masked_invalid(_PER_MICROMETRE * best.T)
    axes.set_xlabel("Way along the path in mm")
    return axes.pcolormesh(
        _edges(along), _edges(values), masked, cmap=style.SEQUENTIAL, rasterized=True
    )


def _mark(axes: Axes, along: FloatArray, chosen: Sequence[FloatArray], wrap: float) -> None:
    """Draw what each choice takes over the map, on white so that it shows on every colour."""
    shown = []
    for taken in chosen:
        steps = np.abs(np.diff(taken, prepend=taken[:1]))
        # A turn over 0° is no line across the map.
        shown.append(np.where(steps > wrap, np.nan, taken))
    for taken, style_of in zip(shown, _styles(along), strict=False):
        under = {"lw": style_of["lw"] + _CASING, "ms": style_of["ms"] + _CASING}
        axes.plot(along, taken, **(style_of | under | {"color": style.PAPER, "ls": "-"}))
    for taken, style_of in zip(shown, _styles(along), strict=False):
        axes.plot(along, taken, **style_of)


def _draw_curves(axes: Axes, along: FloatArray, curves: Sequence[Curve]) -> None:
    for curve, style_of in zip(curves, _styles(along), strict=False):
        k, low, high = (_PER_MICROMETRE * each for each in (curve.stiffness, curve.low, curve.high))
        axes.fill_between(along, low, high, color=style_of["color"], alpha=0.15, lw=0)
        axes.plot(along, k, label=curve.name, **style_of)
    axes.set_xlabel("Way along the path in mm")
    axes.set_ylabel("Stiffness in N/µm")
    axes.set_ylim(bottom=0.0)
    axes.spines[["top", "right"]].set_visible(False)


def _styles(along: FloatArray) -> list[dict[str, Any]]:
    """Return how each choice is drawn; a single station is a dot."""
    marker = "o" if len(along) == 1 else None
    return [
        {
            "color": colour,
            "ls": line,
            "lw": width,
            "marker": marker,
            "ms": size,
            "clip_on": marker is None,
        }
        for colour, line, width, size in zip(_COLOURS, _LINES, _WIDTHS, _SIZES, strict=True)
    ]


def _along(stations: PathStations) -> FloatArray:
    """Return the way along the path in mm; a path that stays in one place is counted in rows."""
    way = 1e3 * stations.arc_length
    return way if way[-1] > 0.0 else np.arange(len(way), dtype=float)


def _edges(middles: FloatArray) -> FloatArray:
    """Return the borders of cells around their middles."""
    if len(middles) == 1:
        return np.array([middles[0] - 0.5, middles[0] + 0.5])
    between = 0.5 * (middles[1:] + middles[:-1])
    first, last = 2.0 * middles[0] - between[0], 2.0 * middles[-1] - between[-1]
    return np.concatenate([[first], between, [last]])
