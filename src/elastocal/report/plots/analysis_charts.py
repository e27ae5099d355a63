"""Charts of what lies behind a codec's errors: its compliances and its indices.

How each compliance settles with the number of training poses, and whether indices foretell accuracy
(paper 4.2.3).
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from elastocal.codec import INDICES, CodecData, Correlation, IndexValues, SpringObservability
from elastocal.elastic import unit_of
from elastocal.errors import CodecError
from elastocal.identification import describe
from elastocal.report.plots import style
from elastocal.report.plots._box_plots import (
    ROW,
    Boxes,
    draw_boxes,
    draw_legend,
    extent,
    finish_axes,
    label_sizes,
    legend_height,
    make_boxes,
    reads_better_in_decades,
)
from elastocal.report.plots.style import VariantStyle, literal, variant_styles
from elastocal.results import brief_repr
from elastocal.wording import counted

_COLUMNS = 3
_LEFT, _RIGHT, _GAP = 0.62, 0.15, 0.52
_PANEL, _OVER = 1.3, 0.38
"""Height of a panel of compliances and of its name above it, in inches."""
_HEAD, _FOOT, _LINE = 0.62, 0.75, 0.155
_SETTLED = 0.25
"""Part of the largest training set from which on boxes set the scale; those of fewer poses may
be cut, which is marked."""
_MOST_SPRINGS = 18
"""Panels up to which a page has one for every spring."""
_SHORT = 26
"""Characters of variants' names that fit beside the name of a spring."""
_ROOMY = 1.8
"""Factor by which the scale may grow so that nothing is cut."""


@dataclass(frozen=True)
class _IndexName:
    """Title of an index, and how its values are shown."""

    title: str
    unit: str = ""
    factor: float = 1.0
    """Factor from the value of the criterion to what is shown."""
    more_is_better: bool = True
    """Whether more of the value shown is better."""


INDEX_NAMES: dict[str, _IndexName] = {
    **{name: _IndexName(name.upper()) for name in ("o1", "o2", "o3", "o4", "o5", "d", "e")},
    # Criteria A and I are minus a variance; the variance is shown.
    "a": _IndexName("A (variance)", factor=-1.0, more_is_better=False),
    "i": _IndexName("I (variance)", factor=-1.0, more_is_better=False),
    "covering_radius": _IndexName("Covering radius", "mm", 1e3, more_is_better=False),
}
KIND_TITLES = {
    "growth": "All sizes of a split",
    "size": "Equal size",
    "size_and_split": "Equal size, beyond its split",
}
"""Titles of the comparisons that correlations are made over."""
_INDEX_LEFT, _INDEX_RIGHT, _INDEX_HEAD, _INDEX_FOOT = 1.25, 0.2, 0.98, 1.05
_FOREST, _FOREST_GAP = 2.65, 0.25
"""Width of a panel of correlations and of the gap between two, in inches."""
_GROWTH_COLUMNS, _GROWTH, _GROWTH_SIDE, _GROWTH_OVER = 5, 1.25, 0.48, 0.42
"""Panels of an index: columns, height, and margins at their left and above them, in inches."""
_BETWEEN = 0.75


@brief_repr
@dataclass(frozen=True, eq=False)
class SpringBoxes:
    """The boxes of one spring in the variants that have it."""

    spring: str
    unit: str
    """Unit for people."""
    boxes: dict[str, Boxes]
    """Boxes by variant; hollow for numbers of training poses that leave the spring undetermined in
    at least half of the splits."""
    never: tuple[str, ...]
    """Variants that never determine it."""


def compliance_chart(data: CodecData, seen: Sequence[SpringObservability]) -> Figure:
    """Return one page with a panel for each spring.

    Where there are very many, springs that the largest training sets do not tell apart have none.

    Parameters
    ----------
    data : CodecData
        The arrays.
    seen : sequence of SpringObservability
        Springs that each variant determines, in the order of the variants.

    Raises
    ------
    CodecError
        If a variant has no compliance to draw.
    """
    every = spring_boxes(data, seen)
    springs = _worth_a_panel(every)
    styles = variant_styles([each.name for each in data.variants])
    last = int(data.n_train[-1])
    across = max(2.75, last * (0.03 + 0.035 * len(styles)))
    columns = _columns(springs)
    rows = -(-len(springs) // columns)
    width = columns * (_LEFT + across) + _RIGHT
    legend = width - _LEFT - _RIGHT
    notes = _notes(seen, int(width * 15))
    head = _HEAD + legend_height(styles, legend) - ROW
    height = head + rows * (_OVER + _PANEL) + (_FOOT + _LINE * len(notes))
    figure = style.new_figure(width, height)
    for number, each in enumerate(springs):
        row, column = divmod(number, columns)
        bottom = height - head - row * (_OVER + _PANEL) - _OVER - _PANEL
        axes = figure.add_panel(_LEFT + column * (_LEFT + across), bottom, across, _PANEL)
        _draw_compliance(axes, each, styles, last)
        lowest = number + columns >= len(springs)
        label_sizes(axes, last, across, shown=lowest)
        if lowest:
            axes.set_xlabel("Number of training poses", fontsize=8.0)
    title = f"{data.robot or 'Robot'}: compliances over the number of training poses"
    figure.add_title(title, _LEFT)
    draw_legend(figure, styles, _LEFT, 0.42, legend)
    notes.append(
        f"Each box: {counted(len(data.seed_pose), 'training set')}. Hollow pale box: these training"
        " sets do not tell the spring apart from others; its value is no finding. Arrow: beyond"
        " the scale."
    )
    if len(springs) < len(every):
        notes.append(
            f"Not drawn: {len(every) - len(springs)} of {counted(len(every), 'spring')}, which the"
            " largest training sets of no variant tell apart."
        )
    figure.add_caption("\n".join(notes), _LEFT, 7.5, 1.3)
    return figure


def _worth_a_panel(springs: list[SpringBoxes]) -> list[SpringBoxes]:
    """Return all of a few springs; of many those whose last box of some variant is a finding."""
    if len(springs) <= _MOST_SPRINGS:
        return springs
    found = [each for each in springs if not all(b.hollow[-1] for b in each.boxes.values())]
    return found or springs


def spring_boxes(data: CodecData, seen: Sequence[SpringObservability]) -> list[SpringBoxes]:
    """Return the boxes of every spring, joint by joint.

    Raises
    ------
    CodecError
        If a variant has no compliance to draw, by its name.
    """
    units = {
        name: unit
        for labels in data.springs
        for name, unit in zip(labels.names, labels.units, strict=True)
    }
    joints = list(dict.fromkeys(_joint(name) for name in units))
    names = sorted(units, key=lambda name: joints.index(_joint(name)))
    return [_spring_boxes(data, seen, name, units[name]) for name in names]


def _spring_boxes(
    data: CodecData, seen: Sequence[SpringObservability], spring: str, si: str
) -> SpringBoxes:
    unit = unit_of(si)
    boxes: dict[str, Boxes] = {}
    never = []
    for compliance, variant, labels, told_apart in zip(
        data.compliance, data.variants, data.springs, seen, strict=True
    ):
        if spring not in labels.names:
            continue
        place, name = labels.names.index(spring), variant.name
        boxes[name] = make_boxes(
            unit.factor * compliance[:, :, place], f"compliance {spring} of variant {name!r}",
            finding=told_apart.share[:, place] >= 0.5,
        )  # fmt: skip
        never += [name] if told_apart.never[place] else []
    return SpringBoxes(spring, unit.shown, boxes, tuple(never))


def _columns(springs: Sequence[SpringBoxes]) -> int:
    """Return the number of columns: one joint a row where all have as many springs."""
    same = set(Counter(_joint(each.spring) for each in springs).values())
    return same.pop() if len(same) == 1 and 1 < min(same) <= 4 else min(_COLUMNS, len(springs))


def never_told_apart(each: SpringBoxes) -> str:
    """Return the mark of a spring that is never determined, empty for others."""
    if not each.never:
        return ""
    if len(each.never) == len(each.boxes):
        return "not told apart"
    names = "; ".join(each.never)
    if len(names) > _SHORT:
        names = f"{len(each.never)} of {len(each.boxes)} variants"
    return f"not told apart ({names})"


def spring_scale(each: SpringBoxes, last: int) -> tuple[float, float]:
    """Return the ends of a scale whose upper one the smallest training sets do not set."""
    settled = [boxes.high[boxes.n > _SETTLED * last] for boxes in each.boxes.values()]
    enough = float(np.concatenate([*settled, [0.0]]).max())
    low, highest = extent(each.boxes.values())
    return low, highest if highest <= _ROOMY * enough or enough <= 0.0 else 1.1 * enough


def _joint(spring: str) -> str:
    return spring.rpartition(".")[0] or spring


def _draw_compliance(
    axes: Axes, each: SpringBoxes, styles: Sequence[VariantStyle], last: int
) -> None:
    drawn = [variant for variant in styles if variant.name in each.boxes]
    for variant in drawn:
        draw_boxes(axes, each.boxes[variant.name], variant)
    finish_axes(axes, last, *spring_scale(each, last), log=False)
    top = axes.get_ylim()[1]
    for variant in drawn:
        # An arrow at the upper edge over every box that goes beyond it.
        boxes = each.boxes[variant.name]
        x = variant.at(boxes.n)[boxes.ends()[1] > top]
        if len(x):
            axes.plot(
                x, np.full(len(x), top), ls="none", marker="^", ms=3.6, mew=0.0,
                color=variant.colour, clip_on=False, zorder=5,
            )  # fmt: skip
    # With their height given, titles are not fitted to the labels of every tick.
    axes.set_title(literal(each.spring), loc="left", fontsize=8.5, weight="bold", pad=5, y=1.0)
    axes.set_title(
        literal(never_told_apart(each)), loc="right", fontsize=7.5, color=style.MUTED,
        style="italic", pad=5, y=1.0,
    )  # fmt: skip
    axes.set_ylabel(each.unit, fontsize=7.5, labelpad=2)
    axes.tick_params(labelsize=7.5)
    axes.locator_params(axis="y", nbins=4)


def _notes(seen: Sequence[SpringObservability], width: int) -> list[str]:
    """Return the undetermined combinations, once for variants that share them."""
    variants: dict[str, list[str]] = {}
    for each in seen:
        if each.groups:
            combinations = "; ".join(describe(group) for group in each.groups)
            variants.setdefault(combinations, []).append(each.variant)
    lines: list[str] = []
    for combinations, names in variants.items():
        lines += style.wrapped(
            f"Not told apart ({'; '.join(names)}): what changes only these differences changes no"
            f" measured deflection: {combinations}.", width,
        )  # fmt: skip
    return lines


def index_chart(
    data: CodecData, indices: Sequence[IndexValues], correlations: Sequence[Correlation]
) -> Figure:
    """Return one page: correlations with the mean error above, growth of the indices below.

    Parameters
    ----------
    data : CodecData
        The arrays.
    indices : sequence of IndexValues
        Indices of each variant, in order.
    correlations : sequence of Correlation
        Correlations of all variants.

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
    rows = -(-len(INDICES) // _GROWTH_COLUMNS)
    width = _INDEX_LEFT + len(KIND_TITLES) * (_FOREST + _FOREST_GAP) + _INDEX_RIGHT
    legend = width - 0.3 - _INDEX_RIGHT
    head = _INDEX_HEAD + legend_height(styles, legend) - ROW
    height = head + forest + _BETWEEN + rows * (_GROWTH_OVER + _GROWTH) + _INDEX_FOOT
    figure = style.new_figure(width, height)
    for column, kind in enumerate(KIND_TITLES):
        left = _INDEX_LEFT + column * (_FOREST + _FOREST_GAP)
        axes = figure.add_panel(left, height - head - forest, _FOREST, forest)
        _draw_forest(axes, [each for each in correlations if each.kind == kind], styles)
        axes.tick_params(axis="y", labelleft=not column)
        axes.set_title(KIND_TITLES[kind], fontsize=9.0, weight="bold", pad=5)
    start = height - head - forest - _BETWEEN
    across = (width - _INDEX_RIGHT - _GROWTH_COLUMNS * _GROWTH_SIDE - 0.1) / _GROWTH_COLUMNS
    for number, name in enumerate(INDICES):
        row, column = divmod(number, _GROWTH_COLUMNS)
        left = 0.1 + _GROWTH_SIDE + column * (across + _GROWTH_SIDE)
        bottom = start - row * (_GROWTH_OVER + _GROWTH) - _GROWTH_OVER - _GROWTH
        axes = figure.add_panel(left, bottom, across, _GROWTH)
        _draw_growth(axes, data, indices, name, styles)
        label_sizes(axes, int(data.n_train[-1]), across, shown=row == rows - 1)
    title = f"{data.robot or 'Robot'}: do indices foretell the error at verification poses?"
    figure.add_title(title, 0.3)
    draw_legend(figure, styles, 0.3, 0.42, legend)
    _explain_indices(figure, data, start)
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
        axes.axhspan(row - 0.5, row + 0.5, color=style.BAND, lw=0, zorder=0)
    for variant in styles:
        of = {e.index: e for e in found if e.variant == variant.name and e.error == "mean"}
        y = np.arange(len(INDICES)) + variant.place
        rows = [of[name] for name in INDICES]
        for at, each in zip(y, rows, strict=True):
            ends = np.array([each.low, each.high], dtype=float)  # NaN where it is unknown
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
    style.open_frame(axes, grid="x", also="left")


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
        values = shown.factor * each.values[name]
        low, middle, high = np.percentile(values, (25, 50, 75), axis=0)
        axes.fill_between(data.n_train, low, high, color=variant.fill, lw=0, alpha=0.6)
        dashes = "--" if variant.fill == style.PAPER else "-"
        axes.plot(data.n_train, middle, color=variant.colour, lw=1.2, ls=dashes)
        curves += [low, high]
    if reads_better_in_decades(float(np.min(curves)), float(np.max(curves))):
        axes.set_yscale("log")
    better = "↑" if shown.more_is_better else "↓"
    axes.set_title(shown.title, loc="left", fontsize=7.8, weight="bold", pad=4)
    axes.set_title(f"{better} better", loc="right", fontsize=7.0, color=style.MUTED, pad=4)
    axes.set_ylabel(shown.unit, fontsize=7.0, labelpad=1)
    axes.set_xlim(0.5, data.n_train[-1] + 0.5)
    axes.tick_params(labelsize=7.0, length=2, pad=2)
    axes.tick_params(which="minor", labelleft=False, length=1)
    style.open_frame(axes)
    axes.grid(axis="y", color=style.GRID, lw=0.5)


def _explain_indices(figure: style.Page, data: CodecData, start: float) -> None:
    """Write what the panels show; ``start`` is where those of growth begin, in inches."""
    width, height = figure.get_size_inches()
    middle = (_INDEX_LEFT + 0.5 * len(KIND_TITLES) * (_FOREST + _FOREST_GAP)) / width
    figure.text(
        middle, (start + _BETWEEN - 0.24) / height,
        "Rank correlation with accuracy: +1 orders training sets as the measured mean error does,"
        " 0 tells nothing", ha="center", va="top", fontsize=8.5,
    )  # fmt: skip
    figure.text(
        0.3 / width, (start - 0.02) / height,
        "Growth of each index over the number of training poses",
        va="top", fontsize=9.0, weight="bold",
    )  # fmt: skip
    sets, size = data.verification.shape
    figure.add_caption(
        f"Above: {counted(sets, 'split')}, {counted(size, 'held-out pose')} each; bars: 95 %"
        " intervals, jackknife over splits, widened for the poses that splits share.\n"
        "All sizes of a split: nearly everything grows with the number of poses. Equal size: over"
        " splits at one number of training poses. Beyond its split: the same,\n"
        "after the mean rank of each split was taken off. At equal size O1 ranks as D, and O3 as"
        " E. Below: medians and quartiles over the splits.",
        0.3, 7.5,
    )  # fmt: skip
