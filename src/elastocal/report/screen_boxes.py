"""Boxes on screen: traces of one panel of an interactive chart."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from elastocal.arrays import BoolArray
from elastocal.report import style
from elastocal.report.box_panel import BAND
from elastocal.report.boxes import Boxes
from elastocal.report.looks import Look, tint

Trace = dict[str, Any]
_PALE = 0.55


def box_traces(
    boxes: Boxes,
    look: Look,
    number: int,
    what: str,
    unit: str,
    axes: str = "",
    hollow: BoolArray | None = None,
) -> list[Trace]:
    """Return the traces of one variant in one panel.

    The same numbers as in print. What a box holds stands as text in an unseen trace that has a
    point at each number of training poses; the page shows it beside the chart.

    Parameters
    ----------
    boxes : Boxes
        In the unit of the panel.
    look : Look
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
    edge, pale = look.colour, tint(look.colour, _PALE)
    traces = [
        _boxes(boxes, look, which, colour, fill) | on
        for which, colour, fill in ((~empty, edge, look.fill), (empty, pale, style.PAPER))
        if which.any()
    ]
    beyond = empty[boxes.outlier_box]
    dots = {
        "type": "scatter",
        "mode": "markers",
        "x": _listed(look.at(boxes.n)[boxes.outlier_box]),
        "y": _listed(boxes.outlier),
        "marker": {"size": 3.5, "color": [pale if each else edge for each in beyond]},
        "hoverinfo": "skip",
    }
    told = {
        "type": "scatter",
        "mode": "markers",
        "x": boxes.n.tolist(),
        "y": _listed(boxes.median),
        "marker": {"color": look.colour, "symbol": look.symbol, "opacity": 0.0},
        "text": _told(boxes, what, unit, empty),
        "hoverinfo": "none",
    }
    return [*traces, dots | on, told | on]


def layout_of(last: int, panels: Sequence[dict[str, Any]]) -> dict[str, Any]:
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


def _boxes(boxes: Boxes, look: Look, which: BoolArray, colour: str, fill: str) -> Trace:
    return {
        "type": "box",
        "x": _listed(look.at(boxes.n)[which]),
        "q1": _listed(boxes.q1[which]),
        "median": _listed(boxes.median[which]),
        "q3": _listed(boxes.q3[which]),
        "lowerfence": _listed(boxes.low[which]),
        "upperfence": _listed(boxes.high[which]),
        "width": look.width,
        "whiskerwidth": 0,
        "line": {"color": colour, "width": 1.2},
        "fillcolor": fill,
        "hoverinfo": "skip",
    }


def _told(boxes: Boxes, what: str, unit: str, empty: BoolArray) -> list[str]:
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
