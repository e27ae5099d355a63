"""Compliances with intervals, and what the readings tell apart."""

from collections.abc import Iterator
from functools import partial
from typing import Any

from elastocal.elastic import spring_units
from elastocal.identification import Term, describe
from elastocal.report.document.markup import facts, heading, listed, paragraph, table
from elastocal.report.document.parts import Calibrated, Parts
from elastocal.report.document.pictures import picture
from elastocal.report.document.section import Content, Finding, Section
from elastocal.report.plots import (
    SpringBar,
    spring_figure,
)
from elastocal.wording import mm

Figures = dict[str, Any]
_MOST_TERMS = 6


def body(parts: Parts) -> Content:
    """Return the section."""
    if parts.calibrated is None:
        return Content(paragraph("There is no calibrated model, so no compliance is known."))
    groups = _groups(parts.calibrated)
    springs = list(_springs(parts.calibrated, groups))
    observable = sum(each["group"] is None for each in springs)
    html = _head(parts.calibrated, observable) + _comparison(parts.calibrated.figures)
    panels = [
        (unit.shown, [_bar(each) for each in springs if each["unit"] == unit])
        for unit in spring_units()
    ]
    html += picture(
        partial(spring_figure, [panel for panel in panels if panel[1]]),
        f"Compliances of {len(springs)} springs with 95 % intervals; {len(springs) - observable} of"
        " them have no value of their own",
        "Filled: known by itself, with its 95 % interval. Hollow: not known by itself; the number"
        " is the smallest one that explains the readings.",
    )
    heads = ("Spring", "Known?", "Compliance", "95 % interval", "Unit", "Stiffness")
    html += table("Compliances", heads, [_row(each) for each in springs], texts=2)
    return Content(html + _told(parts.calibrated), findings=tuple(_findings(parts.calibrated)))


def _groups(found: Calibrated) -> dict[str, int]:
    """Return the number of the first group that each spring is mixed up in, by its name."""
    numbered = list(enumerate(found.model.observability.unobservable, start=1))
    return {term.spring: number for number, group in reversed(numbered) for term in group}


def _springs(found: Calibrated, groups: dict[str, int]) -> Iterator[Figures]:
    low, high = found.model.interval()
    for k, parameter in enumerate(found.model.model.parameters):
        by_itself = found.model.observability.observable[k]
        unit = parameter.unit
        yield {
            "name": parameter.name,
            "unit": unit,
            "value": unit.factor * float(found.model.compliance[k]),
            "low": unit.factor * float(low[k]),
            "high": unit.factor * float(high[k]),
            "group": None if by_itself else groups.get(parameter.name, 0),
        }


def _bar(each: Figures) -> SpringBar:
    return SpringBar(*(each[key] for key in ("name", "value", "low", "high", "group")))


def _row(each: Figures) -> tuple[str, ...]:
    name, unit, value = each["name"], each["unit"].shown, each["value"]
    if each["group"] is not None:
        return name, f"not by itself, group {each['group']}", f"({value:.4f})", "none", unit, "none"
    stiff = f"{1.0 / value:.3f} {each['unit'].stiffness}" if value > 0.0 else "rigid"
    stiff = stiff if each["unit"].stiffness else ""
    known = "at its bound"
    if value > 0.0:
        known = f"±{(each['high'] - each['low']) / 2 / value:.0%}"
    span = f"{each['low']:.3f} to {each['high']:.3f}"
    return name, known, f"{value:.4f}", span, unit, stiff


def _head(found: Calibrated, observable: int) -> str:
    figures, seen = found.figures, found.model.observability
    fit = figures.get("residual", {})
    return facts(
        [
            ("Springs", seen.springs),
            ("Known by themselves", observable),
            ("Rank", f"{seen.rank} of {seen.springs}"),
            ("Condition number", f"{seen.condition:.0f}"),
            ("Bootstrap draws", len(found.model.draws)),
            ("Residual at the poses fitted, mean", mm(fit["mean"]) if fit else "not known"),
        ]
    )


def _comparison(figures: Figures) -> str:
    other = figures.get("comparison")
    if not other:
        return ""
    difference = other["difference"]
    low, high = difference["low"], difference["high"]
    said = (
        "more springs are better" if low > 0.0
        else "fewer springs are better" if high < 0.0
        else "the poses do not decide"
    )  # fmt: skip
    return paragraph(
        f"With one axial spring a joint alone the error at left-out poses is"
        f" {mm(other['held_out']['mean'])} on average: {1e3 * difference['mean']:+.3f} mm"
        f" ({1e3 * low:+.3f} to {1e3 * high:+.3f}, 95 %); {said}."
    )


def _told(found: Calibrated) -> str:
    seen = found.model.observability
    if not seen.unobservable:
        return paragraph("Every spring is observable by itself.")
    missing = int(found.figures.get("rank_attainable", seen.rank)) - seen.rank
    meaning = (
        "These combinations change no deflection under a force, so their springs have no value of"
        " their own. Predictions do not need one."
        if missing <= 0
        else f"{missing} more directions could be seen with other poses or load cases, so that not"
        " all of these combinations are harmless."
    )
    lines = [
        f"Group {number}: {_described(group)}"
        for number, group in enumerate(seen.unobservable, start=1)
    ]
    return heading("What cannot be told apart") + paragraph(meaning) + listed(lines)


def _described(group: tuple[Term, ...]) -> str:
    return describe(group) if len(group) <= _MOST_TERMS else f"{len(group)} springs mixed"


def _findings(found: Calibrated) -> Iterator[Finding]:
    other = found.figures.get("comparison")
    if other and other["difference"]["high"] < 0.0:
        yield Finding(
            "axial springs alone predict left-out poses better than this layout",
            advice="Calibrate with `--springs actuated`: these poses do not carry more springs.",
        )
    if not any("." in s.name and not s.name.endswith(".axial") for s in found.model.model.springs):
        yield Finding(
            "the model has one axial spring a joint and no bearing springs",
            holds_back=False,
            advice="Calibrate with `--springs bearing` (18 springs on a 6-axis arm) and compare.",
        )


SECTION = Section("compliances", "Compliances", body)
