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
from elastocal.report.document import blocks
from elastocal.report.plots import recertification_figure
from elastocal.verdict import Evidence
from elastocal.wording import mm

_WORDS = {
    Verdict.PASS: "Passed:",
    Verdict.FAIL: "Failed:",
    Verdict.UNDECIDED: "Not decided:",
    None: "Not judged:",
}


def _body(evidence: Evidence) -> Iterator[blocks.Block]:
    found = evidence.recertification
    if found is None:
        yield blocks.Paragraph(
            "This calibration was not compared with an earlier one, so nothing is said of how"
            " the cell changed."
        )
        return
    yield blocks.Paragraph(f"{_WORDS[found.verdict]} {found.reason}. {_moved(found)}", "sentence")
    if found.deflection is not None:
        yield _deflections(found.deflection, found.limit)
    yield _springs(found)
    yield blocks.picture(
        partial(recertification_figure, found),
        f"Springs of both calibrations with their intervals, and the change of deflection."
        f" {_moved(found)} {found.reason}",
        "Round: the earlier calibration; diamonds: this one. What lies outside the grey band moved"
        " beyond what both calibrations leave open.",
    )
    # The origin of the readings is a path; where a folder lies is no part of a report.
    origin = f" ({found.old_provenance})"
    yield blocks.Bullets(tuple(note.replace(origin, "") for note in found.notes))


def _moved(found: CompareSummary) -> str:
    names = ", ".join(found.moved)
    if not names:
        return "No compared spring moved beyond its interval."
    return f"Moved beyond their intervals: {names}."


def _deflections(change: DeflectionChange, limit: float | None) -> blocks.Block:
    return blocks.Facts(
        (
            ("Poses and forces compared", change.rows),
            ("Change, mean", _span(change.mean)),
            ("Change, largest", _span(change.largest)),
            ("Limit", "none given" if limit is None else mm(limit)),
        )
    )


def _springs(found: CompareSummary) -> blocks.Block:
    rows = tuple(
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
    )
    heads = ("Spring or sum", "", "Old", "New", "Change", "95 %, all at once", "Unit")
    return blocks.Table("Springs and sums that both calibrations determine", heads, rows, texts=2)


def _span(found: Estimate) -> str:
    return f"{mm(found.value)} ({mm(found.low)} to {mm(found.high)})"


RECERTIFICATION = blocks.Section("recertification", "Change since the last calibration", 80, _body)
