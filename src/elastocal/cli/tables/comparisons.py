"""Print what ``codec``, ``study`` and ``compare`` found: verdicts in words, a table, the advice.

Side by side stand variants of a calibration, samples of a cell, and two calibrations of one cell.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from elastocal.cli.output import bold, green, print_remarks, red, yellow
from elastocal.codec import CodecSummary
from elastocal.codec.study import Share, StudySummary, micrometres, value_text
from elastocal.elastic import unit_of
from elastocal.errors import present

if TYPE_CHECKING:
    from elastocal.identification.recertification import (
        CompareResult,
        CompareSummary,
        Estimate,
        SpringChange,
    )

_MOST_SIZES = 12


def show_codec(console: Console, result: CodecSummary, out: Path, names: Sequence[str]) -> None:
    """Print the verdicts of a codec."""
    console.print(f"{bold(result.robot)}: {result.settings.sentence}")
    for sentence in result.springs:
        console.print(sentence)
    console.print(_codec_table(result))
    for sentence in result.sentences:
        console.print(sentence)
    print_remarks(console, "note", result.findings)
    console.print(f"\n{', '.join(names)} written to {bold(str(out))}")


def _codec_table(result: CodecSummary) -> Table:
    """Return the median errors at held-out poses, for some numbers of training poses."""
    table = Table(box=None, pad_edge=False, title="error norm at held-out poses, µm: mean / max")
    table.add_column("training poses", justify="right")
    for name in result.variants:
        table.add_column(name, justify="right")
    curves = list(result.variants.values())
    sizes = len(curves[0].n_train)
    for k in np.unique(np.linspace(0, sizes - 1, min(sizes, _MOST_SIZES)).round().astype(int)):
        cells = [
            f"{1e6 * each.error_mean[k]:.1f} / {1e6 * each.error_max[k]:.1f}" for each in curves
        ]
        table.add_row(str(curves[0].n_train[k]), *cells)
    return table


_MOST_CONDITIONS = 40
_CAPTION = (
    "mean and largest error at unseen poses in µm: median over the arms, and what 95 % of them stay"
    " below; good: arms within the target, with a 95 % interval"
)


def show_study(console: Console, summary: StudySummary, out: Path, names: Sequence[str]) -> None:
    """Print what a study says."""
    console.print(f"{bold(summary.cell)}: {summary.sentence}")
    console.print(_study_table(summary))
    if len(summary.conditions) > _MOST_CONDITIONS:
        console.print(f"{len(summary.conditions) - _MOST_CONDITIONS} more conditions in study.json")
    if summary.advice:
        console.print(summary.advice)
    console.print(f"\n{', '.join(names)} written to {bold(str(out))}")


def _study_table(summary: StudySummary) -> Table:
    factors = summary.varied or ("poses",)
    table = Table(caption=_CAPTION, box=SIMPLE, pad_edge=False, padding=(0, 1, 0, 0))
    titles = [name.replace("_", " ") for name in factors]
    titles += ["mean", "95 %", "largest", "95 %"]
    titles += [] if summary.target is None else ["mean good", "largest good"]
    for number, title in enumerate(titles):
        longest = max(map(len, title.split()))
        table.add_column(title, justify="right", no_wrap=number >= len(factors), min_width=longest)
    for each in summary.conditions[:_MOST_CONDITIONS]:
        cells = [value_text(each.factors.value(key)) for key in factors]
        for found in (each.error_mean, each.error_max):
            cells += [micrometres(found.median), micrometres(found.q95)]
        if summary.target is not None:
            cells += [_share(each.mean_reaches), _share(each.max_reaches)]
        table.add_row(*cells)
    return table


def _share(share: Share | None) -> str:
    share = present(share, "share")
    return f"{share.share:.0%} [{100 * share.low:.0f}, {100 * share.high:.0f}]"


_USUAL_UNIT = unit_of("rad/(N*m)")
"""The unit of most springs stands in the heading; other springs name their own."""
_COLOURS = {"pass": green, "fail": red, "undecided": yellow}


def show_comparison(console: Console, compared: "CompareResult", hint: Path | None = None) -> None:
    """Print a comparison for a person.

    Parameters
    ----------
    console : Console
        Where.
    compared : CompareResult
        The comparison.
    hint : Path, optional
        A dataset that could serve as rows.
    """
    found = compared.summary
    for name, rows in (("rows", compared.rows), ("calibrated readings", compared.calibrated)):
        if rows is not None:
            console.print(f"{rows.sentence(name)}\n", soft_wrap=True)
    console.print(f"{bold(found.robot)}: {_moved(found)}")
    if found.springs:
        _show_changes(console, found)
    for names, which in ((found.only_old, "old"), (found.only_new, "new")):
        if names:
            console.print(f"only in the {which} model: {', '.join(names)}", soft_wrap=True)
    if found.not_compared:
        console.print(f"not determined by both: {', '.join(found.not_compared)}")
    _show_verdict(console, found, hint)
    for note in found.notes:
        console.print(f"{yellow('note:')} {note}", soft_wrap=True)


def _show_changes(console: Console, found: "CompareSummary") -> None:
    """Print a row for each spring that is soft in one calibration at least, and what it says."""
    rigid = [each for each in found.springs if each.old.value == each.new.value == 0.0]
    soft = [each for each in found.springs if each not in rigid]
    sums = {each.name: f"sum {n}" for n, each in enumerate(_sums(soft), start=1)}
    console.print(_change_table(soft, sums))
    for name, short in sums.items():
        console.print(f"   {short}: {name}", soft_wrap=True)
    if rigid:
        console.print(f"rigid in both: {', '.join(each.name for each in rigid)}")
    console.print(
        f"the interval holds for all {len(found.springs)} comparisons at once with 95 %"
        + ("; what has 0 outside it moved" if found.springs_judged else ""),
        soft_wrap=True,
    )


def _moved(found: "CompareSummary") -> str:
    if found.unmoved_sentence:
        return found.unmoved_sentence
    names = ", ".join(each.label for each in found.moved_springs)
    return f"{red(bold(found.verb))}: {names}"


def _sums(changes: "Sequence[SpringChange]") -> "list[SpringChange]":
    return [each for each in changes if len(each.terms) > 1]


def _change_table(changes: "Sequence[SpringChange]", sums: dict[str, str]) -> Table:
    """Return a row a spring, the one that moved in red; other units stand behind the name."""
    table = Table(box=None, pad_edge=False)
    table.add_column(f"compliance, {_USUAL_UNIT.shown}", no_wrap=True)
    for heading in ("old", "new", "change", "95 %, all at once"):
        table.add_column(heading, justify="right", no_wrap=True)
    for change in changes:
        unit = unit_of(change.unit)
        name = sums.get(change.name, change.name)
        name += "" if unit == _USUAL_UNIT else f", {unit.shown}"
        table.add_row(
            name,
            f"{unit.factor * change.old.value:.3f}",
            f"{unit.factor * change.new.value:.3f}",
            f"{unit.factor * change.difference.value:+.3f}",
            _between(change.together, unit.factor),
            style="red" if change.moved else "",
        )
    return table


def _between(estimate: "Estimate", factor: float) -> str:
    return f"{factor * estimate.low:+.3f} … {factor * estimate.high:+.3f}"


def _show_verdict(console: Console, found: "CompareSummary", hint: Path | None) -> None:
    if found.limit is None:
        return
    if found.verdict is None:
        asked = "give them with --rows"
        if hint is not None:
            asked += f", e.g. {hint}, which the new model states it was calibrated on"
        console.print(f"{yellow('no verdict:')} {found.reason}; {asked}", soft_wrap=True)
        return
    colour = _COLOURS[found.verdict]
    console.print(f"{bold(colour(found.verdict.value))}: {found.reason}", soft_wrap=True)
