"""Do indices foretell accuracy: rank correlations, and how each index grows (paper 4.2.3)."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from elastocal.arrays import FloatArray
from elastocal.codec import INDICES, CodecData, Correlation, IndexValues
from elastocal.errors import CodecError
from elastocal.report.plots import style
from elastocal.report.plots._box_plots import (
    ROW,
    draw_legend,
    label_sizes,
    legend_height,
    reads_better_in_decades,
)
from elastocal.report.plots.printing import literal, new_figure
from elastocal.report.plots.style import VariantStyle, variant_styles
from elastocal.wording import counted


@dataclass(frozen=True)
class _IndexName:
    """Title of an index, and how its values are shown."""

    title: str
    unit: str
    factor: float
    """From the value of the criterion to what is shown."""
    more_is_better: bool = True
    """Whether more of the value shown is better."""

    def shown(self, values: FloatArray) -> FloatArray:
        """Return values as they are shown."""
        return np.asarray(self.factor * values)


INDEX_NAMES: dict[str, _IndexName] = {
    "o1": _IndexName("O1", "", 1.0),
    "o2": _IndexName("O2", "", 1.0),
    "o3": _IndexName("O3", "", 1.0),
    "o4": _IndexName("O4", "", 1.0),
    "o5": _IndexName("O5", "", 1.0),
    "d": _IndexName("D", "", 1.0),
    "a": _IndexName("A (variance)", "", -1.0, more_is_better=False),
    "e": _IndexName("E", "", 1.0),
    "i": _IndexName("I (variance)", "", -1.0, more_is_better=False),
    "covering_radius": _IndexName("Covering radius", "mm", 1e3, more_is_better=False),
}
"""Criteria A and I are minus a variance; the variance is shown."""

KIND_TITLES = {
    "growth": "All sizes of a split",
    "size": "Equal size",
    "size_and_split": "Equal size, beyond its split",
}
"""Titles of the comparisons that correlations are made over."""


_LEFT, _RIGHT, _HEAD, _FOOT = 1.25, 0.2, 0.98, 1.05
_FOREST, _GAP = 2.65, 0.25
"""Width of a panel of correlations and room between two, in inches."""
_COLUMNS, _SMALL, _SIDE, _OVER = 5, 1.25, 0.48, 0.42
"""Panels of an index: columns, height, and room at their left and above them, in inches."""
_BETWEEN = 0.75


def index_chart(
    data: CodecData, indices: Sequence[IndexValues], correlations: Sequence[Correlation]
) -> Figure:
    """Return one page: correlations with the mean error above, growth of the indices below.

    Parameters
    ----------
    data : CodecData
        The arrays.
    indices : sequence of IndexValues
        Of each variant, in order.
    correlations : sequence of Correlation
        Of all variants.

    Raises
    ------
    CodecError
        If a variant has no indices.
    """
    names = [each.name for each in data.variants]
    check_indices(names, [each.variant for each in indices])
    check_indices(names, [each.variant for each in correlations])
    styles = variant_styles(names)
    forest = len(INDICES) * max(0.26, 0.11 * len(styles) + 0.06)
    rows = -(-len(INDICES) // _COLUMNS)
    width = _LEFT + len(KIND_TITLES) * (_FOREST + _GAP) + _RIGHT
    head = _HEAD + legend_height(styles, width - 0.3 - _RIGHT) - ROW
    height = head + forest + _BETWEEN + rows * (_OVER + _SMALL) + _FOOT
    figure = new_figure(width, height)
    for column, kind in enumerate(KIND_TITLES):
        left = _LEFT + column * (_FOREST + _GAP)
        bottom = (height - head - forest) / height
        axes = figure.add_axes((left / width, bottom, _FOREST / width, forest / height))
        _draw_forest(axes, [each for each in correlations if each.kind == kind], styles)
        axes.tick_params(axis="y", labelleft=not column)
        axes.set_title(KIND_TITLES[kind], fontsize=9.0, weight="bold", pad=5)
    start = height - head - forest - _BETWEEN
    across = (width - _RIGHT - _COLUMNS * _SIDE - 0.1) / _COLUMNS
    for number, name in enumerate(INDICES):
        row, column = divmod(number, _COLUMNS)
        left = 0.1 + _SIDE + column * (across + _SIDE)
        bottom = start - row * (_OVER + _SMALL) - _OVER - _SMALL
        axes = figure.add_axes((left / width, bottom / height, across / width, _SMALL / height))
        _draw_growth(axes, data, indices, name, styles)
        label_sizes(axes, int(data.n_train[-1]), across, shown=row == rows - 1)
    _draw_frame(figure, data, styles, start)
    return figure


def check_indices(variants: Iterable[str], known: Iterable[str]) -> None:
    """Refuse a variant of which no indices are known.

    Raises
    ------
    CodecError
        By its name.
    """
    lacking = [name for name in variants if name not in set(known)]
    if lacking:
        raise CodecError(f"variant {lacking[0]!r} has no indices: there is nothing to draw")


def _draw_forest(axes: Axes, found: Sequence[Correlation], styles: Sequence[VariantStyle]) -> None:
    """Draw a row an index and a mark a variant: correlation with the mean error, interval."""
    axes.axvline(0.0, color=style.MUTED, lw=0.8)
    for row in range(0, len(INDICES), 2):
        axes.axhspan(row - 0.5, row + 0.5, color="#f4f4f1", lw=0, zorder=0)
    for variant in styles:
        of = {e.index: e for e in found if e.variant == variant.name and e.error == "mean"}
        y = np.arange(len(INDICES)) + variant.place
        rows = [of[name] for name in INDICES]
        for at, each in zip(y, rows, strict=True):
            ends = np.array([each.low, each.high], dtype=float)  # NaN where none is known
            axes.plot(ends, [at, at], color=variant.colour, lw=1.1)
        values = np.array([each.correlation for each in rows], dtype=float)
        axes.plot(
            values, y, ls="none", color=variant.colour, marker=variant.marker, ms=4.5,
            mfc=variant.fill,
        )  # fmt: skip
    axes.set_xlim(-1.02, 1.02)
    axes.set_ylim(len(INDICES) - 0.5, -0.5)
    axes.set_yticks(range(len(INDICES)), [INDEX_NAMES[name].title for name in INDICES])
    axes.tick_params(length=0)
    axes.set_xticks([-1.0, -0.5, 0.0, 0.5, 1.0], ["−1", "−0.5", "0", "0.5", "1"])
    axes.grid(axis="x", color="#dcdcd8", lw=0.5)
    axes.set_axisbelow(True)
    axes.spines[["top", "right", "left"]].set_visible(False)


def _draw_growth(
    axes: Axes,
    data: CodecData,
    indices: Sequence[IndexValues],
    name: str,
    styles: Sequence[VariantStyle],
) -> None:
    """Draw median and quartiles of an index over the number of training poses."""
    shown, curves = INDEX_NAMES[name], []
    for each, variant in zip(indices, styles, strict=True):
        low, middle, high = np.percentile(shown.shown(each.values[name]), (25, 50, 75), axis=0)
        axes.fill_between(data.n_train, low, high, color=variant.fill, lw=0, alpha=0.6)
        dashes = "--" if variant.fill == style.PAPER else "-"
        axes.plot(data.n_train, middle, color=variant.colour, lw=1.2, ls=dashes)
        curves += [low, high]
    values = np.concatenate(curves)
    if reads_better_in_decades(float(values.min()), float(values.max())):
        axes.set_yscale("log")
    better = "↑" if shown.more_is_better else "↓"
    axes.set_title(shown.title, loc="left", fontsize=7.8, weight="bold", pad=4)
    axes.set_title(f"{better} better", loc="right", fontsize=7.0, color=style.MUTED, pad=4)
    axes.set_ylabel(shown.unit, fontsize=7.0, labelpad=1)
    axes.set_xlim(0.5, data.n_train[-1] + 0.5)
    axes.tick_params(labelsize=7.0, length=2, pad=2)
    axes.tick_params(which="minor", labelleft=False, length=1)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis="y", color="#dcdcd8", lw=0.5)


def _draw_frame(
    figure: Figure, data: CodecData, styles: Sequence[VariantStyle], start: float
) -> None:
    width, height = figure.get_size_inches()
    left = 0.3 / width
    title = f"{data.robot or 'Robot'}: do indices foretell the error at held-out poses?"
    figure.text(left, 1.0 - 0.1 / height, literal(title), va="top", fontsize=11.5, weight="bold")
    draw_legend(figure, styles, 0.3, 0.42, width - 0.3 - _RIGHT)
    middle = (_LEFT + 0.5 * len(KIND_TITLES) * (_FOREST + _GAP)) / width
    figure.text(
        middle, (start + _BETWEEN - 0.24) / height,
        "Rank correlation with accuracy: +1 orders training sets as the measured mean error does,"
        " 0 tells nothing", ha="center", va="top", fontsize=8.5,
    )  # fmt: skip
    figure.text(
        left, (start - 0.02) / height, "Growth of each index over the number of training poses",
        va="top", fontsize=9.0, weight="bold",
    )  # fmt: skip
    sets, size = data.verification.shape
    figure.text(
        left, 0.1 / height,
        f"Above: {counted(sets, 'split')}, {counted(size, 'held-out pose')} each; bars: 95 %"
        " intervals, jackknife over splits, widened for the poses that splits share.\n"
        "All sizes of a split: nearly everything grows with the number of poses. Equal size: over"
        " splits at one number of training poses. Beyond its split: the same,\n"
        "after the mean rank of each split was taken off. At equal size O1 ranks as D, and O3 as"
        " E. Below: medians and quartiles over the splits.",
        va="bottom", fontsize=7.5, color=style.MUTED, linespacing=1.35,
    )  # fmt: skip
