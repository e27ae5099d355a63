"""Figures of a calibrated geometry: errors in the workspace before and after, and parameters.

Maps show every position from above and from the side, coloured by its error at poses that were left
out; before and after share one scale, so that they can be compared.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from elastocal.arrays import FloatArray
from elastocal.geometry import GeometryAccuracy, GeometryParameter, JointFunction
from elastocal.report.plots import style
from elastocal.units import in_unit
from elastocal.wording import counted, mm, phrase

_WIDTH = 10.5
_TITLE = 0.62
"""Height of a title and the description below it, in inches."""
_MAP, _LEFT, _RIGHT, _HEAD, _FOOT, _BETWEEN = 2.6, 0.75, 0.8, 0.35, 0.5, 0.75
"""Height of a map, margins, and what is between rows of maps, in inches."""
_GAPS = (0.4, 1.25)
"""Gaps after the maps of before and after, and after their bar, in inches."""
_ROW, _AXIS = 0.17, 0.62
"""Height of a parameter's line, and of what belongs to a group of them, in inches."""
_VIEWS = (
    (phrase("y in m"), 1, phrase("from above")),
    (phrase("z in m"), 2, phrase("from the side")),
)
MANY_POSITIONS = 2000
"""More positions are drawn as means over cells of the map."""
_TOP = 98.0
"""Percentile of the errors at which a scale ends."""
_GROUPS = (
    ("shift", 1e3, phrase("shifts of joints in mm")),
    ("turn", 1e3, phrase("turns of joints in mrad")),
    ("offset", 1e3, phrase("zeros of joints in mrad (mm)")),
    ("compliance", 1e6, phrase("yielding of joints in µrad/(N·m) (µm/N)")),
    ("sag", 1e6, phrase("yielding to assumed masses in µrad/(N·m) (µm/N)")),
    ("bend", 1e6, phrase("bending of bearings in µrad/(N·m)")),
    ("scale", 1e3, phrase("transmission in per mille")),
    ("gear", 1e3, phrase("gears once and twice a turn in mrad")),
)
"""Kinds of errors, the scale that they are shown in, and what they are."""


def error_maps(accuracy: GeometryAccuracy, title: str = "") -> Figure:
    """Return the maps of the errors before and after, from above and from the side.

    Before and after on one scale; what is left once more on a scale of its own.

    Parameters
    ----------
    accuracy : GeometryAccuracy
        The errors.
    title : str, optional
        Title with the description of the errors, where no page states it.
    """
    before, after = (
        in_unit(np.linalg.norm(e, axis=1), "mm") for e in (accuracy.registration, accuracy.chosen)
    )
    both, own = _scale(before), _scale(after)
    across = (_WIDTH - _LEFT - _RIGHT - sum(_GAPS)) / 3.0
    height = _HEAD + 2 * _MAP + _BETWEEN + _FOOT
    figure = style.new_figure(_WIDTH, height + (_TITLE if title else 0.0))
    if title:
        figure.add_title(title, 0.15, about=_about(accuracy))
    size = float(np.clip(1000.0 / np.sqrt(len(before)), 3.0, 30.0))
    columns = (
        (before, phrase("before"), both),
        (after, phrase("after"), both),
        (after, phrase("after, enlarged"), own),
    )
    left = _LEFT
    for column, (error, when, scale) in enumerate(columns):
        for row, (label, axis, view) in enumerate(_VIEWS):
            bottom = _FOOT + (1 - row) * (_MAP + _BETWEEN)
            axes = figure.add_panel(left, bottom, across, _MAP)
            _draw_map(axes, accuracy.place[:, [0, axis]], error, scale, size)
            axes.set_title(phrase("{when}, {view}", when=when, view=view), fontsize=9)
            axes.set_xlabel(phrase("x in m"))
            if not column:
                axes.set_ylabel(label)
        if column:
            bar = figure.add_panel(left + across + 0.1, _FOOT, 0.14, 2 * _MAP + _BETWEEN)
            figure.colorbar(
                ScalarMappable(scale, style.SEQUENTIAL), cax=bar, extend="max"
            ).set_label(phrase("Error in mm"), size=8)
        left += across + (_GAPS[column] if column < len(_GAPS) else 0.0)
    return figure


def _about(accuracy: GeometryAccuracy) -> str:
    """Return the number of positions, and the description of the errors at left-out poses."""
    norm = accuracy.axes[-1]
    return (
        f"{counted(len(accuracy.row), 'position')}, each at a pose that was left out of its fit:"
        f" {mm(norm.registration.mean)} mean error before, {mm(norm.chosen.mean)} after"
        f" ({mm(norm.registration.max)} and {mm(norm.chosen.max)} at most)"
    )


def _scale(error: FloatArray) -> Normalize:
    top = max(float(np.percentile(error, _TOP)), 1e-6)
    return Normalize(0.0, top)


def _draw_map(
    axes: Axes, place: FloatArray, error: FloatArray, scale: Normalize, size: float
) -> None:
    """Draw positions, the worst on top, so that none of them hides; of many, means of cells."""
    x, y = place.T
    if len(error) > MANY_POSITIONS:
        axes.hexbin(x, y, C=error, gridsize=40, cmap=style.SEQUENTIAL, norm=scale, mincnt=1)
        axes.set_aspect("equal", adjustable="datalim")
        style.open_frame(axes, "both")
        return
    order = np.argsort(error)
    axes.scatter(
        x[order], y[order], c=error[order], cmap=style.SEQUENTIAL, norm=scale, s=size, lw=0.5,
        edgecolors=style.MUTED,
    )  # fmt: skip
    axes.set_aspect("equal", adjustable="datalim")
    style.open_frame(axes, "both")


def parameter_figure(parameters: Sequence[GeometryParameter]) -> Figure:
    """Return the errors of the arm with their intervals, a panel a kind."""
    panels = []
    for kind, factor, label in _GROUPS:
        own = [each for each in parameters if _kind_of(each.name) == kind]
        if own:
            panels.append((own, factor, label))
    heights = [_ROW * len(own) + 0.1 for own, *_ in panels]
    figure = style.new_figure(7.0, sum(heights) + _AXIS * len(panels) + 0.15)
    top = float(figure.get_size_inches()[1]) - 0.1
    for (own, factor, label), height in zip(panels, heights, strict=True):
        axes = figure.add_panel(1.9, top - height, 4.9, height)
        _draw_parameters(axes, own, factor)
        axes.set_xlabel(label, fontsize=8)
        top -= height + _AXIS
    return figure


def _kind_of(name: str) -> str:
    """Return the kind of an error by its name.

    >>> _kind_of("joint_a2.shift_x"), _kind_of("joint_a2.sin2")
    ('shift', 'gear')
    """
    last = name.rpartition(".")[2].partition("_")[0]
    return last if last in {kind for kind, *_ in _GROUPS} else "gear"


def _draw_parameters(axes: Axes, own: Sequence[GeometryParameter], factor: float) -> None:
    for row, each in enumerate(own):
        colour = style.BLUE if each.known else style.REFUSED
        axes.plot([factor * each.low, factor * each.high], [row, row], color=colour, lw=2.0)
        fill = colour if each.known else style.PAPER
        axes.plot(factor * each.value, row, "o", ms=4.5, mfc=fill, mec=colour)
    axes.axvline(0.0, color=style.MUTED, lw=0.8)
    axes.set_yticks(range(len(own)), [style.literal(each.name) for each in own], fontsize=7)
    axes.tick_params(axis="x", labelsize=7)
    axes.set_ylim(len(own) - 0.4, -0.6)
    style.open_frame(axes, "both")


def function_figure(functions: Sequence[JointFunction]) -> Figure:
    """Return the function of each joint with its 95 % band, a panel a joint, on one scale."""
    columns, width, height = 2, 4.2, 1.35
    rows = -(-len(functions) // columns)
    figure = style.new_figure(_WIDTH, rows * (height + _AXIS) + 0.25)
    top = float(figure.get_size_inches()[1]) - 0.25
    largest = max(float(np.percentile(np.abs(each.value), _TOP)) for each in functions)
    for number, each in enumerate(functions):
        row, column = divmod(number, columns)
        left = _LEFT + column * (width + 0.75)
        axes = figure.add_panel(left, top - height - row * (height + _AXIS), width, height)
        colour = style.BLUE if each.known else style.REFUSED
        angle = in_unit(each.angle, "deg")
        axes.fill_between(angle, 1e6 * each.low, 1e6 * each.high, color=colour, alpha=0.25, lw=0.0)
        axes.plot(angle, 1e6 * each.value, color=colour, lw=1.0)
        axes.set_ylim(-1.5e6 * largest, 1.5e6 * largest)
        axes.set_title(style.literal(each.joint), fontsize=9)
        axes.set_xlabel(phrase("Joint in °"), fontsize=8)
        axes.set_ylabel("µrad", fontsize=8)
        axes.tick_params(labelsize=7)
        style.open_frame(axes, "both")
    return figure
