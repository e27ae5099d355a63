"""A number for each pose and load case, as shades with the numbers in them."""

from collections.abc import Sequence

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from elastocal.arrays import FloatArray
from elastocal.report import style
from elastocal.report.printed import new_figure, plain

_ROW, _WIDTH, _HEAD, _FOOT, _LEFT = 0.3, 9.0, 0.55, 0.5, 0.9
"""In inches."""
_MANY = 45
"""Poses beyond which numbers no longer fit."""


def pose_grid(
    panels: Sequence[tuple[str, FloatArray]], poses: Sequence[int], cases: Sequence[str]
) -> Figure:
    """Return the figure: a panel below the other, load cases downwards, poses across.

    Parameters
    ----------
    panels : sequence of (str, ndarray)
        Title, and values of shape (pose, load_case) in mm; NaN where there is none.
    poses : sequence of int
        Their labels.
    cases : sequence of str
        Names of the load cases.
    """
    each = _HEAD + _ROW * len(cases)
    height = each * len(panels) + _FOOT
    figure = new_figure(_WIDTH, height)
    for number, (title, values) in enumerate(panels):
        bottom = height - each * (number + 1) + 0.05
        box = (
            _LEFT / _WIDTH,
            bottom / height,
            (_WIDTH - _LEFT - 0.1) / _WIDTH,
            _ROW * len(cases) / height,
        )
        axes = figure.add_axes(box)
        _draw(axes, title, values, poses, cases)
        if number == len(panels) - 1:
            axes.set_xlabel("pose; a cross: no usable reading")
    return figure


def _draw(
    axes: Axes, title: str, values: FloatArray, poses: Sequence[int], cases: Sequence[str]
) -> None:
    top = float(np.nanmax(values)) if np.any(np.isfinite(values)) else 1.0
    shades = matplotlib.colormaps[style.SEQUENTIAL]
    axes.imshow(values.T, cmap=shades, vmin=0.0, vmax=top or 1.0, aspect="auto")
    axes.set_title(plain(title), loc="left", fontsize=9.0, weight="bold")
    axes.set_yticks(range(len(cases)), [plain(case) for case in cases])
    step = max(1, len(poses) // 40 + (len(poses) > 40))
    axes.set_xticks(range(0, len(poses), step), [str(label) for label in poses[::step]])
    axes.tick_params(length=0, labelsize=7.5)
    axes.spines[:].set_visible(False)
    for (pose, case), value in np.ndenumerate(values):
        if not np.isfinite(value):
            axes.text(pose, case, "×", ha="center", va="center", color=style.VERMILLION)
        elif len(poses) <= _MANY:
            ink = style.INK if value > 0.55 * top else style.PAPER
            axes.text(pose, case, _short(value), ha="center", va="center", color=ink, fontsize=6.0)


def _short(value: float) -> str:
    """Return a number in little room.

    >>> _short(1.234), _short(0.0412)
    ('1.23', '.041')
    """
    return f"{value:.2f}" if value >= 1.0 else f"{value:.3f}".lstrip("0")
