"""Charts of a codec on the screen: one Plotly figure for each choice of the reader."""

from collections.abc import Sequence

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.codec import AXES, CodecData, SpringObservability, Verdicts
from elastocal.report.plots import style
from elastocal.report.plots._box_plots import (
    PALE,
    Boxes,
    extent,
    reads_better_in_decades,
    round_values,
)
from elastocal.report.plots.analysis_charts import (
    SpringBoxes,
    never_told_apart,
    spring_boxes,
    spring_scale,
)
from elastocal.report.plots.codec_chart import ERROR_PANELS, error_boxes
from elastocal.report.plots.style import VariantStyle, tint, variant_styles

_Json = dict[str, object]
"""A part of a figure as plotly.js reads it."""
_MARKERS: _Json = {"type": "scatter", "mode": "markers"}
_AXIS_NAMES = {"norm": "Norm"} | {axis: f"Along {axis} of base" for axis in "xyz"}


def error_views(data: CodecData, verdicts: Verdicts) -> list[dict[str, object]]:
    """Return a figure of mean and largest errors for the norm and each axis.

    Each is as plotly.js reads it, with its name and what it shows in words.

    Raises
    ------
    CodecError
        If a variant has no error to draw, by its name.
    """
    order = sorted(AXES, key=list(_AXIS_NAMES).index)
    return [_error_view(data, verdicts, axis) for axis in order]


def _error_view(data: CodecData, verdicts: Verdicts, axis: str) -> _Json:
    styles = variant_styles([each.name for each in data.variants])
    traces: list[_Json] = []
    panels, ends = [], []
    for panel, (which, title) in enumerate(ERROR_PANELS.items()):
        found = error_boxes(data, which, axis)
        for number, (boxes, variant) in enumerate(zip(found, styles, strict=True)):
            traces += _box_traces(boxes, variant, number, title.lower(), "mm", panel)
        scale, shown = _scale(found)
        panels.append((f"{title} in mm", scale))
        ends.append(shown)
    if axis == "norm":
        traces += _saturation_traces(verdicts, styles, ends[0])
    name = _AXIS_NAMES[axis]
    words = (
        "Box plots of mean and maximum error at verification poses over the number of training"
        " poses"
        f" ({name.lower()}); the table below has the medians of the norm"
    )
    return _view(name, words, traces, int(data.n_train[-1]), panels)


def _saturation_traces(
    verdicts: Verdicts, styles: Sequence[VariantStyle], ends: list[float]
) -> list[_Json]:
    """Return a dashed line in the upper panel where each variant has saturated."""
    return [
        {
            "type": "scatter", "mode": "lines", "x": [each.n_train + variant.place] * 2, "y": ends,
            "line": {"color": variant.colour, "width": 1.2, "dash": "dash"}, "hoverinfo": "skip",
            "meta": number, "showlegend": False, "xaxis": "x", "yaxis": "y",
        }
        for number, (each, variant) in enumerate(zip(verdicts.saturation, styles, strict=True))
    ]  # fmt: skip


def _scale(found: Sequence[Boxes]) -> tuple[_Json, list[float]]:
    """Return type and range of an axis on which all boxes are seen, and its ends as values."""
    low, high = extent(found)
    if not reads_better_in_decades(low, high):
        ends = [0.0, 1.05 * high or 1.0]
        return {"type": "linear", "range": ends}, ends
    low, high = low / 1.12, high * 1.12
    ticks = round_values(low, high)
    decades = [float(np.log10(low)), float(np.log10(high))]
    text = [f"{tick:g}" for tick in ticks]
    scale: _Json = {"type": "log", "range": decades, "tickvals": ticks, "ticktext": text}
    return scale, [10.0**end for end in decades]


def compliance_views(
    data: CodecData, seen: Sequence[SpringObservability]
) -> list[dict[str, object]]:
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


def _compliance_view(each: SpringBoxes, styles: Sequence[VariantStyle], last: int) -> _Json:
    traces: list[_Json] = []
    for number, variant in enumerate(styles):
        if variant.name in each.boxes:
            traces += _box_traces(each.boxes[variant.name], variant, number, "", each.unit)
    low, top = spring_scale(each, last)
    margin = 0.05 * (top - min(low, 0.0)) or 1.0
    bottom = low - margin if low <= 0.0 else 0.0
    scale: _Json = {"type": "linear", "range": [bottom, top + margin]}
    mark = never_told_apart(each)
    name = f"{each.spring} ({mark})" if mark else each.spring
    words = f"Box plots of the compliance of {each.spring} over the number of training poses"
    view = _view(name, words, traces, last, [(each.unit, scale)])
    # The page opens with a spring that some variant determines.
    return view | {"determined": len(each.never) < len(each.boxes)}


def _view(
    name: str, words: str, traces: list[_Json], last: int, panels: Sequence[tuple[str, _Json]]
) -> _Json:
    return {
        "name": name,
        "told": words,
        "figure": {"data": traces, "layout": _layout(last, panels)},
    }


def _box_traces(
    boxes: Boxes, variant: VariantStyle, number: int, what: str, unit: str, panel: int = 0
) -> list[_Json]:
    """Return the traces of one variant in one panel.

    The same numbers as in print. The contents of a box are the text of an invisible trace with a
    point at each number of training poses; the page shows it beside the chart.

    Parameters
    ----------
    boxes : Boxes
        In the unit of the panel.
    variant : VariantStyle
        Style of the variant.
    number : int
        Number of the variant; kept as ``meta``, by which the page switches it on and off.
    what, unit : str
        What the values are, and their unit.
    panel : int
        Number of the panel, from 0 at the top.
    """
    hollow, axis = boxes.hollow, _axis(panel)
    on: _Json = {"xaxis": f"x{axis}", "yaxis": f"y{axis}", "meta": number, "showlegend": False}
    edge, pale = variant.colour, tint(variant.colour, PALE)
    traces = [
        _boxes(boxes, variant, which, colour, fill) | on
        for which, colour, fill in ((~hollow, edge, variant.fill), (hollow, pale, style.PAPER))
        if which.any()
    ]
    dots: _Json = {
        **_MARKERS,
        "x": _listed(variant.at(boxes.n)[boxes.outlier_box]),
        "y": _listed(boxes.outlier),
        "marker": {
            "size": 3.5,
            "color": [pale if each else edge for each in hollow[boxes.outlier_box]],
        },
        "hoverinfo": "skip",
    }
    medians: _Json = {
        **_MARKERS,
        "x": boxes.n.tolist(),
        "y": _listed(boxes.median),
        "marker": {"color": variant.colour, "symbol": variant.symbol, "opacity": 0.0},
        "text": _median_texts(boxes, what, unit),
        "hoverinfo": "none",
    }
    return [*traces, dots | on, medians | on]


def _boxes(boxes: Boxes, variant: VariantStyle, which: BoolArray, colour: str, fill: str) -> _Json:
    values = {
        "x": variant.at(boxes.n),
        "q1": boxes.q1,
        "median": boxes.median,
        "q3": boxes.q3,
        "lowerfence": boxes.low,
        "upperfence": boxes.high,
    }
    return {
        "type": "box",
        **{key: _listed(each[which]) for key, each in values.items()},
        "width": variant.width,
        "whiskerwidth": 0,
        "line": {"color": colour, "width": 1.2},
        "fillcolor": fill,
        "hoverinfo": "skip",
    }


def _median_texts(boxes: Boxes, what: str, unit: str) -> list[str]:
    """Return the median of each box in words, its quartiles, and how far values go."""
    lowest, highest = boxes.ends()
    return [
        f"{what} {boxes.median[k]:#.3g} {unit} (quartiles {boxes.q1[k]:#.3g} and"
        f" {boxes.q3[k]:#.3g}; {boxes.count[k]} sets, {lowest[k]:#.3g} to {highest[k]:#.3g})"
        + (", not told apart" if boxes.hollow[k] else "")
        for k in range(len(boxes.n))
    ]


def _listed(values: FloatArray) -> list[float]:
    """Return numbers to seven digits: what is drawn needs no more, and pages stay small."""
    return [float(f"{value:.7g}") for value in values]


def _layout(last: int, panels: Sequence[tuple[str, _Json]]) -> _Json:
    """Return the layout of panels one above the other that share the training poses.

    Parameters
    ----------
    last : int
        Largest number of training poses.
    panels : sequence of (str, dict)
        Title and scale of the y axis of each panel, the uppermost first.
    """
    layout: _Json = {
        "font": {"family": "system-ui, sans-serif", "size": 13, "color": style.INK},
        "paper_bgcolor": style.PAPER,
        "plot_bgcolor": style.PAPER,
        "margin": {"l": 58, "r": 10, "t": 34, "b": 48},
        "boxmode": "overlay",
        "hovermode": "x",
        "dragmode": "zoom",
        "shapes": [_band(n, _axis(k)) for k in range(len(panels)) for n in range(2, last + 1, 2)],
    }
    height = (1.0 - 0.06 * (len(panels) - 1)) / len(panels)
    line = {"zeroline": False, "linecolor": style.MUTED}
    for k, (title, scale) in enumerate(panels):
        top = 1.0 - k * (height + 0.06)
        lowest = k == len(panels) - 1
        layout[f"yaxis{_axis(k)}"] = {
            "domain": [max(0.0, top - height), top],
            "anchor": f"x{_axis(k)}",
            "gridcolor": style.GRID,
            **line,
            "ticks": "outside",
            "title": {"standoff": 6, "text": title},
            **scale,
        }
        layout[f"xaxis{_axis(k)}"] = {
            "anchor": f"y{_axis(k)}", "range": [0.5, last + 0.5], "matches": "x" if k else None,
            "showgrid": False, **line, "dtick": 1, "tick0": 1, "tickangle": 0,
            "showticklabels": lowest, "showspikes": True, "spikemode": "across",
            "spikethickness": 1, "spikecolor": style.MUTED, "spikedash": "dot",
            "title": {"text": "Number of training poses" if lowest else "", "standoff": 8},
        }  # fmt: skip
    return layout


def _axis(panel: int) -> str:
    return "" if panel == 0 else str(panel + 1)


def _band(n: int, axis: str) -> _Json:
    return {
        "type": "rect", "layer": "below", "line": {"width": 0}, "fillcolor": style.BAND,
        "x0": n - 0.5, "x1": n + 0.5, "xref": f"x{axis}", "y0": 0, "y1": 1,
        "yref": f"y{axis} domain",
    }  # fmt: skip
