"""The calibration against an earlier one of the same cell."""

from collections.abc import Iterator
from functools import partial

from elastocal.elastic import unit_of
from elastocal.identification.recertification import (
    CompareSummary,
    DeflectionChange,
    Estimate,
    Verdict,
)
from elastocal.report.document.markup import facts, listed, paragraph, table
from elastocal.report.document.parts import Parts
from elastocal.report.document.pictures import picture
from elastocal.report.document.section import Content, Finding, Section
from elastocal.report.plots import (
    recertification_figure,
)
from elastocal.wording import counted, mm


def body(parts: Parts) -> Content:
    """Return the section."""
    found = parts.recertification
    if found is None:
        return Content(
            paragraph(
                "This calibration was not compared with an earlier one, so nothing is said of how"
                " the cell changed."
            )
        )
    html = paragraph(_sentence(found), "sentence")
    if found.deflection is not None:
        html += _deflections(found.deflection, found.limit)
    html += _springs(found)
    html += picture(
        partial(recertification_figure, found),
        f"Springs of both calibrations with their intervals, and the change of deflection."
        f" {_moved(found)} {found.reason}",
        "Round: the earlier calibration; diamonds: this one. What lies outside the grey band moved"
        " beyond what both calibrations leave open.",
    )
    return Content(html + listed(_notes(found)), findings=tuple(_findings(found)))


def _sentence(found: CompareSummary) -> str:
    words = {
        Verdict.PASS: "Passed:",
        Verdict.FAIL: "Failed:",
        Verdict.UNDECIDED: "Not decided:",
        None: "Not judged:",
    }
    return f"{words[found.verdict]} {found.reason}. {_moved(found)}"


def _moved(found: CompareSummary) -> str:
    names = ", ".join(found.moved)
    if not names:
        return "No compared spring moved beyond its interval."
    return f"Moved beyond their intervals: {names}."


def _deflections(change: DeflectionChange, limit: float | None) -> str:
    return facts(
        [
            ("Poses and forces compared", change.rows),
            ("Change, mean", _span(change.mean)),
            ("Change, largest", _span(change.largest)),
            ("Limit", "none given" if limit is None else mm(limit)),
        ]
    )


def _springs(found: CompareSummary) -> str:
    rows = [
        (
            each.name,
            "moved" if each.moved else "",
            f"{unit.factor * each.old.value:.4f}",
            f"{unit.factor * each.new.value:.4f}",
            f"{unit.factor * each.difference.value:+.4f}",
            f"{unit.factor * each.together.low:+.3f} to {unit.factor * each.together.high:+.3f}",
            unit.shown,
        )
        for each, unit in ((each, unit_of(each.unit)) for each in found.springs)
    ]
    heads = ("Spring or sum", "", "Old", "New", "Change", "95 %, all at once", "Unit")
    return table("Springs and sums that both calibrations determine", heads, rows, texts=2)


def _notes(found: CompareSummary) -> Iterator[str]:
    # The origin of the readings is a path; where a folder lies is no part of a report.
    for note in found.notes:
        yield note.replace(f" ({found.old_provenance})", "")


def _findings(found: CompareSummary) -> Iterator[Finding]:
    if found.verdict is Verdict.PASS:
        yield Finding(f"against the earlier calibration: {found.reason}", holds_back=False)
    elif found.verdict is not None:
        yield Finding(f"against the earlier calibration: {found.reason}")
    elif found.moved:
        yield Finding(
            f"{counted(len(found.moved), 'spring')} moved since the earlier calibration, and no"
            " limit was given",
            holds_back=False,
        )


def _span(found: Estimate) -> str:
    return f"{mm(found.value)} ({mm(found.low)} to {mm(found.high)})"


SECTION = Section("recertification", "Change since the last calibration", body)
