"""Springs of a calibration, and the change between two calibrations (paper Fig. 12b)."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator

from elastocal.arrays import FloatArray
from elastocal.elastic import Unit, unit_of
from elastocal.identification import CalibratedModel, FitSettings, spring_summaries
from elastocal.identification.recertification import (
    CompareSummary,
    DeflectionChange,
    Estimate,
    SpringChange,
)
from elastocal.report.plots import style
from elastocal.report.plots.style import literal, wrapped
from elastocal.wording import phrase

_BAR, _BAR_FOOT = 0.23, 0.75
"""Heights of a spring and of the space below its panel, in inches."""
_WIDTH, _LEFT, _MIDDLE, _RIGHT = 7.5, 2.75, 0.25, 0.2
_HEAD, _ROW, _BETWEEN, _ROWS, _FOOT = 1.0, 0.21, 0.7, 2.0, 1.0
"""Sizes in inches; `_ROW` is a spring, `_ROWS` the height of the change along the rows."""
_TITLE = 0.62
"""Height of a title and the description below it, in inches."""
_SHARE = 0.6
"""Part of the width beside the names that the compliances take."""
_PER_MICRO, _MM = 1e6, 1e3
_OLD, _NEW = style.BLUE, style.VERMILLION
_MOST_POINTS = 1500
"""More rows than this are drawn in groups, by the extremes of each."""
_EDGE = 3.0
"""Changes beyond this many times what chance allows are drawn at the edge, with the number."""


@dataclass(frozen=True)
class SpringBar:
    """A spring in the unit for people."""

    name: str
    unit: Unit
    value: float
    low: float
    high: float
    group: int | None
    """Number of its group of springs that are not separately observable."""
    too_weak: bool = False
    """See `SpringSummary.too_weak`."""
    at_bound: bool = False
    """Whether the fit ends at a bound of it."""

    @property
    def is_own(self) -> bool:
        """Whether the readings determine it separately, with an interval."""
        return self.group is None and not self.too_weak


def spring_bars(model: CalibratedModel, settings: FitSettings | None = None) -> list[SpringBar]:
    """Return the characteristics of a model, each with the first group that leaves it open.

    Parameters
    ----------
    settings : FitSettings, optional
        Settings of its fit; see `spring_summaries`.
    """
    bars = []
    for row in spring_summaries(model, settings):
        unit = unit_of(row.unit)
        value, low, high = (unit.factor * each for each in (row.compliance, row.low, row.high))
        bars.append(
            SpringBar(row.name, unit, value, low, high, row.group, row.too_weak, row.at_bound)
        )
    return bars


def spring_figure(springs: Sequence[SpringBar], title: str = "", about: str = "") -> Figure:
    """Return the figure: a panel for each unit, springs downwards.

    Parameters
    ----------
    springs : sequence of SpringBar
        From `spring_bars`; not empty.
    title, about : str, optional
        Written above, where no page says it.
    """
    # The unit of most springs comes first, so that a rail is not above the joints.
    counts = Counter(bar.unit for bar in springs).most_common()
    left = max(1.26, 0.3 + 0.068 * max(len(bar.name) for bar in springs))
    bottom = _BAR * len(springs) + _BAR_FOOT * len(counts)
    figure = style.new_figure(9.0, bottom + (_TITLE if title else 0.0))
    if title:
        figure.add_title(title, 0.15, about=about)
    # Width of the longest name.
    left = max(1.26, 0.2 + 0.067 * max(len(bar.name) for bar in springs))
    for unit, count in counts:
        bottom -= _BAR * count + _BAR_FOOT
        axes = figure.add_panel(left, bottom + _BAR_FOOT - 0.1, 8.82 - left, _BAR * count)
        _draw_bars(axes, unit.shown, [bar for bar in springs if bar.unit == unit])
    return figure


def _draw_bars(axes: Axes, unit: str, bars: Sequence[SpringBar]) -> None:
    # A value that is not separately determined has no meaningful interval.
    highs = [bar.high if bar.is_own else bar.value for bar in bars]
    lows = [bar.low if bar.is_own else bar.value for bar in bars]
    bottom, top = min(0.0, *lows), max(0.0, *highs)
    span = top - bottom or 1.0
    own = [(k, bar) for k, bar in enumerate(bars) if bar.is_own]
    rows = [k for k, _ in own]
    low, value, high = ([getattr(bar, key) for _, bar in own] for key in ("low", "value", "high"))
    axes.hlines(rows, low, high, color=style.BLUE, lw=3.5, alpha=0.45)
    axes.scatter(value, rows, s=26, c=style.BLUE, zorder=3)
    for k, bar in enumerate(bars):
        if not bar.is_own:
            axes.scatter(
                bar.value, k, s=26, facecolors="none", edgecolors=style.REFUSED, marker="D"
            )
            left = bar.value > bottom + 0.75 * span
            axes.text(
                bar.value + (-0.015 if left else 0.015) * span, k,
                phrase("too weak to see")
                if bar.group is None
                else phrase("not by itself, group {group}", group=bar.group),
                ha="right" if left else "left",
                va="center", fontsize=7.5, color=style.MUTED, style="italic",
            )  # fmt: skip
    axes.set_yticks(range(len(bars)), [literal(bar.name) for bar in bars], fontsize=8)
    axes.set_ylim(len(bars) - 0.4, -0.6)
    axes.set_xlim(bottom - 0.02 * span, bottom + 1.05 * span)
    axes.set_xlabel(
        phrase("lost motion in {unit}; band: 95 % interval", unit=unit)
        if unit == "arcmin"
        else phrase("compliance in {unit}; band: 95 % interval", unit=unit)
    )
    style.open_frame(axes, grid="both", colour="#e6e6e2")
    axes.tick_params(length=0)


def write_recertification_figure(path: Path, found: CompareSummary) -> Path:
    """Write the figure, atomically; return its path.

    Parameters
    ----------
    path : Path
        Its suffix decides the kind: SVG, PNG or PDF.
    found : CompareSummary
        The comparison.

    Raises
    ------
    FileAccessError
        If the suffix is another or the file cannot be written.
    """
    description = f"{found.moved_sentence} {found.verdict_sentence}"
    return style.write_figure(
        path, lambda: recertification_figure(found), _title(found), description
    )


def recertification_figure(found: CompareSummary) -> Figure:
    """Return the figure; see `write_recertification_figure`.

    Above, every compared spring or sum with both intervals, and its change over what chance
    allows; below, if there are rows, how far the predicted deflection changed along them.
    """
    table = max(len(found.springs), 1) * _ROW
    along = 0.0 if found.deflection is None else _BETWEEN + _ROWS
    height = _HEAD + table + along + _FOOT
    figure = style.new_figure(_WIDTH, height)
    wide = _WIDTH - _LEFT - _MIDDLE - _RIGHT
    bottom = height - _HEAD - table
    _draw_values(figure.add_panel(_LEFT, bottom, _SHARE * wide, table), found.springs)
    left = _LEFT + _SHARE * wide + _MIDDLE
    _draw_tested(figure.add_panel(left, bottom, (1.0 - _SHARE) * wide, table), found.springs)
    if found.deflection is not None:
        axes = figure.add_panel(0.85, _FOOT, _WIDTH - 1.05, _ROWS)
        _draw_rows(axes, found.deflection, found.limit)
    _draw_frame(figure, found)
    return figure


def _draw_values(axes: Axes, springs: Sequence[SpringChange]) -> None:
    """Draw both estimates of every spring; the scale is linear near 0 and then in decades."""
    for number, change in enumerate(springs):
        for estimate, colour, marker, up in (
            (change.old, _OLD, "o", -0.16),
            (change.new, _NEW, "D", 0.16),
        ):
            low, value, high = _PER_MICRO * np.array([estimate.low, estimate.value, estimate.high])
            axes.plot([low, high], [number + up] * 2, color=colour, lw=1.3, solid_capstyle="butt")
            axes.plot([value], [number + up], marker, ms=3.4, color=colour)
    sizes = [abs(_PER_MICRO * each.old.value) for each in springs if each.old.value != 0.0]
    axes.set_xscale("symlog", linthresh=float(f"{np.median(sizes or [1.0]):.0e}"), linscale=1.5)
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axes.set_xlabel("Compliance in µrad/(N·m), µm/N", fontsize=8.0)
    _finish(axes, len(springs))
    axes.set_yticks(range(len(springs)), [literal(_short(each.name)) for each in springs], size=7.5)
    for label, change in zip(axes.get_yticklabels(), springs, strict=True):
        label.set_fontweight("bold" if change.moved else "normal")


def _draw_tested(axes: Axes, springs: Sequence[SpringChange]) -> None:
    """Draw each change over the half-width of its simultaneous interval."""
    axes.axvspan(-1.0, 1.0, color=style.FAINT, alpha=0.35, lw=0)
    for number, change in enumerate(springs):
        ratio = _over_chance(change.together)
        colour = _NEW if change.moved else style.MUTED
        shown = float(np.clip(ratio, -_EDGE, _EDGE))
        marker = "o" if shown == ratio else "<" if ratio < 0.0 else ">"
        axes.plot([0.0, shown], [number] * 2, color=colour, lw=1.2)
        axes.plot([shown], [number], marker, ms=4.5, color=colour, clip_on=False)
        if change.moved and np.isfinite(change.relative):
            axes.annotate(
                f"{change.relative:+.0%}", (shown, number), (0, 4), size=7.0, ha="center",
                textcoords="offset points", color=colour, weight="bold", annotation_clip=False,
            )  # fmt: skip
    axes.set_xlim(-_EDGE - 0.3, _EDGE + 0.3)
    axes.set_xticks([-2, -1, 0, 1, 2])
    axes.set_xlabel("Change over what chance allows", fontsize=8.0)
    _finish(axes, len(springs))
    axes.set_yticks([])


def _finish(axes: Axes, count: int) -> None:
    axes.axvline(0.0, color=style.MUTED, lw=0.7, zorder=0)
    axes.set_ylim(max(count, 1) - 0.5, -0.5)
    for number in range(1, count):
        axes.axhline(number - 0.5, color=style.FAINT, lw=0.35, zorder=0)
    axes.tick_params(axis="x", labelsize=7.5)
    axes.tick_params(axis="y", length=0)
    style.open_frame(axes, also="left")


def _draw_rows(axes: Axes, change: DeflectionChange, limit: float | None) -> None:
    number, low, size, high = _grouped(change)
    axes.fill_between(number, low, high, color=_NEW, alpha=0.2, lw=0, step="mid")
    axes.step(number, size, color=_NEW, lw=1.1, where="mid")
    largest = _MM * change.largest.value
    axes.plot([change.where.row + 1], [largest], "D", ms=4.0, color=style.INK)
    top = float(high.max())
    if limit is not None:
        axes.axhline(_MM * limit, color=style.INK, lw=1.0, ls=(0, (5, 4)))
        axes.annotate(
            f"limit {_MM * limit:g} mm", (1.0, _MM * limit), (0, 2), size=7.5, ha="right",
            xycoords=("axes fraction", "data"), textcoords="offset points",
            bbox={"fc": style.PAPER, "ec": "none", "pad": 0.8, "alpha": 0.85},
        )  # fmt: skip
        top = max(top, _MM * limit)
    axes.set_ylim(0.0, 1.12 * top if top > 0.0 else 1.0)
    axes.set_xlim(0.5, change.rows + 0.5)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("Row", fontsize=8.0)
    axes.set_ylabel("Change of predicted\ndeflection in mm", fontsize=8.0)
    axes.tick_params(labelsize=8.0)
    style.open_frame(axes)


def _grouped(change: DeflectionChange) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return row numbers from 1, lower ends, sizes and upper ends in mm; groups by extremes."""
    count = change.rows
    starts = np.arange(0, count, -(-count // _MOST_POINTS))
    low = np.minimum.reduceat(change.low, starts)
    size, high = (np.maximum.reduceat(each, starts) for each in (change.size, change.high))
    middle = 0.5 * (starts + np.append(starts[1:], count) - 1) + 1.0
    return middle, _MM * low, _MM * size, _MM * high


def _over_chance(together: Estimate) -> float:
    """Return a change over the half-width of its interval; infinite where that is 0."""
    half = 0.5 * (together.high - together.low)
    if half > 0.0:
        return together.value / half
    return float(np.sign(together.value) * np.inf) if together.value != 0.0 else 0.0


def _draw_frame(figure: style.Page, found: CompareSummary) -> None:
    height = figure.get_size_inches()[1]
    figure.add_title(_title(found), 0.15)
    figure.text(
        0.15 / _WIDTH, 1.0 - 0.36 / height, literal("\n".join(wrapped(_found(found), 115))),
        va="top", fontsize=8.5, linespacing=1.3,
    )  # fmt: skip
    handles = [
        Line2D([], [], color=_OLD, marker="o", ms=3.4, lw=1.3, label="old"),
        Line2D([], [], color=_NEW, marker="D", ms=3.4, lw=1.3, label="new"),
    ]
    figure.legend(
        handles=handles, loc="lower left", ncols=2, frameon=False, fontsize=8.0,
        bbox_to_anchor=(_LEFT / _WIDTH, 1.0 - (_HEAD - 0.02) / height), borderaxespad=0.0,
    )  # fmt: skip
    description = (
        "Lines and bands: 95 % intervals. Grey: changes that both calibrations' uncertainty"
        f" explains, for all {len(found.springs)} comparisons at once with 95 %. Bold: moved."
        " Sums of springs stand for springs that cannot be told apart."
    )
    if found.deflection is not None:
        description += " Below: norm of the change at each row; the black mark is the largest."
    figure.add_caption("\n".join(wrapped(description, 125)), 0.15, 7.5, 1.3)


def _title(found: CompareSummary) -> str:
    return f"{found.robot}: two calibrations compared"


def _found(found: CompareSummary) -> str:
    """Return the finding in a sentence or two."""
    names = ", ".join(found.moved)
    verb = "moved" if found.same_springs else "differ"
    springs = f"{verb.capitalize()}: {names}." if names else f"No compared spring {verb}."
    if not found.springs_judged:
        springs = "Springs are not judged: the campaigns were made at other poses or loads."
    judged = found.verdict_sentence.removesuffix(".").partition(";")[0]
    return springs if found.limit is None else f"{springs} {judged}."


def _short(name: str) -> str:
    """Return the name of a sum without what its springs' names have in common."""
    return name.replace("joint_", "") if " " in name else name
