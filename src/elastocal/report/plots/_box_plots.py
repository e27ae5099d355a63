"""Box plots of codecs: their numbers, the same for print and screen, and their printed panels."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from matplotlib.ticker import FixedLocator, FuncFormatter, MultipleLocator, NullFormatter

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.errors import CodecError
from elastocal.report.plots import style
from elastocal.report.plots.style import Page, VariantStyle, literal, tint

REACH = 1.5
"""Longest reach of a whisker, in heights of the box."""
_QUARTILES = (25.0, 50.0, 75.0)
"""In percent."""
_LABEL = 0.26
"""Width of the label of a number of training poses, in inches."""
PALE = 0.55
"""Part of the colour in the outline of a hollow box."""
_DECADES = 12.0
"""Largest over smallest value from which on a logarithmic scale reads better."""
ROW = 0.22
"""Height of a row, in inches."""
_CHARACTER, _SWATCH = 0.075, 0.55
"""Width of a letter, and of the symbol before a name, in inches."""


@dataclass(frozen=True, eq=False)
class Boxes:
    """One box for each number of training poses, over the verification sets.

    J. W. Tukey, *Exploratory Data Analysis*, 1977: quartiles, whiskers to the farthest value
    within `REACH` heights of the box, single points beyond.
    """

    n: IndexArray
    """Numbers of training poses that have a box, rising, shape (box,)."""
    q1: FloatArray
    """Shape (box,), as the following, in the unit of the values."""
    median: FloatArray
    q3: FloatArray
    low: FloatArray
    """Ends of the lower whiskers."""
    high: FloatArray
    """Ends of the upper whiskers."""
    count: IndexArray
    """Verification sets behind each box."""
    outlier_box: IndexArray
    """Number of the box, from 0, of each value beyond the whiskers, shape (outlier,)."""
    outlier: FloatArray
    """Values of the outliers."""
    hollow: BoolArray
    """Boxes drawn as pale outlines, since their values are no finding, shape (box,)."""

    def ends(self) -> tuple[FloatArray, FloatArray]:
        """Return the smallest and the largest value of each box, each of shape (box,)."""
        lowest, highest = self.low.copy(), self.high.copy()
        np.minimum.at(lowest, self.outlier_box, self.outlier)
        np.maximum.at(highest, self.outlier_box, self.outlier)
        return lowest, highest


def extent(drawn: Iterable[Boxes]) -> tuple[float, float]:
    """Return the smallest and largest value that is drawn."""
    ends = np.hstack([each.ends() for each in drawn])
    return float(ends.min()), float(ends.max())


def make_boxes(values: FloatArray, what: str, finding: BoolArray | None = None) -> Boxes:
    """Return the boxes of values; NaN is a value that is missing.

    Parameters
    ----------
    values : ndarray, shape (cv, n_train)
        A figure of each verification set for 1, 2, … training poses.
    what : str
        What it is, for the message of a refusal.
    finding : ndarray of bool, shape (n_train,), optional
        For which numbers of training poses the values are a finding; by default all.

    Raises
    ------
    CodecError
        If there is not one finite value: an empty chart says nothing.
    """
    finite = np.isfinite(values)
    drawn = np.flatnonzero(finite.any(axis=0))
    if not len(drawn):
        raise CodecError(
            f"{what} has no finite value in {values.shape[0]} verification sets and"
            f" {values.shape[1]} numbers of training poses: there is nothing to draw"
        )
    values, finite = values[:, drawn], finite[:, drawn]
    known = np.where(finite, values, np.nan)
    # All boxes at once but those with a value missing: `nanpercentile` takes each box alone.
    quartiles = np.percentile(known, _QUARTILES, axis=0)
    for number in np.flatnonzero(~finite.all(axis=0)):
        quartiles[:, number] = np.percentile(known[finite[:, number], number], _QUARTILES)
    q1, median, q3 = quartiles
    reach = REACH * (q3 - q1)
    near: BoolArray = finite & (values >= q1 - reach) & (values <= q3 + reach)
    box, verification_set = np.nonzero((finite & ~near).T)
    return Boxes(
        n=drawn + 1,
        q1=q1,
        median=median,
        q3=q3,
        # A quartile lies between two values: the farthest one within reach may be inside the box.
        low=np.minimum(q1, np.where(near, values, np.inf).min(axis=0)),
        high=np.maximum(q3, np.where(near, values, -np.inf).max(axis=0)),
        count=finite.sum(axis=0),
        outlier_box=box,
        outlier=values[verification_set, box],
        hollow=np.zeros(len(drawn), dtype=bool) if finding is None else ~finding[drawn],
    )


def draw_boxes(axes: Axes, boxes: Boxes, variant: VariantStyle) -> None:
    """Draw the boxes of a variant; limits are left to `finish_axes`.

    Parameters
    ----------
    axes : Axes
        Panel whose x axis counts training poses.
    boxes : Boxes
        In the unit of the panel.
    variant : VariantStyle
        Style of the variant.
    """
    x, half = variant.at(boxes.n), 0.5 * variant.width
    left, right = x - half, x + half
    # A box without height shows only its median, which must then identify the variant.
    full = np.where(boxes.q3 > boxes.q1, style.INK, variant.colour)
    inks = np.where(boxes.hollow, style.REFUSED, full)
    corners = [left, boxes.q1], [right, boxes.q1], [right, boxes.q3], [left, boxes.q3]
    for hollow, face, edge in (
        (False, variant.fill, variant.colour),
        (True, style.PAPER, tint(variant.colour, PALE)),
    ):
        drawn = boxes.hollow == hollow
        for near, far in ((boxes.q1, boxes.low), (boxes.q3, boxes.high)):
            _draw_shapes(axes, ([x, near], [x, far]), drawn, 2, edgecolor=edge, lw=0.8)
        _draw_shapes(axes, corners, drawn, 3, facecolor=face, edgecolor=edge, lw=0.8)
        beyond = drawn[boxes.outlier_box]
        if np.any(beyond):
            axes.plot(
                x[boxes.outlier_box][beyond], boxes.outlier[beyond], ls="none", marker="o", ms=2.0,
                mew=0.0, color=edge, zorder=3,
            )  # fmt: skip
    for ink in np.unique(inks):
        ends = [left, boxes.median], [right, boxes.median]
        _draw_shapes(axes, ends, inks == ink, 4, edgecolor=ink, lw=1.3)


def _draw_shapes(
    axes: Axes, corners: Sequence[Sequence[FloatArray]], drawn: BoolArray, layer: int, **kind: Any
) -> None:
    """Draw lines, or polygons of three corners and more, as one path: there are thousands a page.

    Parameters
    ----------
    axes : Axes
        Panel; its limits stay.
    corners : sequence of pairs of ndarray, shape (shape,)
        x and y of each corner.
    drawn : ndarray of bool, shape (shape,)
        Which of the shapes.
    layer : int
        Higher ones hide lower ones.
    **kind : object
        Colours and line width.
    """
    if not np.any(drawn):
        return
    codes = [Path.MOVETO, *[Path.LINETO] * (len(corners) - 1)]
    if len(corners) > 2:
        corners, codes = [*corners, corners[0]], [*codes, Path.CLOSEPOLY]
    places = np.array(corners)[:, :, drawn].transpose(2, 0, 1)
    path = Path(places.reshape(-1, 2), np.tile(codes, len(places)))
    filled = "facecolor" in kind
    axes.add_artist(PathPatch(path, fill=filled, joinstyle="round", zorder=layer, **kind))


def finish_axes(axes: Axes, last: int, low: float, high: float, log: bool) -> None:
    """Set limits and labels of a panel.

    Parameters
    ----------
    axes : Axes
        Panel with its boxes.
    last : int
        Largest number of training poses.
    low, high : float
        Smallest and largest value that is to be seen.
    log : bool
        Whether the scale of the values is logarithmic.
    """
    even, edge = np.arange(2, last + 1, 2).astype(float), np.zeros(last // 2)
    left, right = even - 0.5, even + 0.5
    _draw_shapes(
        axes, ([left, edge], [right, edge], [right, edge + 1.0], [left, edge + 1.0]), even > 0, 0,
        facecolor=style.BAND, lw=0, transform=axes.get_xaxis_transform(),
    )  # fmt: skip
    axes.set_xlim(0.5, last + 0.5)
    if log:
        axes.set_yscale("log")
        axes.set_ylim(low / 1.12, high * 1.12)
        axes.yaxis.set_major_locator(FixedLocator(round_values(low / 1.12, high * 1.12)))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())
    else:
        margin = 0.05 * (high - min(low, 0.0)) or 1.0
        # A box at zero, where bounded fits put many springs, would hide under the axis.
        axes.set_ylim(min(0.0, low - margin * (low <= 0.0)), high + margin)
    style.open_frame(axes, grid="y")
    axes.tick_params(axis="x", length=0)
    axes.tick_params(axis="y", which="both", length=2)


def draw_error_panel(
    axes: Axes,
    boxes: Sequence[Boxes],
    styles: Sequence[VariantStyle],
    last: int,
    label: str,
    level: float | None = None,
) -> None:
    """Draw boxes beside one another, their values in decades where that reads better.

    Parameters
    ----------
    axes : Axes
        Panel.
    boxes : sequence of Boxes
        Boxes of each variant.
    styles : sequence of VariantStyle
        Styles of the variants.
    last : int
        Number of groups.
    label : str
        Label of the values.
    level : float, optional
        Value that the axis holds too, marked by a dashed line.
    """
    low, high = extent(boxes)
    if level is not None:
        low, high = min(low, level), max(high, level)
        axes.axhline(level, color=style.INK, lw=0.9, ls=(0, (5, 4)), zorder=1)
    log = reads_better_in_decades(low, high)
    for each, variant in zip(boxes, styles, strict=True):
        draw_boxes(axes, each, variant)
    finish_axes(axes, last, low, high, log)
    axes.set_ylabel(f"{label} (log scale)" if log else label)


def label_sizes(axes: Axes, last: int, width: float, shown: bool = True) -> None:
    """Label numbers of training poses, every one where space allows.

    Parameters
    ----------
    axes : Axes
        Panel.
    last : int
        Largest number of training poses.
    width : float
        Width of the panel, in inches.
    shown : bool
        Whether labels are written; panels above others go without.
    """
    axes.xaxis.set_major_locator(MultipleLocator(label_step(last, width)))
    axes.tick_params(axis="x", labelbottom=shown)


def label_step(last: int, width: float) -> int:
    """Return after how many sizes the next label follows.

    >>> label_step(22, 9.0), label_step(22, 2.9), label_step(70, 9.0)
    (1, 2, 5)
    """
    steps = (1, 2, 5, 10, 20, 50, 100, 200, 500)
    return next((step for step in steps if step * width / last >= _LABEL), last)


def reads_better_in_decades(low: float, high: float) -> bool:
    """Return whether values from low to high belong on a logarithmic scale."""
    return low > 0.0 and high > _DECADES * low


def legend_handles(styles: Sequence[VariantStyle]) -> list[Patch]:
    """Return the legend entries of variants."""
    return [
        Patch(facecolor=variant.fill, edgecolor=variant.colour, label=literal(variant.name))
        for variant in styles
    ]


def round_values(low: float, high: float) -> list[float]:
    """Return 1, 2 and 5 times powers of ten between two values, decades only where many.

    >>> round_values(0.04, 0.6)
    [0.05, 0.1, 0.2, 0.5]
    """
    exponents = np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
    factors = (1.0, 2.0, 5.0) if high < 2e3 * low else (1.0,)
    values = (
        float(f"{factor * 10.0**exponent:.3g}") for exponent in exponents for factor in factors
    )
    return [value for value in values if low <= value <= high]


def legend_height(styles: Sequence[VariantStyle], across: float) -> float:
    """Return the height of a legend of some width, both in inches."""
    return ROW * -(-len(styles) // _columns(styles, across))


def draw_legend(
    figure: Page, styles: Sequence[VariantStyle], left: float, top: float, across: float
) -> None:
    """Draw the legend.

    Parameters
    ----------
    figure : Page
        Where to.
    styles : sequence of VariantStyle
        Styles of the variants.
    left, top : float
        Its corner, from the left and the upper edge of the figure, in inches.
    across : float
        Its width, in inches.
    """
    width, height = figure.get_size_inches()
    figure.legend(
        handles=legend_handles(styles), loc="upper left", ncols=_columns(styles, across),
        frameon=False, bbox_to_anchor=(left / width, 1.0 - top / height), borderpad=0.0,
        borderaxespad=0.0, handlelength=1.4, columnspacing=1.6, fontsize=9.0,
    )  # fmt: skip


def _columns(styles: Sequence[VariantStyle], across: float) -> int:
    longest = max(len(variant.name) for variant in styles)
    return max(1, min(len(styles), int(across / (_CHARACTER * longest + _SWATCH))))
