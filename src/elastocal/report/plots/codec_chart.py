"""Accuracy competency development chart on paper (paper Fig. 7, 9, 10).

Mean errors above, largest errors below, over the number of training poses; a strip on top tells
from where on each variant has saturated.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from elastocal.codec import CodecData, Saturation, Verdicts
from elastocal.report.plots import style
from elastocal.report.plots._box_plots import (
    Boxes,
    draw_boxes,
    draw_legend,
    finish_axes,
    label_sizes,
    legend_height,
    make_boxes,
    reads_better_in_decades,
)
from elastocal.report.plots.printing import literal, new_figure
from elastocal.report.plots.style import VariantStyle, variant_styles
from elastocal.wording import counted

_MM = 1e3
_LEFT, _RIGHT, _BOTTOM, _GAP = 0.75, 0.2, 0.95, 0.2
"""Room about and between the panels, in inches."""
_PANEL, _ROW = 2.9, 0.34
"""Heights of a panel and of a row of the saturation strip, in inches."""
_HEADLINE, _STRIP_TITLE = 0.42, 0.22
ERROR_PANELS = {"mean": "Mean error", "max": "Maximum error"}


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
    width, height = _LEFT + across + _RIGHT, head + over_strip + 2 * _PANEL + _GAP + _BOTTOM
    figure = new_figure(width, height)
    bottom = _BOTTOM
    for which in reversed(ERROR_PANELS):
        axes = figure.add_axes((_LEFT / width, bottom / height, across / width, _PANEL / height))
        _draw_panel(axes, panels[which], styles, last, f"{ERROR_PANELS[which]}{_of(axis)} in mm")
        label_sizes(axes, last, across, shown=which == "max")
        bottom += _PANEL + _GAP
        if which == "max":
            axes.set_xlabel("Number of training poses")
        elif strip:
            _mark_saturation(axes, verdicts.saturation, styles)
    if strip:
        box = (_LEFT / width, bottom / height, across / width, strip / height)
        _draw_strip(figure.add_axes(box), verdicts, styles, last)
    _draw_frame(figure, data, styles)
    return figure


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


def _draw_panel(
    axes: Axes, boxes: Sequence[Boxes], styles: Sequence[VariantStyle], last: int, label: str
) -> None:
    extents = np.array([each.extent() for each in boxes])
    low, high = float(extents.min()), float(extents.max())
    log = reads_better_in_decades(low, high)
    for each, variant in zip(boxes, styles, strict=True):
        draw_boxes(axes, each, variant)
    finish_axes(axes, last, low, high, log)
    axes.set_ylabel(f"{label} (log scale)" if log else label)


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
        f" {100.0 * verdicts.tolerance.relative:g} % or {1e6 * verdicts.tolerance.floor:g} µm of"
        " the last (dashed line below)",
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
        axes.text(0.5, row + 0.52, literal(saturation_words(found)), fontsize=8.0, va="bottom")


def saturation_words(found: Saturation) -> str:
    """Return a saturation as a caption says it."""
    if found.n_train == found.last:
        return f"{found.variant}: still falls at {found.last} training poses"
    between = "no interval"
    if found.low is not None and found.high is not None:
        between = f"95 % interval {found.low} to {found.high}"
    steadily = f", steadily from {found.stays}" if found.stays > found.n_train else ""
    return f"{found.variant}: from {found.n_train} training poses on{steadily} ({between})"


def _draw_frame(figure: Figure, data: CodecData, styles: Sequence[VariantStyle]) -> None:
    """Draw what belongs to all panels: title, legend, how to read it."""
    width, height = figure.get_size_inches()
    figure.text(
        _LEFT / width, 1.0 - 0.1 / height, literal(headline(data)), va="top", fontsize=11.5,
        weight="bold",
    )  # fmt: skip
    draw_legend(figure, styles, _LEFT, _HEADLINE - 0.02, width - _LEFT - _RIGHT)
    figure.text(
        _LEFT / width, 0.1 / height, how_to_read(data), va="bottom", fontsize=7.8,
        color=style.MUTED, linespacing=1.35,
    )  # fmt: skip


def headline(data: CodecData) -> str:
    """Return the title of a codec's charts."""
    poses, splits = counted(len(data.contact), "pose"), counted(len(data.seed_pose), "split")
    return f"{data.robot or 'Robot'}: error at held-out poses, {poses}, {splits}"


def how_to_read(data: CodecData) -> str:
    """Return what boxes are, in two lines."""
    sets, size = data.verification.shape
    return (
        f"Each box: {counted(sets, 'verification set')} of {counted(size, 'held-out pose')} under"
        f" load cases {', '.join(data.load_cases)}.\n"
        "Line: median; box: quartiles; whiskers: farthest value within 1.5 box heights; dots:"
        " single sets beyond."
    )
