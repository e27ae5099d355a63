"""Box plots of a study: the error over the number of poses, the other factors side by side."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from elastocal.arrays import FloatArray
from elastocal.codec.study import (
    SampleResult,
    StudyDesign,
    StudySummary,
    condition_name,
    value_text,
)
from elastocal.report.plots import style
from elastocal.report.plots._box_plots import (
    draw_boxes,
    finish_axes,
    make_boxes,
    reads_better_in_decades,
)
from elastocal.report.plots.printing import literal, new_figure, write_kinds
from elastocal.report.plots.style import variant_styles

_FIGURES = ("study.svg", "study.png")
"""Names of the files in a study's folder."""
_MM = 1e3
_WIDTH, _PANEL, _LEFT, _GAP, _BOTTOM, _HEAD = 7.5, 2.6, 0.75, 0.2, 0.9, 0.5
"""In inches."""
_ALONE = "all"
"""Name where nothing stands beside another."""
_PANELS = {"error_max": "Maximum error in mm", "error_mean": "Mean error in mm"}


def write_study_figures(
    folder: Path, settings: StudyDesign, results: Sequence[SampleResult], record: StudySummary
) -> list[str]:
    """Write the chart of a study for print; return the names of the files.

    Raises
    ------
    FileAccessError
        If a file cannot be value_text.
    """
    title = f"{record.cell}: error at unseen poses of {record.samples} simulated arms"
    description = "; ".join(
        f"{each.name}: median mean error {_MM * each.error_mean.median:.4f} mm"
        for each in record.conditions
    )
    places = [Path(folder) / name for name in _FIGURES]
    write_kinds(places, lambda: study_figure(settings, results, record), title, description)
    return list(_FIGURES)


def study_figure(
    settings: StudyDesign, results: Sequence[SampleResult], record: StudySummary
) -> Figure:
    """Return the chart: mean errors above, largest errors below, a group of boxes a pose count.

    Where only one other factor varies and the poses do not, the groups are its values.
    """
    along, groups, beside, values = _grouped(settings, results)
    styles = variant_styles(beside)
    rows = len(beside) if len(beside) > 1 else 0
    head = _HEAD + 0.2 * rows
    height = head + 2 * _PANEL + _GAP + _BOTTOM
    figure = new_figure(_WIDTH, height)
    bottom = _BOTTOM
    for error, label in _PANELS.items():
        box = (_LEFT / _WIDTH, bottom / height, (_WIDTH - _LEFT - 0.2) / _WIDTH, _PANEL / height)
        axes = figure.add_axes(box)
        boxes = [make_boxes(_MM * each, f"{label} of {name}") for name, each in
                 zip(beside, values[error], strict=True)]  # fmt: skip
        low, high = np.array([each.extent() for each in boxes]).T
        log = reads_better_in_decades(float(low.min()), float(high.max()))
        for each, variant in zip(boxes, styles, strict=True):
            draw_boxes(axes, each, variant)
        finish_axes(axes, len(groups), float(low.min()), float(high.max()), log)
        axes.set_ylabel(f"{label} (log scale)" if log else label)
        _label_groups(axes, along, groups, shown=bottom == _BOTTOM)
        if record.target is not None:
            axes.axhline(_MM * record.target, color=style.INK, lw=0.9, ls=(0, (5, 4)), zorder=1)
        bottom += _PANEL + _GAP
    _draw_frame(figure, record, height)
    if rows:
        handles = [Patch(fc=each.fill, ec=each.colour, label=literal(each.name)) for each in styles]
        figure.legend(
            handles=handles, loc="upper left", frameon=False, fontsize=9.0,
            bbox_to_anchor=(_LEFT / _WIDTH, 1.0 - 0.35 / height), borderaxespad=0.0,
        )  # fmt: skip
    return figure


_Values = dict[str, list[FloatArray]]
"""By error: of each name beside one another, shape (sample, group), NaN where there is none."""


def _grouped(
    settings: StudyDesign, results: Sequence[SampleResult]
) -> tuple[str, list[str], list[str], _Values]:
    """Return the factor along the axis, its values, the names beside one another, and errors."""
    varied = settings.varied or ("poses",)
    along = "poses" if "poses" in varied else varied[0]
    others = [key for key in varied if key != along]
    groups = list(dict.fromkeys(each.value(along) for each in settings.conditions))
    if along == "poses":
        groups.sort()
    names = [condition_name(others, each) if others else _ALONE for each in settings.conditions]
    beside = list(dict.fromkeys(names))
    empty = np.full((len(results), len(groups)), np.nan)
    values: _Values = {error: [empty.copy() for _ in beside] for error in _PANELS}
    for number, condition in enumerate(settings.conditions):
        column = groups.index(condition.value(along))
        for error in _PANELS:
            errors = [getattr(each.outcomes[number], error) for each in results]
            values[error][beside.index(names[number])][:, column] = errors
    return along, [value_text(each) for each in groups], beside, values


def _label_groups(axes: Axes, along: str, groups: Sequence[str], shown: bool) -> None:
    axes.set_xticks(range(1, len(groups) + 1), groups if shown else [""] * len(groups))
    if shown:
        axes.set_xlabel(
            "Number of calibration poses" if along == "poses" else along.replace("_", " ")
        )


def _draw_frame(figure: Figure, record: StudySummary, height: float) -> None:
    title = f"{record.cell}: error at unseen poses, {record.samples} simulated arms"
    figure.text(
        _LEFT / _WIDTH, 1.0 - 0.1 / height, literal(title), va="top", fontsize=11.5, weight="bold"
    )
    target = "" if record.target is None else f" Dashed: target, {_MM * record.target:g} mm."
    figure.text(
        _LEFT / _WIDTH, 0.1 / height,
        f"Each box: {record.samples} arms, {record.verification} poses under"
        f" {', '.join(record.load_cases)}.{target}\n"
        "Line: median; box: quartiles; whiskers: farthest value within 1.5 box heights; dots:"
        " single arms beyond.",
        va="bottom", fontsize=7.8, color=style.MUTED, linespacing=1.35,
    )  # fmt: skip
