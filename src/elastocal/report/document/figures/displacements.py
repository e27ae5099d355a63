"""Commanded displacements against residual norms (paper Fig. 8g and 12b)."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.report import style
from elastocal.report.printed import new_figure

_WIDTH, _HEIGHT = 9.0, 4.0
_MM = 1e3


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
    used : ndarray, shape (reading,), bool
        Whether a reading entered the fit.
    """
    figure = new_figure(_WIDTH, _HEIGHT)
    main, side = figure.subplots(1, 2, width_ratios=(6, 1), sharey=True)
    x = np.arange(len(pose))
    for number in np.unique(pose)[1::2]:
        of = np.flatnonzero(pose == number)
        main.axvspan(of[0] - 0.5, of[-1] + 0.5, color="#f4f4f1", lw=0, zorder=0)
    series = (
        ("commanded displacement of the tcp", commanded, style.VERMILLION, "^"),
        ("residual of the fit", residual, style.BLUE, "o"),
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
            marker="s", label="set aside as a blunder", zorder=3,
        )  # fmt: skip
    main.set_ylim(bottom=0.0)
    main.set_xlim(-1, len(pose))
    main.set(xlabel="reading, pose by pose", ylabel="norm in mm")
    main.legend(loc="upper center", bbox_to_anchor=(0.5, 1.13), ncols=3, frameon=False)
    side.set_xlabel("readings")
    side.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=3))
    for axes in (main, side):
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(axis="y", color="#dcdcd8", lw=0.5)
        axes.set_axisbelow(True)
    figure.subplots_adjust(left=0.07, right=0.99, bottom=0.13, top=0.9, wspace=0.05)
    return figure
