"""What the interactive page of a codec shows: one figure for each choice of its readers."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from elastocal.codec import AXES, CodecData, SpringObservability, Verdicts
from elastocal.report.box_panel import reads_better_in_decades, round_values
from elastocal.report.boxes import Boxes
from elastocal.report.codec_chart import PANELS, error_boxes
from elastocal.report.compliance_chart import SpringBoxes, only_in_combination, spring_boxes, top_of
from elastocal.report.looks import Look, looks_of
from elastocal.report.screen_boxes import Trace, box_traces, layout_of

View = dict[str, Any]
"""A figure as plotly reads it, with its name and what it shows in words."""
AXIS_NAMES = {
    "norm": "Norm",
    "x": "Along x of base",
    "y": "Along y of base",
    "z": "Along z of base",
}


def error_views(data: CodecData, verdicts: Verdicts) -> list[View]:
    """Return a figure of mean and largest errors for the norm and each axis.

    Raises
    ------
    CodecError
        If a variant has no error to draw, by its name.
    """
    order = sorted(AXES, key=list(AXIS_NAMES).index)
    return [_error_view(data, verdicts, axis) for axis in order]


def compliance_views(data: CodecData, seen: Sequence[SpringObservability]) -> list[View]:
    """Return a figure for each spring.

    Raises
    ------
    CodecError
        If a variant has no compliance to draw, by its name.
    """
    looks = looks_of([each.name for each in data.variants])
    return [
        _compliance_view(each, looks, int(data.n_train[-1])) for each in spring_boxes(data, seen)
    ]


def _error_view(data: CodecData, verdicts: Verdicts, axis: str) -> View:
    looks = looks_of([each.name for each in data.variants])
    traces: list[Trace] = []
    panels = []
    for k, (which, title) in enumerate(PANELS.items()):
        found = error_boxes(data, which, axis)
        for number, (boxes, look) in enumerate(zip(found, looks, strict=True)):
            traces += box_traces(boxes, look, number, title.lower(), "mm", "2" if k else "")
        panels.append({"title": {"text": f"{title} in mm"}, **_scale(found)})
    layout = layout_of(int(data.n_train[-1]), panels)
    if axis == "norm":
        traces += _saturation_traces(verdicts, looks, layout)
    return {
        "name": AXIS_NAMES[axis],
        "told": "Box plots of mean and maximum error at held-out poses over the number of training"
        f" poses ({AXIS_NAMES[axis].lower()}); the table below has the medians of the norm",
        "figure": {"data": traces, "layout": layout},
    }


def _saturation_traces(
    verdicts: Verdicts, looks: Sequence[Look], layout: dict[str, Any]
) -> list[Trace]:
    """Return a dashed line in the upper panel where each variant has saturated."""
    low, high = layout["yaxis"]["range"]
    ends = [10.0**low, 10.0**high] if layout["yaxis"]["type"] == "log" else [low, high]
    return [
        {
            "type": "scatter", "mode": "lines", "x": [each.n_train + look.place] * 2, "y": ends,
            "line": {"color": look.colour, "width": 1.2, "dash": "dash"}, "hoverinfo": "skip",
            "meta": number, "showlegend": False, "xaxis": "x", "yaxis": "y",
        }
        for number, (each, look) in enumerate(zip(verdicts.saturation, looks, strict=True))
    ]  # fmt: skip


def _compliance_view(each: SpringBoxes, looks: Sequence[Look], last: int) -> View:
    traces: list[Trace] = []
    for number, look in enumerate(looks):
        if look.name in each.boxes:
            boxes, hollow = each.boxes[look.name], each.hollow[look.name]
            traces += box_traces(boxes, look, number, "", each.unit, hollow=hollow)
    low = min(boxes.extent()[0] for boxes in each.boxes.values())
    top = top_of(list(each.boxes.values()), last)
    margin = 0.05 * (top - min(low, 0.0)) or 1.0
    bottom = low - margin if low <= 0.0 else 0.0
    scale = {"type": "linear", "range": [bottom, top + margin]}
    mark = only_in_combination(each)
    return {
        "name": f"{each.spring} ({mark})" if mark else each.spring,
        "told": f"Box plots of the compliance of {each.spring} over the number of training poses",
        "figure": {
            "data": traces,
            "layout": layout_of(last, [{"title": {"text": each.unit}, **scale}]),
        },
    }


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
