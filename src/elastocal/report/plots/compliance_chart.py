"""Chart of compliances: how each settles with the number of training poses, spring by spring."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from elastocal.arrays import BoolArray
from elastocal.codec import CodecData, SpringObservability
from elastocal.elastic import Unit, unit_of
from elastocal.identification import describe
from elastocal.report.plots import style
from elastocal.report.plots._box_plots import (
    ROW,
    Boxes,
    draw_boxes,
    draw_legend,
    finish_axes,
    label_sizes,
    legend_height,
    make_boxes,
)
from elastocal.report.plots.printing import literal, new_figure, wrapped
from elastocal.report.plots.style import VariantStyle, variant_styles
from elastocal.results import brief_repr
from elastocal.wording import counted

_COLUMNS = 3
_LEFT, _RIGHT, _GAP = 0.62, 0.15, 0.52
_PANEL, _OVER = 1.3, 0.38
"""Height of a panel and of its name above it, in inches."""
_HEAD, _FOOT, _LINE = 0.62, 0.75, 0.155
_SETTLED = 0.25
"""Part of the largest training set from which on boxes set the scale; those of fewer poses may
be cut, which is marked."""
_SHORT = 26
"""Characters of variants' names that fit beside the name of a spring."""
_ROOMY = 1.8
"""Factor by which the scale may grow so that nothing is cut."""


@brief_repr
@dataclass(frozen=True, eq=False)
class SpringBoxes:
    """The boxes of one spring in the variants that have it."""

    spring: str
    unit: str
    """That people read."""
    boxes: dict[str, Boxes]
    """By variant."""
    hollow: dict[str, BoolArray]
    """By variant: which numbers of training poses leave the spring mixed up with others in at
    least half of the splits, shape (box,)."""
    never: tuple[str, ...]
    """Variants that never tell it apart."""


def compliance_chart(data: CodecData, seen: Sequence[SpringObservability]) -> Figure:
    """Return one page with a panel for each spring.

    Parameters
    ----------
    data : CodecData
        The arrays.
    seen : sequence of SpringObservability
        What each variant tells apart, in the order of the variants.

    Raises
    ------
    CodecError
        If a variant has no compliance to draw.
    """
    springs = spring_boxes(data, seen)
    styles = {
        variant.name: variant for variant in variant_styles([each.name for each in data.variants])
    }
    last = int(data.n_train[-1])
    across = max(2.75, last * (0.03 + 0.035 * len(styles)))
    columns = _columns(springs)
    rows = -(-len(springs) // columns)
    width = columns * (_LEFT + across) + _RIGHT
    notes = _notes(seen, int(width * 15))
    foot = _FOOT + _LINE * len(notes)
    head = _HEAD + legend_height(tuple(styles.values()), width - _LEFT - _RIGHT) - ROW
    height = head + rows * (_OVER + _PANEL) + foot
    figure = new_figure(width, height)
    for number, each in enumerate(springs):
        row, column = divmod(number, columns)
        left = _LEFT + column * (_LEFT + across)
        bottom = height - head - row * (_OVER + _PANEL) - _OVER - _PANEL
        axes = figure.add_axes((left / width, bottom / height, across / width, _PANEL / height))
        _draw_panel(axes, each, styles, last)
        lowest = number + columns >= len(springs)
        label_sizes(axes, last, across, shown=lowest)
        if lowest:
            axes.set_xlabel("Number of training poses", fontsize=8.0)
    _draw_frame(figure, data, tuple(styles.values()), notes)
    return figure


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
    return [_spring_boxes(data, seen, name, unit_of(units[name])) for name in names]


def _spring_boxes(
    data: CodecData, seen: Sequence[SpringObservability], spring: str, unit: Unit
) -> SpringBoxes:
    boxes: dict[str, Boxes] = {}
    hollow: dict[str, BoolArray] = {}
    never = []
    for k, (variant, labels, told_apart) in enumerate(
        zip(data.variants, data.springs, seen, strict=True)
    ):
        if spring not in labels.names:
            continue
        place, name = labels.names.index(spring), variant.name
        values = unit.factor * data.compliance[k][:, :, place]
        boxes[name] = make_boxes(values, f"compliance {spring} of variant {name!r}")
        hollow[name] = told_apart.share[boxes[name].n - 1, place] < 0.5
        never += [name] if told_apart.never[place] else []
    return SpringBoxes(spring, unit.shown, boxes, hollow, tuple(never))


def _columns(springs: Sequence[SpringBoxes]) -> int:
    """Return the number of columns: one joint a row where all have as many springs."""
    counts: dict[str, int] = {}
    for each in springs:
        counts[_joint(each.spring)] = counts.get(_joint(each.spring), 0) + 1
    same = set(counts.values())
    return same.pop() if len(same) == 1 and 1 < min(same) <= 4 else min(_COLUMNS, len(springs))


def never_told_apart(each: SpringBoxes) -> str:
    """Return the mark of a spring that is not told apart, empty for one that is."""
    if not each.never:
        return ""
    if len(each.never) == len(each.boxes):
        return "not told apart"
    names = "; ".join(each.never)
    if len(names) > _SHORT:
        names = f"{len(each.never)} of {len(each.boxes)} variants"
    return f"not told apart ({names})"


def scale_top(boxes: Sequence[Boxes], last: int) -> float:
    """Return the upper end of a scale that is not set by the smallest training sets."""
    settled = [each.high[each.n > _SETTLED * last] for each in boxes]
    enough = float(np.concatenate([*settled, [0.0]]).max())
    highest = max(each.extent()[1] for each in boxes)
    return highest if highest <= _ROOMY * enough or enough <= 0.0 else 1.1 * enough


def _joint(spring: str) -> str:
    return spring.rpartition(".")[0] or spring


def _draw_panel(axes: Axes, each: SpringBoxes, styles: dict[str, VariantStyle], last: int) -> None:
    for name, boxes in each.boxes.items():
        draw_boxes(axes, boxes, styles[name], each.hollow[name])
    low = min(boxes.extent()[0] for boxes in each.boxes.values())
    finish_axes(axes, last, low, scale_top(list(each.boxes.values()), last), log=False)
    for name, boxes in each.boxes.items():
        _mark_cut(axes, boxes, styles[name])
    axes.set_title(literal(each.spring), loc="left", fontsize=8.5, weight="bold", pad=5)
    axes.set_title(
        literal(never_told_apart(each)), loc="right", fontsize=7.5, color=style.MUTED,
        style="italic", pad=5,
    )  # fmt: skip
    axes.set_ylabel(each.unit, fontsize=7.5, labelpad=2)
    axes.tick_params(labelsize=7.5)
    axes.locator_params(axis="y", nbins=4)


def _mark_cut(axes: Axes, boxes: Boxes, variant: VariantStyle) -> None:
    """Put an arrow at the upper edge over every box that goes beyond it."""
    top = axes.get_ylim()[1]
    highest = boxes.high.copy()
    np.maximum.at(highest, boxes.outlier_box, boxes.outlier)
    cut = highest > top
    axes.scatter(
        variant.at(boxes.n)[cut], np.full(np.count_nonzero(cut), top), marker="^", s=13.0,
        c=variant.colour, linewidths=0, clip_on=False, zorder=5,
    )  # fmt: skip


def _notes(seen: Sequence[SpringObservability], width: int) -> list[str]:
    """Return the combinations that are not told apart, once for variants that share them."""
    variants: dict[str, list[str]] = {}
    for each in seen:
        if each.groups:
            combinations = "; ".join(describe(group) for group in each.groups)
            variants.setdefault(combinations, []).append(each.variant)
    lines: list[str] = []
    for combinations, names in variants.items():
        lines += wrapped(
            f"Not told apart ({'; '.join(names)}): what changes only these differences changes no"
            f" measured deflection: {combinations}.", width,
        )  # fmt: skip
    return lines


def _draw_frame(
    figure: Figure, data: CodecData, styles: Sequence[VariantStyle], notes: Sequence[str]
) -> None:
    width, height = figure.get_size_inches()
    title = f"{data.robot or 'Robot'}: compliances over the number of training poses"
    figure.text(
        _LEFT / width, 1.0 - 0.1 / height, literal(title), va="top", fontsize=11.5, weight="bold"
    )
    draw_legend(figure, styles, _LEFT, 0.42, width - _LEFT - _RIGHT)
    sets = len(data.seed_pose)
    lines = [
        *notes,
        f"Each box: {counted(sets, 'training set')}. Hollow pale box: these training sets do not"
        " tell the spring apart from others; its value is no finding. Arrow: beyond the scale.",
    ]
    figure.text(
        _LEFT / width, 0.1 / height, literal("\n".join(lines)), va="bottom", fontsize=7.5,
        color=style.MUTED, linespacing=1.3,
    )  # fmt: skip
