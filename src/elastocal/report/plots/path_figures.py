"""Figures along a process path: stiffness, and deviation before and after correction.

The map of a survey shows stiffness by spin and by rail along the path, and the choice: colour gives
the stiffness of the stiffest allowed posture, hatched cells have none; below are the curves of the
postures as programmed and chosen, with their 95 % intervals. Maps and courses of a process show the
remaining deviation (paper Fig. 11 and 13).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import QuadMesh
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from elastocal.arrays import FloatArray
from elastocal.compensation import PathStations, PostureSurvey
from elastocal.compensation.process import CourseDeviation
from elastocal.report.plots import style
from elastocal.results import brief_repr
from elastocal.units import in_unit
from elastocal.wording import phrase

_WIDTH, _MAP, _CURVES = 6.6, 2.3, 2.3
"""Width of the figure of stiffness, heights of a map and of the curves, in inches."""
_HEAD, _FOOT, _BETWEEN, _LEFT, _RIGHT = 0.75, 0.6, 0.75, 0.75, 1.05
_PER_MICROMETRE = 1e-6
_CASING = 2.0
_PROCESS_WIDTH = 9.0
_MM = 1e3


@dataclass(frozen=True)
class _Line:
    """Curve of a choice; a dot for a path with one station."""

    colour: str
    dashes: str
    width: float
    size: float
    """Size of the dot, in points."""

    def draw(
        self, axes: Axes, along: FloatArray, values: FloatArray, name: str | None = None
    ) -> None:
        """Draw a curve."""
        marker = "o" if len(along) == 1 else None
        axes.plot(
            along, values, color=self.colour, ls=self.dashes, lw=self.width, marker=marker,
            ms=self.size, clip_on=marker is None, label=name,
        )  # fmt: skip

    def casing(self) -> "_Line":
        """Return the white line that lets it show on every colour."""
        return _Line(style.PAPER, "-", self.width + _CASING, self.size + _CASING)


_LINES = (
    _Line(style.INK, "-", 2.6, 10.0),
    _Line(style.BLUE, "--", 1.9, 7.0),
    _Line(style.VERMILLION, ":", 1.3, 4.0),
)
"""Styles of up to three choices; each shows under the next one."""


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
        Title of the figure.
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
    return style.write_figure(path, lambda: stiffness_figure(title, stations, survey, curves))


def stiffness_figure(
    title: str, stations: PathStations, survey: PostureSurvey, curves: Sequence[Curve]
) -> Figure:
    """Return the figure; see `write_stiffness_figure`."""
    along = _along(stations)
    degrees = [in_unit(curve.spin, "deg") for curve in curves]
    maps = [
        ("Spin of the tool in °", in_unit(survey.grid.spins, "deg"), survey.best_by_spin, degrees)
    ]
    if survey.grid.external.shape[1] == 1 and len(survey.grid.external) > 1:
        held = [curve.rail for curve in curves]
        maps.append(("Rail in m", survey.grid.external[:, 0], survey.best_by_external, held))
    heights = [_MAP] * len(maps) + [_CURVES]
    height = _HEAD + sum(heights) + _BETWEEN * (len(heights) - 1) + _FOOT
    figure = style.new_figure(_WIDTH, height)
    figure.text(0.5, 1.0 - 0.1 / height, style.literal(title), ha="center", va="top", size=11)
    tops = [height - _HEAD - k * (_MAP + _BETWEEN) for k in range(len(heights))]
    axes = [
        figure.add_panel(_LEFT, top - tall, _WIDTH - _LEFT - _RIGHT, tall)
        for top, tall in zip(tops, heights, strict=True)
    ]
    for number, (place, (label, values, best, chosen)) in enumerate(zip(axes, maps, strict=False)):
        drawn = _draw_map(place, along, values, best)
        place.set_ylabel(label)
        _draw_choices(place, along, chosen, np.inf if number else 180.0)
        box = place.get_position()
        bar = figure.add_axes((box.x1 + 0.015, box.y0, 0.02, box.height))
        figure.colorbar(drawn, cax=bar).set_label("Stiffest allowed posture in N/µm", size=8)
    axes[0].set_yticks(range(0, 361, 90))
    low, *_, high = _edges(maps[0][1]).tolist()
    axes[0].set_ylim(low, high)
    _draw_curves(axes[-1], along, curves)
    axes[-1].set_xlim(axes[0].get_xlim())
    if len(along) == 1:
        for place in axes:
            place.set_xticks(along)
    figure.legend(
        *axes[-1].get_legend_handles_labels(), ncol=3, frameon=False, loc="upper center",
        bbox_to_anchor=(0.5, 1.0 - 0.32 / height),
    )  # fmt: skip
    return figure


def _draw_map(axes: Axes, along: FloatArray, values: FloatArray, best: FloatArray) -> QuadMesh:
    axes.set_facecolor(style.PAPER)
    axes.patch.set(hatch="////", edgecolor=style.FAINT)
    masked = np.ma.masked_invalid(_PER_MICROMETRE * best.T)
    axes.set_xlabel("Way along the path in mm")
    return axes.pcolormesh(
        _edges(along), _edges(values), masked, cmap=style.SEQUENTIAL, rasterized=True
    )


def _draw_choices(axes: Axes, along: FloatArray, chosen: Sequence[FloatArray], wrap: float) -> None:
    """Draw what each choice takes over the map; a step beyond ``wrap`` is no line across it."""
    steps = [np.abs(np.diff(taken, prepend=taken[:1])) for taken in chosen]
    shown = [
        np.where(step > wrap, np.nan, taken) for step, taken in zip(steps, chosen, strict=True)
    ]
    for taken, line in zip(shown, _LINES, strict=False):
        line.casing().draw(axes, along, taken)
    for taken, line in zip(shown, _LINES, strict=False):
        line.draw(axes, along, taken)


def _draw_curves(axes: Axes, along: FloatArray, curves: Sequence[Curve]) -> None:
    for curve, line in zip(curves, _LINES, strict=False):
        k, low, high = (_PER_MICROMETRE * each for each in (curve.stiffness, curve.low, curve.high))
        axes.fill_between(along, low, high, color=line.colour, alpha=0.15, lw=0)
        line.draw(axes, along, k, curve.name)
    axes.set_xlabel("Way along the path in mm")
    axes.set_ylabel("Stiffness in N/µm")
    axes.set_ylim(bottom=0.0)
    style.open_frame(axes)


def _along(stations: PathStations) -> FloatArray:
    """Return the distance along the path in mm; rows are counted where a path does not move."""
    way = in_unit(stations.arc_length, "mm")
    return way if way[-1] > 0.0 else np.arange(len(way), dtype=float)


def _edges(middles: FloatArray) -> FloatArray:
    """Return the borders of cells around their middles."""
    if len(middles) == 1:
        return np.array([middles[0] - 0.5, middles[0] + 0.5])
    between = 0.5 * (middles[1:] + middles[:-1])
    first, last = 2.0 * middles[0] - between[0], 2.0 * middles[-1] - between[-1]
    return np.concatenate([[first], between, [last]])


def process_maps(traces: Sequence[CourseDeviation]) -> Figure:
    """Return the maps: absolute deviation on the path, before and after, in one scale.

    Parameters
    ----------
    traces : sequence of CourseDeviation
        Courses of one seed.
    """
    place = _best_plane(np.concatenate([trace.position for trace in traces]))
    sides = {
        phrase("Without correction"): _MM * np.abs(np.concatenate([t.before for t in traces])),
        phrase("With correction"): _MM * np.abs(np.concatenate([t.after for t in traces])),
    }
    low, high = place.min(axis=0), place.max(axis=0)
    across = 0.5 * (_PROCESS_WIDTH - 1.5)
    tall = float(np.clip(across * (high - low)[1] / max((high - low)[0], 1e-9), 1.5, 4.5))
    height = tall + 1.5
    figure = style.new_figure(_PROCESS_WIDTH, height)
    largest = max(float(each.max()) for each in sides.values())
    for number, (title, size) in enumerate(sides.items()):
        axes = figure.add_panel(0.65 + number * (across + 0.15), 1.1, across, tall)
        # The largest are drawn last, so that none hides.
        order = np.argsort(size, kind="stable")
        axes.scatter(
            place[order, 0], place[order, 1], c=size[order], s=4, lw=0, cmap=style.SEQUENTIAL,
            vmin=0.0, vmax=largest, rasterized=True,
        )  # fmt: skip
        axes.set_title(f"{title}: mean {size.mean():.3f}, largest {size.max():.3f} mm", fontsize=9)
        axes.set_aspect("equal", adjustable="box", anchor="C")
        axes.set_xlabel("mm")
        axes.tick_params(length=2, labelsize=7, labelleft=number == 0)
        style.open_frame(axes)
    bar = figure.add_axes((0.3, 0.4 / height, 0.4, 0.12 / height))
    figure.colorbar(
        ScalarMappable(Normalize(0.0, largest), style.SEQUENTIAL), cax=bar, orientation="horizontal"
    )
    bar.set_xlabel(phrase("absolute deviation in mm"), fontsize=8)
    bar.tick_params(labelsize=7, length=2)
    return figure


def course_figure(trace: CourseDeviation, tolerance: float | None) -> Figure:
    """Return the deviation along one course, with the tolerance where there is one.

    Parameters
    ----------
    trace : CourseDeviation
        The course.
    tolerance : float, optional
        In m.
    """
    figure = style.new_figure(_PROCESS_WIDTH, 2.8)
    axes = figure.subplots()
    axes.plot(trace.time, _MM * trace.before, color=style.VERMILLION, lw=1.2, ls="--",
              label=phrase("without correction"))  # fmt: skip
    axes.plot(
        trace.time, _MM * trace.after, color=style.BLUE, lw=1.2, label=phrase("with correction")
    )
    if tolerance is not None:
        for sign in (-1.0, 1.0):
            axes.axhline(sign * _MM * tolerance, color=style.INK, lw=0.8, ls=":")
        middle = 0.5 * float(trace.time[0] + trace.time[-1])  # at the ends the curve crosses it
        axes.annotate(
            phrase("tolerance"), (middle, _MM * tolerance), (0, 3), ha="center", fontsize=7.5,
            textcoords="offset points",
        )  # fmt: skip
    axes.axhline(0.0, color=style.FAINT, lw=0.6, zorder=0)
    axes.set(xlabel=phrase("time in s"), ylabel=phrase("deviation in mm"))
    axes.set_title(
        style.literal(phrase("{course}, seed {seed}", course=trace.course, seed=trace.seed)),
        loc="left",
        fontsize=9,
    )
    axes.legend(loc="upper right", bbox_to_anchor=(1.0, 1.16), ncols=2, frameon=False)
    style.open_frame(axes)
    figure.subplots_adjust(left=0.07, right=0.99, bottom=0.17, top=0.88)
    return figure


def _best_plane(position: FloatArray) -> FloatArray:
    """Return points in the plane that fits them best, shape (point, 2), in mm from their middle.

    Parameters
    ----------
    position : ndarray, shape (point, 3)
        In m.
    """
    centred = position - position.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    # A direction and its opposite fit as well; the larger part of each points up.
    signs = np.sign(axes[np.arange(3), np.argmax(np.abs(axes), axis=1)])
    result: FloatArray = _MM * centred @ (signs[:2, None] * axes[:2]).T
    return result
