"""Pictures of readings and registration, and what `plot` of a workflow's result shows."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import singledispatch
from typing import ParamSpec

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.compensation.offline import CorrectionFigures
from elastocal.compensation.process import SimulateProcessResult
from elastocal.dataset import Dataset
from elastocal.errors import ReportError
from elastocal.identification import CalibrateResult, Prediction
from elastocal.identification.recertification import CompareResult
from elastocal.logs import ImportedLogs
from elastocal.planning import PlanResult
from elastocal.procedure import RunSummary
from elastocal.report.plots import style
from elastocal.report.plots.spring_figures import recertification_figure, spring_bars, spring_figure
from elastocal.report.plots.style import literal, new_figure, open_frame, variant_styles
from elastocal.report.plots.timeline_figure import timeline_figure
from elastocal.results import brief_repr
from elastocal.units import in_unit
from elastocal.wording import counted, mm, phrase, springs_and_parameters

_P = ParamSpec("_P")
_MM = 1e3
_WIDTH = 7.5
"""Width of a figure of a result, in inches."""
_BEFORE, _AFTER = style.VERMILLION, style.BLUE
_READINGS_WIDTH = 9.0
_CELL, _HEAD, _AXIS, _LEFT = 0.3, 0.55, 0.5, 0.9
"""Sizes of a grid of readings, in inches."""
_MANY = 45
"""Poses beyond which numbers no longer fit."""


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
    used : ndarray of bool, shape (reading,)
        Whether a reading entered the fit.
    """
    figure = new_figure(_READINGS_WIDTH, 4.0)
    main, side = figure.subplots(1, 2, width_ratios=(6, 1), sharey=True)
    x = np.arange(len(pose))
    labels = list(dict.fromkeys(pose.tolist()))
    places = [np.flatnonzero(pose == label) for label in labels]
    for of in places[1::2]:
        main.axvspan(of[0] - 0.5, of[-1] + 0.5, color=style.BAND, lw=0, zorder=0)
    series = (
        (phrase("commanded displacement of the tcp"), commanded, style.VERMILLION, "^"),
        (phrase("residual of the fit"), residual, style.BLUE, "o"),
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
            marker="s", label=phrase("set aside as a blunder"), zorder=3,
        )  # fmt: skip
    main.set_ylim(bottom=0.0)
    main.set_xlim(-1, len(pose))
    step = max(1, -(-len(labels) // 30))
    main.set_xticks([of.mean() for of in places[::step]], [str(each) for each in labels[::step]])
    main.set(xlabel=phrase("readings of each pose"), ylabel=phrase("norm in mm"))
    main.legend(loc="upper center", bbox_to_anchor=(0.5, 1.13), ncols=3, frameon=False)
    side.set_xlabel(phrase("readings"))
    side.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=3))
    for axes in (main, side):
        open_frame(axes, grid="y")
    figure.subplots_adjust(left=0.07, right=0.99, bottom=0.13, top=0.9, wspace=0.05)
    return figure


def pose_grid(
    panels: Sequence[tuple[str, FloatArray]],
    poses: Sequence[int],
    cases: Sequence[str],
    check: Sequence[str] = (),
) -> Figure:
    """Return the figure: a panel below the other, load cases downwards, poses across.

    Parameters
    ----------
    panels : sequence of (str, ndarray)
        Title, and values of shape (pose, load_case) in mm; NaN where there is none.
    poses : sequence of int
        Their labels.
    cases, check : sequence of str
        Names of the load cases, and of those kept out of every fit.
    """
    each = _HEAD + _CELL * len(cases)
    signs = {case: "–" if case in check else "×" for case in cases}
    height = each * len(panels) + _AXIS
    figure = new_figure(_READINGS_WIDTH, height)
    for number, (title, values) in enumerate(panels):
        bottom = height - each * (number + 1) + 0.05
        across = _READINGS_WIDTH - _LEFT - 0.1
        axes = figure.add_panel(_LEFT, bottom, across, _CELL * len(cases))
        _draw_shades(axes, title, values, poses, signs)
        if number == len(panels) - 1:
            axes.set_xlabel(phrase("pose; ×: no usable reading; –: kept back as a check"))
    return figure


def _draw_shades(
    axes: Axes, title: str, values: FloatArray, poses: Sequence[int], signs: dict[str, str]
) -> None:
    top = float(np.nanmax(values)) if np.any(np.isfinite(values)) else 1.0
    axes.imshow(values.T, cmap=style.SEQUENTIAL, vmin=0.0, vmax=top or 1.0, aspect="auto")
    axes.set_title(literal(title), loc="left", fontsize=9.0, weight="bold")
    axes.set_yticks(range(len(signs)), [literal(case) for case in signs])
    step = max(1, len(poses) // 40 + (len(poses) > 40))
    axes.set_xticks(range(0, len(poses), step), [str(label) for label in poses[::step]])
    axes.tick_params(length=0, labelsize=7.5)
    axes.spines[:].set_visible(False)
    for (pose, case), value in np.ndenumerate(values):
        if not np.isfinite(value):
            sign = list(signs.values())[case]
            axes.text(pose, case, sign, ha="center", va="center", color=style.VERMILLION)
        elif len(poses) <= _MANY:
            ink = style.ON_BRIGHT if value > 0.55 * top else style.ON_DARK
            # Short forms for little space: 1.23, .041.
            text = f"{value:.2f}" if value >= 1.0 else f"{value:.3f}".lstrip("0")
            axes.text(pose, case, text, ha="center", va="center", color=ink, fontsize=6.0)


def station_figure(stations: Sequence[StationResiduals]) -> Figure:
    """Return the figure: length of the residual vector at each pose, a style a station.

    Parameters
    ----------
    stations : sequence of StationResiduals
        At least one.
    """
    figure = new_figure(_READINGS_WIDTH, 2.6)
    axes = figure.subplots()
    names = [
        phrase("{station}, {poses}", station=each.station, poses=counted(len(each.poses), "pose"))
        for each in stations
    ]
    for each, drawn in zip(stations, variant_styles(names), strict=True):
        size = in_unit(np.linalg.norm(each.residual, axis=1), "µm")
        axes.vlines(each.poses, 0.0, size, color=drawn.colour, lw=1.0)
        axes.scatter(
            each.poses, size, s=18, c=drawn.colour, marker=drawn.marker, label=literal(drawn.name)
        )
    axes.set(xlabel=phrase("pose"), ylabel=phrase("residual in µm"))
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.22), ncols=4, frameon=False)
    open_frame(axes, grid="y")
    figure.subplots_adjust(left=0.07, right=0.99, bottom=0.19, top=0.86)
    return figure


def plot_result(result: object) -> Figure:
    """Return the figure of a result, or of the data that it holds.

    Raises
    ------
    ReportError
        If there is no picture of this kind of result.
    """
    return drawn(_draw, result)


def drawn(figure: Callable[_P, Figure], *arguments: _P.args, **options: _P.kwargs) -> Figure:
    """Return the drawing of a function, with the settings of print."""
    with matplotlib.rc_context(style.print_settings()):
        return figure(*arguments, **options)


@singledispatch
def _draw(result: object) -> Figure:
    raise ReportError(
        f"there is no picture of a {type(result).__name__}: pictures show calibrations,"
        " comparisons, plans, runs, logs, readings, predictions, corrections, processes, codecs,"
        " studies and stiffness"
    )


@_draw.register
def _calibration(result: CalibrateResult) -> Figure:
    calibrated, figures = result.calibrated, result.calibration
    count = springs_and_parameters(len(result.springs), len(result.compliance))
    about = "how it was calibrated is not known"
    if figures is not None:
        held = figures.held_out
        readings, poses = counted(figures.readings, "reading"), counted(figures.poses, "pose")
        about = (
            f"{readings} at {poses}, deflection {mm(figures.deflection.mean)} mean; error at"
            f" left-out poses {mm(held.mean)} mean, {mm(held.max)} max"
            f" ({counted(held.folds, 'refit')})"
        )
    settings = None if figures is None else figures.settings
    bars = spring_bars(calibrated, settings)
    return spring_figure(bars, f"{result.robot.name}: {count}", about)


@_draw.register
def _comparison(result: CompareResult) -> Figure:
    return recertification_figure(result.summary)


@_draw.register
def _readings(dataset: Dataset) -> Figure:
    """Return the measured deflections, a cell a reading."""
    readings = dataset.readings(dataset.joint_names)
    poses, cases = list(dataset.poses), list(dataset.load_cases)
    size = np.full((len(poses), len(cases)), np.nan)
    rows = [poses.index(pose) for pose in readings.pose]
    columns = [cases.index(case) for case in readings.load_case]
    size[rows, columns] = _MM * np.linalg.norm(readings.deflection, axis=1)
    title = f"Measured deflection, norm in mm: {counted(len(rows), 'usable reading')}"
    return pose_grid([(title, size)], poses, cases)


@_draw.register
def _logs(found: ImportedLogs) -> Figure:
    return timeline_figure(found, "Merged logs")


@_draw.register
def _run(summary: RunSummary) -> Figure:
    """Return the quality of the registration of a run's tracker stations."""
    stations = [
        StationResiduals(each.station, each.poses, np.array(each.residual, dtype=float))
        for each in summary.stations
    ]
    if not stations:
        raise ReportError("there is no picture of a run without a registered station")
    return station_figure(stations)


@_draw.register
def _plan(plan: PlanResult) -> Figure:
    """Return the contact points in visiting order, from above and from the side."""
    position = _MM * np.array([pose.tcp_position for pose in plan.poses])
    spans = 1.15 * np.maximum(np.ptp(position, axis=0), 0.05 * np.ptp(position) + 1.0)
    middle = 0.5 * (position.max(axis=0) + position.min(axis=0))
    # One scale for both views, at most as tall as a page.
    scale = float(min((_WIDTH - 1.0) / spans[0], 7.5 / (spans[1] + spans[2])))
    across, *heights = scale * spans
    figure = new_figure(_WIDTH, sum(heights) + 1.7)
    for axis, bottom in ((1, heights[1] + 1.1), (2, 0.6)):
        axes = figure.add_panel(0.8, bottom, across, heights[axis - 1])
        _draw_tour(axes, position[:, [0, axis]], [pose.id for pose in plan.poses])
        for set_limits, k in ((axes.set_xlim, 0), (axes.set_ylim, axis)):
            set_limits(middle[k] - 0.5 * spans[k], middle[k] + 0.5 * spans[k])
        axes.set(xlabel="x of base in mm" if axis == 2 else "", ylabel=f"{'xyz'[axis]} in mm")
    search = plan.search
    title = (
        f"{plan.cell.name}: {len(plan.poses)} poses by {search.name} in visiting order,"
        f" covering radius {_MM * search.covering_radius:.0f} mm"
    )
    about = f"chosen from {counted(plan.pool.valid, 'candidate')} that pass every check"
    figure.add_title(title, 0.8, 9.5, 0.12, about)
    return figure


def _draw_tour(axes: Axes, place: FloatArray, numbers: Sequence[int]) -> None:
    size = 8.0 if len(numbers) <= 40 else 5.0
    axes.plot(*place.T, color=style.MUTED, lw=0.7, zorder=1)
    for at, number in zip(place, numbers, strict=True):
        # Each number lies on its disc, so that of two places in one both are never mixed.
        axes.annotate(
            str(number), at, ha="center", va="center", color=style.PAPER, fontsize=0.85 * size,
            bbox={"boxstyle": "circle,pad=0.25", "fc": style.BLUE, "ec": style.PAPER, "lw": 0.5},
        )  # fmt: skip
    open_frame(axes)
    axes.tick_params(labelsize=7.5)


@_draw.register
def _prediction(prediction: Prediction) -> Figure:
    """Return each component of the deflection by row, with both 95 % intervals."""
    figure = new_figure(_WIDTH, 5.2)
    row = np.arange(1, len(prediction.deflection) + 1)
    marker = "o" if len(row) <= 60 else None
    panels = figure.subplots(3, 1, sharex=True)
    for number, (axis, axes) in enumerate(zip("xyz", panels, strict=True)):
        for low, high, alpha in (
            (prediction.measured_low, prediction.measured_high, 0.15),
            (prediction.low, prediction.high, 0.35),
        ):
            ends = _MM * low[:, number], _MM * high[:, number]
            axes.fill_between(row, *ends, color=style.BLUE, alpha=alpha, lw=0)
        value = _MM * prediction.deflection[:, number]
        axes.plot(row, value, color=style.BLUE, lw=1.1, marker=marker, ms=3.0)
        axes.axhline(0.0, color=style.FAINT, lw=0.7, zorder=0)
        axes.set_ylabel(f"along {axis} in mm")
        axes.margins(x=0.01)
        open_frame(axes)
    axes.set_xlabel("row; bands: 95 % intervals, dark of the fit, light of a measurement")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    figure.add_title(
        f"Predicted deflection of the tool centre point in base, {counted(len(row), 'row')}",
        0.1 * _WIDTH, 9.5, 0.12,
    )  # fmt: skip
    figure.align_ylabels()
    figure.subplots_adjust(left=0.1, right=0.98, bottom=0.1, top=0.92, hspace=0.12)
    return figure


@_draw.register
def _correction(found: CorrectionFigures) -> Figure:
    """Return the deviation as programmed and what is left, mean and largest, in decades."""
    lines = (
        ("as programmed", found.deviation, _BEFORE),
        ("after one first-order step", found.first_order, style.MUTED),
        ("after the correction", found.residual, _AFTER),
    )
    return _mean_to_largest(
        [(name, _MM * each.mean, _MM * each.max, colour) for name, each, colour in lines],
        f"Deviation predicted over {found.rows} rows",
        decades=True,
        about="by the model that corrects; nothing was measured along the path",
    )


@_draw.register
def _process(found: SimulateProcessResult) -> Figure:
    """Return the deviation of each line of the table, before and after correction."""
    return _mean_to_largest(
        [
            (f"{line.name}, {word}", _MM * side.mean, _MM * side.max, colour)
            for line in (*found.lines, *found.budget)
            for word, side, colour in (
                ("before", line.before, _BEFORE),
                ("after", line.after, _AFTER),
            )
        ],
        f"{found.process} in cell {found.cell}: absolute deviation before and after correction",
        decades=False,
    )


def _digits(length: float) -> str:
    """Return a length in mm with three digits; those that no tracker resolves are not told."""
    return "<0.001" if 0.0 < length < 1e-3 else f"{length:.3g}"


_Bar = tuple[str, float, float, str]
"""Name, mean and largest in mm, colour."""


def _mean_to_largest(bars: list[_Bar], title: str, decades: bool, about: str = "") -> Figure:
    """Return a line from mean to largest for each name, with both numbers beside it."""
    height = 0.34 * len(bars) + (1.3 if about else 1.15)
    figure = new_figure(_WIDTH, height)
    longest = max(len(name) for name, *_ in bars)
    left = min(0.5, 0.05 + 0.009 * longest)
    axes = figure.add_axes((left, 0.6 / height, 0.82 - left, 0.34 * len(bars) / height))
    for number, (_, mean, largest, colour) in enumerate(bars):
        axes.plot([mean, largest], [number, number], color=colour, lw=2.5, alpha=0.5)
        axes.plot([mean], [number], "o", color=colour, ms=6)
        axes.plot([largest], [number], "D", color=colour, ms=5, mfc=style.PAPER)
        axes.annotate(
            f"{_digits(mean)} / {_digits(largest)}", (1.03, number), va="center", fontsize=8,
            xycoords=("axes fraction", "data"),
        )  # fmt: skip
    axes.annotate(
        "mean / largest", (1.03, -0.5), va="bottom", fontsize=7.5, color=style.MUTED,
        xycoords=("axes fraction", "data"), annotation_clip=False,
    )  # fmt: skip
    axes.set_yticks(range(len(bars)), [literal(name) for name, *_ in bars], size=8)
    axes.set_ylim(len(bars) - 0.5, -0.5)
    if decades:
        axes.set_xscale("log")
    else:
        axes.set_xlim(left=0.0)
    axes.set_xlabel("mm; dot: mean, diamond: largest")
    axes.tick_params(axis="y", length=0)
    open_frame(axes, grid="x", colour="#e6e6e2", also="left")
    figure.add_title(title, 0.02 * _WIDTH, 9.5, 0.12, about)
    return figure
