"""Charts of a codec on the screen: one Plotly figure for each choice of the reader."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from elastocal.arrays import BoolArray
from elastocal.codec import AXES, CodecData, SpringObservability, Verdicts
from elastocal.report.plots import style
from elastocal.report.plots._box_plots import BAND, Boxes, reads_better_in_decades, round_values
from elastocal.report.plots.codec_chart import ERROR_PANELS, error_boxes
from elastocal.report.plots.compliance_chart import (
    SpringBoxes,
    never_told_apart,
    scale_top,
    spring_boxes,
)
from elastocal.report.plots.style import VariantStyle, tint, variant_styles

_PlotTrace = dict[str, Any]
_PALE = 0.55
_View = dict[str, Any]
"""A figure as plotly reads it, with its name and what it shows in words."""
_AXIS_NAMES = {
    "norm": "Norm",
    "x": "Along x of base",
    "y": "Along y of base",
    "z": "Along z of base",
}


def error_views(data: CodecData, verdicts: Verdicts) -> list[_View]:
    """Return a figure of mean and largest errors for the norm and each axis.

    Raises
    ------
    CodecError
        If a variant has no error to draw, by its name.
    """
    order = sorted(AXES, key=list(_AXIS_NAMES).index)
    return [_error_view(data, verdicts, axis) for axis in order]


def _error_view(data: CodecData, verdicts: Verdicts, axis: str) -> _View:
    styles = variant_styles([each.name for each in data.variants])
    traces: list[_PlotTrace] = []
    panels = []
    for k, (which, title) in enumerate(ERROR_PANELS.items()):
        found = error_boxes(data, which, axis)
        for number, (boxes, variant) in enumerate(zip(found, styles, strict=True)):
            traces += _box_traces(boxes, variant, number, title.lower(), "mm", "2" if k else "")
        panels.append({"title": {"text": f"{title} in mm"}, **_scale(found)})
    layout = _layout(int(data.n_train[-1]), panels)
    if axis == "norm":
        traces += _saturation_traces(verdicts, styles, layout)
    return {
        "name": _AXIS_NAMES[axis],
        "told": "Box plots of mean and maximum error at held-out poses over the number of training"
        f" poses ({_AXIS_NAMES[axis].lower()}); the table below has the medians of the norm",
        "figure": {"data": traces, "layout": layout},
    }


def _saturation_traces(
    verdicts: Verdicts, styles: Sequence[VariantStyle], layout: dict[str, Any]
) -> list[_PlotTrace]:
    """Return a dashed line in the upper panel where each variant has saturated."""
    low, high = layout["yaxis"]["range"]
    ends = [10.0**low, 10.0**high] if layout["yaxis"]["type"] == "log" else [low, high]
    return [
        {
            "type": "scatter", "mode": "lines", "x": [each.n_train + variant.place] * 2, "y": ends,
            "line": {"color": variant.colour, "width": 1.2, "dash": "dash"}, "hoverinfo": "skip",
            "meta": number, "showlegend": False, "xaxis": "x", "yaxis": "y",
        }
        for number, (each, variant) in enumerate(zip(verdicts.saturation, styles, strict=True))
    ]  # fmt: skip


def _scale(found: Sequence[Boxes]) -> dict[str, Any]:
    """Return type and range of an axis on which all boxes are seen."""
    extents = np.array([each.extent() for each in found])
    low, high = float(extents.min()), float(extents.max())
    if reads_better_in_decades(low, high):
        low, high = low / 1.12, high * 1.12
        ticks = round_values(low, high)
        return {
            "type": "log",
            "range": [float(np.log10(low)), float(np.log10(high))],
            "tickvals": ticks,
            "ticktext": [f"{tick:g}" for tick in ticks],
        }
    return {"type": "linear", "range": [0.0, 1.05 * high or 1.0]}


def compliance_views(data: CodecData, seen: Sequence[SpringObservability]) -> list[_View]:
    """Return a figure for each spring.

    Raises
    ------
    CodecError
        If a variant has no compliance to draw, by its name.
    """
    styles = variant_styles([each.name for each in data.variants])
    return [
        _compliance_view(each, styles, int(data.n_train[-1])) for each in spring_boxes(data, seen)
    ]


def _compliance_view(each: SpringBoxes, styles: Sequence[VariantStyle], last: int) -> _View:
    traces: list[_PlotTrace] = []
    for number, variant in enumerate(styles):
        if variant.name in each.boxes:
            boxes, hollow = each.boxes[variant.name], each.hollow[variant.name]
            traces += _box_traces(boxes, variant, number, "", each.unit, hollow=hollow)
    low = min(boxes.extent()[0] for boxes in each.boxes.values())
    top = scale_top(list(each.boxes.values()), last)
    margin = 0.05 * (top - min(low, 0.0)) or 1.0
    bottom = low - margin if low <= 0.0 else 0.0
    scale = {"type": "linear", "range": [bottom, top + margin]}
    mark = never_told_apart(each)
    return {
        "name": f"{each.spring} ({mark})" if mark else each.spring,
        "told": f"Box plots of the compliance of {each.spring} over the number of training poses",
        "figure": {
            "data": traces,
            "layout": _layout(last, [{"title": {"text": each.unit}, **scale}]),
        },
    }


def _box_traces(
    boxes: Boxes,
    variant: VariantStyle,
    number: int,
    what: str,
    unit: str,
    axes: str = "",
    hollow: BoolArray | None = None,
) -> list[_PlotTrace]:
    """Return the traces of one variant in one panel.

    The same numbers as in print. What a box holds stands as text in an unseen trace that has a
    point at each number of training poses; the page shows it beside the chart.

    Parameters
    ----------
    boxes : Boxes
        In the unit of the panel.
    variant : VariantStyle
        Of the variant.
    number : int
        Of the variant; kept as ``meta``, by which the page switches it on and off.
    what, unit : str
        What the values are, and their unit.
    axes : str
        Which axes of the figure: empty for the first, ``2`` for the second.
    hollow : ndarray, shape (box,), optional
        Which boxes are pale outlines.
    """
    empty = np.zeros(len(boxes.n), dtype=bool) if hollow is None else hollow
    on = {"xaxis": f"x{axes}", "yaxis": f"y{axes}", "meta": number, "showlegend": False}
    edge, pale = variant.colour, tint(variant.colour, _PALE)
    traces = [
        _boxes(boxes, variant, which, colour, fill) | on
        for which, colour, fill in ((~empty, edge, variant.fill), (empty, pale, style.PAPER))
        if which.any()
    ]
    beyond = empty[boxes.outlier_box]
    dots = {
        "type": "scatter",
        "mode": "markers",
        "x": _listed(variant.at(boxes.n)[boxes.outlier_box]),
        "y": _listed(boxes.outlier),
        "marker": {"size": 3.5, "color": [pale if each else edge for each in beyond]},
        "hoverinfo": "skip",
    }
    medians = {
        "type": "scatter",
        "mode": "markers",
        "x": boxes.n.tolist(),
        "y": _listed(boxes.median),
        "marker": {"color": variant.colour, "symbol": variant.symbol, "opacity": 0.0},
        "text": _median_texts(boxes, what, unit, empty),
        "hoverinfo": "none",
    }
    return [*traces, dots | on, medians | on]


def _layout(last: int, panels: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the layout of panels one above the other that share the training poses.

    Parameters
    ----------
    last : int
        Largest number of training poses.
    panels : sequence of dict
        Settings of the y axis of each panel, the uppermost first.
    """
    height = (1.0 - 0.06 * (len(panels) - 1)) / len(panels)
    layout: dict[str, Any] = {
        "font": {"family": "system-ui, sans-serif", "size": 13, "color": style.INK},
        "paper_bgcolor": style.PAPER,
        "plot_bgcolor": style.PAPER,
        "margin": {"l": 58, "r": 10, "t": 34, "b": 48},
        "boxmode": "overlay",
        "hovermode": "x",
        "dragmode": "zoom",
        "shapes": [
            _band(n, f"y{_axis(k)}") for k in range(len(panels)) for n in range(2, last + 1, 2)
        ],
    }
    for k, panel in enumerate(panels):
        top = 1.0 - k * (height + 0.06)
        lowest = k == len(panels) - 1
        layout[f"yaxis{_axis(k)}"] = {
            "domain": [max(0.0, top - height), top],
            "anchor": f"x{_axis(k)}",
            "gridcolor": "#dcdcd8",
            "zeroline": False,
            "linecolor": style.MUTED,
            "ticks": "outside",
            "title": {"standoff": 6, **panel["title"]},
            **{key: value for key, value in panel.items() if key != "title"},
        }
        layout[f"xaxis{_axis(k)}"] = {
            "anchor": f"y{_axis(k)}",
            "range": [0.5, last + 0.5],
            "matches": "x" if k else None,
            "showgrid": False,
            "zeroline": False,
            "linecolor": style.MUTED,
            "dtick": 1,
            "tick0": 1,
            "tickangle": 0,
            "showticklabels": lowest,
            "showspikes": True,
            "spikemode": "across",
            "spikethickness": 1,
            "spikecolor": style.MUTED,
            "spikedash": "dot",
            "title": {"text": "Number of training poses" if lowest else "", "standoff": 8},
        }
    return layout


def _axis(panel: int) -> str:
    return "" if panel == 0 else str(panel + 1)


def _band(n: int, axis: str) -> dict[str, Any]:
    return {
        "type": "rect", "layer": "below", "line": {"width": 0}, "fillcolor": BAND,
        "x0": n - 0.5, "x1": n + 0.5, "xref": f"x{axis[1:]}", "y0": 0, "y1": 1,
        "yref": f"{axis} domain",
    }  # fmt: skip


def _boxes(
    boxes: Boxes, variant: VariantStyle, which: BoolArray, colour: str, fill: str
) -> _PlotTrace:
    return {
        "type": "box",
        "x": _listed(variant.at(boxes.n)[which]),
        "q1": _listed(boxes.q1[which]),
        "median": _listed(boxes.median[which]),
        "q3": _listed(boxes.q3[which]),
        "lowerfence": _listed(boxes.low[which]),
        "upperfence": _listed(boxes.high[which]),
        "width": variant.width,
        "whiskerwidth": 0,
        "line": {"color": colour, "width": 1.2},
        "fillcolor": fill,
        "hoverinfo": "skip",
    }


def _median_texts(boxes: Boxes, what: str, unit: str, empty: BoolArray) -> list[str]:
    """Return the median of each box in words, its quartiles, and how far values go."""
    lowest, highest = boxes.low.copy(), boxes.high.copy()
    np.minimum.at(lowest, boxes.outlier_box, boxes.outlier)
    np.maximum.at(highest, boxes.outlier_box, boxes.outlier)
    return [
        f"{what} {boxes.median[k]:.3g} {unit} (quartiles {boxes.q1[k]:.3g} and {boxes.q3[k]:.3g};"
        f" {boxes.count[k]} sets, {lowest[k]:.3g} to {highest[k]:.3g})"
        + (", not told apart" if empty[k] else "")
        for k in range(len(boxes.n))
    ]


def _listed(values: Any) -> list[float]:
    """Return numbers to seven digits: what is drawn needs no more, and pages stay small."""
    return [float(f"{value:.7g}") for value in values]
