"""Deviation along the process path before and after correction (paper Fig. 11 and 13)."""

from collections.abc import Sequence

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from elastocal.arrays import FloatArray
from elastocal.compensation.process import CourseDeviation
from elastocal.report.plots import style
from elastocal.report.plots.style import literal, new_figure

_WIDTH = 9.0
_MM = 1e3


def process_maps(traces: Sequence[CourseDeviation]) -> Figure:
    """Return the maps: absolute deviation on the path, before and after, in one scale.

    Parameters
    ----------
    traces : sequence of CourseDeviation
        Courses of one seed.
    """
    place = _best_plane(np.concatenate([trace.position for trace in traces]))
    sides = {
        "Without correction": _MM * np.abs(np.concatenate([t.before for t in traces])),
        "With correction": _MM * np.abs(np.concatenate([t.after for t in traces])),
    }
    low, high = place.min(axis=0), place.max(axis=0)
    across = 0.5 * (_WIDTH - 1.5)
    tall = float(np.clip(across * (high - low)[1] / max((high - low)[0], 1e-9), 1.5, 4.5))
    height = tall + 1.5
    figure = new_figure(_WIDTH, height)
    largest = max(float(each.max()) for each in sides.values())
    for number, (title, size) in enumerate(sides.items()):
        left = 0.65 + number * (across + 0.15)
        axes = figure.add_axes((left / _WIDTH, 1.1 / height, across / _WIDTH, tall / height))
        # The largest are drawn last, so that none hides.
        order = np.argsort(size, kind="stable")
        axes.scatter(
            place[order, 0], place[order, 1], c=size[order], s=4, lw=0, cmap=style.SEQUENTIAL,
            vmin=0.0, vmax=largest, rasterized=True,
        )  # fmt: skip
        axes.set_title(f"{title}: mean {size.mean():.3f}, largest {size.max():.3f} mm", fontsize=9)
        axes.set_aspect("equal", adjustable="box", anchor="C")
        axes.set_xlabel("mm")
        axes.tick_params(length=2, labelsize=7, labelleft=number == 0)
        axes.spines[["top", "right"]].set_visible(False)
    bar = figure.add_axes((0.3, 0.4 / height, 0.4, 0.12 / height))
    figure.colorbar(
        ScalarMappable(Normalize(0.0, largest), style.SEQUENTIAL), cax=bar, orientation="horizontal"
    )
    bar.set_xlabel("absolute deviation in mm", fontsize=8)
    bar.tick_params(labelsize=7, length=2)
    return figure


def course_figure(trace: CourseDeviation, tolerance: float | None) -> Figure:
    """Return the deviation along one course, with the tolerance where there is one.

    Parameters
    ----------
    trace : CourseDeviation
        The course.
    tolerance : float, optional
        In m.
    """
    figure = new_figure(_WIDTH, 2.8)
    axes = figure.subplots()
    axes.plot(trace.time, _MM * trace.before, color=style.VERMILLION, lw=1.2, ls="--",
              label="without correction")  # fmt: skip
    axes.plot(trace.time, _MM * trace.after, color=style.BLUE, lw=1.2, label="with correction")
    if tolerance is not None:
        for sign in (-1.0, 1.0):
            axes.axhline(sign * _MM * tolerance, color=style.INK, lw=0.8, ls=":")
        axes.text(float(trace.time[0]), _MM * tolerance, " tolerance", va="bottom", fontsize=7.5)
    axes.axhline(0.0, color=style.FAINT, lw=0.6, zorder=0)
    axes.set(xlabel="time in s", ylabel="deviation in mm")
    axes.set_title(literal(f"{trace.course}, seed {trace.seed}"), loc="left", fontsize=9)
    axes.legend(loc="upper right", bbox_to_anchor=(1.0, 1.16), ncols=2, frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    figure.subplots_adjust(left=0.07, right=0.99, bottom=0.17, top=0.88)
    return figure


def _best_plane(position: FloatArray) -> FloatArray:
    """Return points in the plane that fits them best, shape (point, 2), in mm from their middle.

    Parameters
    ----------
    position : ndarray, shape (point, 3)
        In m.
    """
    centred = position - position.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    # A direction and its opposite fit as well; the larger part of each points up.
    signs = np.sign(axes[np.arange(3), np.argmax(np.abs(axes), axis=1)])
    result: FloatArray = _MM * centred @ (signs[:2, None] * axes[:2]).T
    return result
