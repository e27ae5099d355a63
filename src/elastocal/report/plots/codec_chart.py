"""Printed figures of errors over the number of poses: codec (paper Fig. 7, 9, 10) and study.

Mean errors above, largest errors below. Over those of a codec, its accuracy competency development
chart, a strip marks from where on each variant has saturated.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from elastocal.arrays import FloatArray, IndexArray
from elastocal.codec import CodecData, Saturation, Variant, Verdicts
from elastocal.codec.study import (
    SampleResult,
    StudyDesign,
    StudySummary,
    condition_name,
    micrometres,
    value_text,
)
from elastocal.report.plots import style
from elastocal.report.plots._box_plots import (
    Boxes,
    draw_error_panel,
    draw_legend,
    label_sizes,
    legend_handles,
    legend_height,
    make_boxes,
)
from elastocal.report.plots.style import VariantStyle, variant_styles
from elastocal.results import brief_repr
from elastocal.units import quantity
from elastocal.wording import counted, phrase

ERROR_PANELS = {"mean": "Mean error", "max": "Maximum error"}
_MM = 1e3
_LEFT, _RIGHT, _BOTTOM, _GAP = 0.75, 0.2, 0.95, 0.2
"""Margins of and between the panels, in inches."""
_PANEL, _ROW = 2.9, 0.34
"""Heights of a panel and of a row of the saturation strip, in inches."""
_HEADLINE, _STRIP_TITLE = 0.42, 0.22
_STUDY_FIGURE = "study.svg"
"""Name of the file in a study's folder."""
_STUDY_WIDTH, _STUDY_PANEL, _STUDY_BOTTOM, _STUDY_HEAD = 7.5, 2.6, 0.9, 0.5
"""Sizes of a study's figure, in inches."""
_HOW_TO_READ = (
    "Line: median; box: quartiles; whiskers: farthest value within 1.5 box heights; dots:"
    " single {} beyond."
)


def codec_chart(data: CodecData, verdicts: Verdicts, axis: str = "norm") -> Figure:
    """Return the chart of one axis.

    Parameters
    ----------
    data : CodecData
        The arrays.
    verdicts : Verdicts
        Where each variant has saturated, judged by the norm.
    axis : str
        ``norm``, or a component in base: ``x``, ``y``, ``z``.

    Raises
    ------
    CodecError
        If the axis is unknown, or a variant has no error to draw.
    """
    styles = variant_styles([each.name for each in data.variants])
    panels = {which: error_boxes(data, which, axis) for which in ERROR_PANELS}
    last = int(data.n_train[-1])
    across = _panel_width(last, len(styles))
    strip = _ROW * len(styles) if axis == "norm" else 0.0
    over_strip = _STRIP_TITLE + strip + _GAP if strip else 0.0
    head = _HEADLINE + legend_height(styles, across) + (0.02 if strip else 0.12)
    height = head + over_strip + 2 * _PANEL + _GAP + _BOTTOM
    figure = style.new_figure(_LEFT + across + _RIGHT, height)
    bottom = _BOTTOM
    for which in reversed(ERROR_PANELS):
        axes = figure.add_panel(_LEFT, bottom, across, _PANEL)
        label = f"{ERROR_PANELS[which]}{_of(axis)} in mm"
        draw_error_panel(axes, panels[which], styles, last, label)
        label_sizes(axes, last, across, shown=which == "max")
        bottom += _PANEL + _GAP
        if which == "max":
            axes.set_xlabel("Number of training poses")
        elif strip:
            _mark_saturation(axes, verdicts.saturation, styles)
    if strip:
        _draw_strip(figure.add_panel(_LEFT, bottom, across, strip), verdicts, styles, last)
    figure.add_title(headline(data), _LEFT)
    draw_legend(figure, styles, _LEFT, _HEADLINE - 0.02, across)
    figure.add_caption(how_to_read(data), _LEFT)
    return figure


@brief_repr
@dataclass(frozen=True, eq=False)
class ErrorCurve:
    """Mean error at verification poses of one variant over the number of training poses."""

    variant: Variant
    n_train: IndexArray
    """Shape (size,)."""
    median: FloatArray
    """Over the splits, shape (size,), in m."""
    low: FloatArray
    high: FloatArray
    """Upper quartiles."""
    saturated: int | None
    """Poses from which on more do not help; None: never."""


def error_curves(data: CodecData, saturation: Sequence[Saturation]) -> list[ErrorCurve]:
    """Return the curve of every variant of a codec that has errors."""
    curves = []
    for variant, found in zip(data.variants, saturation, strict=True):
        errors = data.errors(variant.name, "mean", "norm")
        known = np.isfinite(errors).any(axis=0)
        if known.any():
            low, median, high = np.nanquantile(errors[:, known], (0.25, 0.5, 0.75), axis=0)
            n = found.n_train if found.explains else None
            curves.append(ErrorCurve(variant, data.n_train[known], median, low, high, n))
    return curves


def pose_count_figure(curves: Sequence[ErrorCurve], tolerance: float | None) -> Figure:
    """Return the figure of the error over the number of poses, all variants in one panel.

    Parameters
    ----------
    curves : sequence of ErrorCurve
        At least one.
    tolerance : float, optional
        In m.
    """
    figure = style.new_figure(9.0, 4.4)
    axes = figure.add_panel(0.75, 0.55, 8.1, 3.2)
    styles = variant_styles([_name_of(each.variant) for each in curves])
    for curve, drawn in zip(curves, styles, strict=True):
        axes.fill_between(
            curve.n_train, _MM * curve.low, _MM * curve.high, color=drawn.colour, alpha=0.14, lw=0
        )
        axes.plot(
            curve.n_train, _MM * curve.median, color=drawn.colour, marker=drawn.marker, ms=3.2,
            lw=1.4, label=style.literal(drawn.name),
        )  # fmt: skip
        if curve.saturated is not None and curve.saturated in curve.n_train:
            at = int(np.flatnonzero(curve.n_train == curve.saturated)[0])
            axes.plot(
                [curve.saturated], [_MM * curve.median[at]], "D", ms=8, mfc="none",
                mec=drawn.colour, mew=1.6,
            )  # fmt: skip
    if tolerance is not None:
        axes.axhline(_MM * tolerance, color=style.INK, lw=1.0, ls=(0, (5, 4)))
        axes.annotate(
            phrase("tolerance"), (1.0, _MM * tolerance), (0, 3), ha="right", size=8.0,
            xycoords=("axes fraction", "data"), textcoords="offset points",
        )  # fmt: skip
    axes.set_yscale("log")
    # Less than a decade would have one label.
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 3.0, 5.0)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel(phrase("number of poses to fit"))
    axes.set_ylabel(phrase("mean error at verification poses in mm"))
    style.open_frame(axes, grid="both")
    figure.legend(
        loc="upper left", bbox_to_anchor=(0.075, 0.995), ncols=2, frameon=False, fontsize=8.5
    )
    return figure


def _name_of(variant: Variant) -> str:
    springs = PurePath(variant.springs).name
    return phrase(
        "{search}, {springs}, loads {load_cases}", search=variant.search, springs=springs,
        load_cases=variant.load_cases,
    )  # fmt: skip


def error_boxes(data: CodecData, which: str, axis: str) -> list[Boxes]:
    """Return the boxes of each variant, in mm.

    Raises
    ------
    CodecError
        If a variant has no error to draw, by its name.
    """
    return [
        make_boxes(
            _MM * data.errors(each.name, which, axis),
            f"{ERROR_PANELS[which].lower()}{_of(axis)} of variant {each.name!r}",
        )
        for each in data.variants
    ]


def _panel_width(last: int, variants: int) -> float:
    """Return the width of a panel in which every box can be seen, in inches."""
    return float(max(7.0, min(9.0, 0.5 * last), last * (0.05 + 0.07 * variants)))


def _of(axis: str) -> str:
    return "" if axis == "norm" else f" along {axis} of base"


def _mark_saturation(
    axes: Axes, found: Sequence[Saturation], styles: Sequence[VariantStyle]
) -> None:
    for each, variant in zip(found, styles, strict=True):
        axes.axvline(
            each.n_train + variant.place, color=variant.colour, lw=0.9, ls=(0, (5, 4)), zorder=1
        )


def _draw_strip(axes: Axes, verdicts: Verdicts, styles: Sequence[VariantStyle], last: int) -> None:
    """Draw a row for each variant: its saturation point, the interval, and both in words."""
    axes.set_xlim(0.5, last + 0.5)
    axes.set_ylim(len(styles), 0.0)
    axes.set_axis_off()
    axes.set_title(
        "Saturation of the mean error: median within"
        f" {100.0 * verdicts.tolerance.relative:g} % or"
        f" {quantity(verdicts.tolerance.floor, 'µm')} of the last (dashed line below)",
        loc="left", fontsize=9.0, pad=4, weight="bold",
    )  # fmt: skip
    for row, (found, variant) in enumerate(zip(verdicts.saturation, styles, strict=True)):
        y, x = row + 0.75, found.n_train + variant.place
        axes.plot([0.5, last + 0.5], [y, y], color=style.FAINT, lw=0.5, zorder=1)
        if found.low is not None and found.high is not None:
            ends = [found.low + variant.place, found.high + variant.place]
            axes.plot(ends, [y, y], color=variant.colour, lw=2.2, zorder=2, marker="|", ms=7)
        axes.plot(
            [x], [y], color=variant.colour, marker=variant.marker, ms=6.5, zorder=3, clip_on=False,
            mfc=variant.colour if found.n_train < last else style.PAPER,
        )  # fmt: skip
        words = style.literal(saturation_words(found))
        axes.text(0.5, row + 0.52, words, fontsize=8.0, va="bottom")


def saturation_words(found: Saturation) -> str:
    """Return a saturation as a caption says it."""
    if not found.explains:
        return f"{found.variant}: not saturated: leaves more than half of the deflection"
    if found.n_train == found.last:
        return f"{found.variant}: still falls at {found.last} training poses"
    between = "no interval"
    if found.low is not None and found.high is not None:
        between = f"95 % interval {found.low} to {found.high}"
    steadily = f", steadily from {found.stays}" if found.stays > found.n_train else ""
    return f"{found.variant}: from {found.n_train} training poses on{steadily} ({between})"


def headline(data: CodecData) -> str:
    """Return the title of a codec's charts."""
    poses, splits = counted(len(data.contact), "pose"), counted(len(data.seed_pose), "split")
    return f"{data.robot or 'Robot'}: error at verification poses, {poses}, {splits}"


def how_to_read(data: CodecData) -> str:
    """Return the explanation of boxes, in two lines."""
    sets, size = data.verification.shape
    return (
        f"Each box: {counted(sets, 'verification set')} of {counted(size, 'held-out pose')} under"
        f" load cases {', '.join(data.load_cases)}.\n{_HOW_TO_READ.format('sets')}"
    )


def write_study_figure(
    folder: Path, settings: StudyDesign, results: Sequence[SampleResult], record: StudySummary
) -> str:
    """Write the chart of a study for print; return the name of the file.

    Raises
    ------
    FileAccessError
        If it cannot be written.
    """
    title = f"{record.cell}: error at unseen poses of {record.samples} simulated arms"
    description = "; ".join(
        f"{each.name}: median mean error {micrometres(each.error_mean.median)} µm"
        for each in record.conditions
    )
    path = Path(folder) / _STUDY_FIGURE
    style.write_figure(path, lambda: study_figure(settings, results, record), title, description)
    return _STUDY_FIGURE


def study_figure(
    settings: StudyDesign, results: Sequence[SampleResult], record: StudySummary
) -> Figure:
    """Return the chart: mean errors above, largest errors below, a group of boxes a pose count.

    Where only one other factor varies and the poses do not, the groups are its values.
    """
    along, groups, columns = _study_columns(settings)
    styles = variant_styles(list(columns))
    rows = len(styles) if len(styles) > 1 else 0
    across = _STUDY_WIDTH - _LEFT - 0.2
    target = None if record.target is None else _MM * record.target
    height = _STUDY_HEAD + 0.2 * rows + 2 * _STUDY_PANEL + _GAP + _STUDY_BOTTOM
    figure = style.new_figure(_STUDY_WIDTH, height)
    bottom = _STUDY_BOTTOM
    for which in reversed(ERROR_PANELS):
        axes = figure.add_panel(_LEFT, bottom, across, _STUDY_PANEL)
        label = f"{ERROR_PANELS[which]} in mm"
        boxes = [
            _study_boxes(results, pairs, len(groups), which, name)
            for name, pairs in columns.items()
        ]
        draw_error_panel(axes, boxes, styles, len(groups), label, target)
        lowest = bottom == _STUDY_BOTTOM
        axes.set_xticks(range(1, len(groups) + 1), groups if lowest else [""] * len(groups))
        if lowest:
            poses = along == "poses"
            axes.set_xlabel("Number of calibration poses" if poses else along.replace("_", " "))
        bottom += _STUDY_PANEL + _GAP
    _draw_study_frame(figure, record)
    if rows:
        figure.legend(
            handles=legend_handles(styles), loc="upper left", frameon=False, fontsize=9.0,
            bbox_to_anchor=(_LEFT / _STUDY_WIDTH, 1.0 - 0.35 / height), borderaxespad=0.0,
        )  # fmt: skip
    return figure


def _study_columns(
    settings: StudyDesign,
) -> tuple[str, list[str], dict[str, list[tuple[int, int]]]]:
    """Return the factor along the axis, its values, and the columns of each name beside another.

    A column is the number of a condition and that of its group.
    """
    varied = settings.varied or ("poses",)
    along = "poses" if "poses" in varied else varied[0]
    others = [key for key in varied if key != along]
    groups = list(dict.fromkeys(each.value(along) for each in settings.conditions))
    if along == "poses":
        groups.sort()
    columns: dict[str, list[tuple[int, int]]] = {}
    for number, condition in enumerate(settings.conditions):
        name = condition_name(others, condition) if others else "all"
        columns.setdefault(name, []).append((number, groups.index(condition.value(along))))
    return along, [value_text(each) for each in groups], columns


def _study_boxes(
    results: Sequence[SampleResult],
    columns: Sequence[tuple[int, int]],
    count: int,
    which: str,
    name: str,
) -> Boxes:
    values = np.full((len(results), count), np.nan)
    for number, group in columns:
        errors = [getattr(each.outcomes[number], f"error_{which}") for each in results]
        values[:, group] = errors
    return make_boxes(_MM * values, f"{ERROR_PANELS[which]} in mm of {name}")


def _draw_study_frame(figure: style.Page, record: StudySummary) -> None:
    title = f"{record.cell}: error at unseen poses, {record.samples} simulated arms"
    figure.add_title(title, _LEFT)
    target = "" if record.target is None else f" Dashed: target, {_MM * record.target:g} mm."
    figure.add_caption(
        f"Each box: {record.samples} arms, {record.verification} poses under"
        f" {', '.join(record.load_cases)}.{target}\n{_HOW_TO_READ.format('arms')}",
        _LEFT,
    )
