"""Residuals of the tracker registration, pose by pose."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from elastocal.report.looks import looks_of
from elastocal.report.printed import new_figure, plain


def station_figure(stations: Sequence[dict[str, Any]]) -> Figure:
    """Return the figure: length of the residual vector at each pose, a look a station.

    Parameters
    ----------
    stations : sequence of dict
        Of the summary of a run; at least one.
    """
    figure = new_figure(9.0, 2.6)
    axes = figure.subplots()
    names = [f"{each['station']}, {len(each['poses'])} poses" for each in stations]
    for each, name, look in zip(stations, names, looks_of(names), strict=True):
        size = 1e6 * np.linalg.norm(np.array(each["residual"], dtype=float), axis=1)
        axes.vlines(each["poses"], 0.0, size, color=look.colour, lw=1.0)
        axes.scatter(
            each["poses"], size, s=18, c=look.colour, marker=look.marker, label=plain(name)
        )
    axes.set(xlabel="pose", ylabel="residual in µm")
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.22), ncols=4, frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis="y", color="#dcdcd8", lw=0.5)
    axes.set_axisbelow(True)
    figure.subplots_adjust(left=0.07, right=0.99, bottom=0.19, top=0.86)
    return figure
