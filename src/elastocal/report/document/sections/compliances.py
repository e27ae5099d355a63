"""Compliances with intervals, what the readings tell apart, and what changed since last time."""

from collections.abc import Iterator
from functools import partial

from elastocal.elastic import unit_of
from elastocal.identification import CalibrationSummary, describe_briefly
from elastocal.identification.recertification import (
    CompareSummary,
    DeflectionChange,
    Estimate,
    Verdict,
)
from elastocal.report.document import blocks
from elastocal.report.plots import SpringBar, recertification_figure, spring_bars, spring_figure
from elastocal.verdict import Evidence, ModelEvidence
from elastocal.wording import lengths_with_interval, mm


def _compliances(evidence: Evidence) -> Iterator[blocks.Block]:
    found = evidence.calibrated
    if found is None:
        yield blocks.Paragraph("There is no calibrated model, so no compliance is known.")
        return
    settings = found.figures.settings if found.figures else None
    springs = spring_bars(found.model, settings)
    observable = sum(each.group is None and not each.too_weak for each in springs)
    yield _head(found, observable)
    yield from _ladder(found.figures)
    yield blocks.picture(
        partial(spring_figure, springs),
        f"Compliances of {len(springs)} springs with 95 % intervals; {len(springs) - observable} of"
        " them have no value of their own",
        "Filled: known by itself, with its 95 % interval. Hollow: not known by itself; the number"
        " is the smallest one that explains the readings.",
    )
    heads = ("Spring", "Known?", "Compliance", "95 % interval", "Unit", "Stiffness")
    yield blocks.Table("Compliances", heads, tuple(map(_row, springs)), texts=2)
    yield from _not_told_apart(found)
    yield from _budget(found.figures)


def _row(spring: SpringBar) -> blocks.Row:
    name, unit, value = spring.name, spring.unit, spring.value
    if spring.group is not None:
        known = f"not by itself, group {spring.group}"
        return name, known, f"({value:.4f})", "none", unit.shown, "none"
    if spring.too_weak:
        return name, "too weak to see", f"({value:.4f})", "none", unit.shown, "none"
    stiff = f"{1.0 / value:.3f} {unit.stiffness}" if value > 0.0 else "rigid"
    if not unit.stiffness or value < 0.0:
        stiff = "none"
    known = "at its bound" if spring.at_bound else "zero"
    if value != 0.0 and not spring.at_bound:
        known = f"±{(spring.high - spring.low) / 2 / abs(value):.0%}"
    span = f"{spring.low:.3f} to {spring.high:.3f}"
    return name, known, f"{value:.4f}", span, unit.shown, stiff


def _head(found: ModelEvidence, observable: int) -> blocks.Block:
    seen, figures = found.model.observability, found.figures
    residual = mm(figures.residual.mean) if figures else "not known"
    return blocks.Facts(
        (
            ("Tool", found.model.tool_name),
            ("Parameters of the springs", seen.parameters),
            ("Known by themselves", observable),
            ("Rank", f"{seen.rank} of {seen.parameters}"),
            ("Condition number", f"{seen.condition:.0f}"),
            ("Bootstrap draws", len(found.model.draws)),
            ("Residual at the poses fitted, mean", residual),
        )
    )


def _ladder(figures: CalibrationSummary | None) -> Iterator[blocks.Block]:
    """Yield the models that were tried on the same left-out poses."""
    if figures is None or len(figures.ladder) < 2:
        return
    yield blocks.Heading("Which model the readings carry")
    yield blocks.Table(
        "Models at the same left-out poses",
        ("Springs", "Numbers", "Error at left-out poses", "Worse than the best by (95 %)", ""),
        tuple(
            (
                rung.springs,
                str(rung.parameters),
                mm(rung.held_out),
                f"{mm(rung.difference.mean)} ({mm(rung.difference.low)} to"
                f" {mm(rung.difference.high)})",
                "taken" if rung.chosen else "",
            )
            for rung in figures.ladder
        ),
    )


def _budget(figures: CalibrationSummary | None) -> Iterator[blocks.Block]:
    """Yield what the error at left-out poses is made of, where ``calibrate`` was asked."""
    if figures is None or figures.budget is None:
        return
    yield blocks.Heading("What the error is made of")
    yield blocks.Table(
        "Parts of the root mean square error at left-out poses, which add up in quadrature",
        ("Part", "Error", "95 % interval in mm", "Known from"),
        tuple(
            (name, *lengths_with_interval(part.error, part.low, part.high), part.source)
            for name, part in figures.budget.parts
        ),
    )
    yield blocks.Table(
        "What each term takes away, likewise; below zero where it adds",
        ("Term", "In the model", "Takes away", "95 % interval in mm", ""),
        tuple(
            (
                term.label,
                "yes" if term.taken else "no",
                *lengths_with_interval(term.worth, term.low, term.high),
                term.reason or "",
            )
            for term in figures.budget.terms
        ),
    )


def _not_told_apart(found: ModelEvidence) -> Iterator[blocks.Block]:
    seen = found.model.observability
    if not seen.unobservable:
        yield blocks.Paragraph("Every spring is observable by itself.")
        return
    attainable = found.figures.rank_attainable if found.figures else seen.rank
    missing = attainable - seen.rank
    yield blocks.Heading("What cannot be told apart")
    yield blocks.Paragraph(
        "These combinations change no deflection under a force, so their springs have no value of"
        " their own. Predictions do not need one."
        if missing <= 0
        else f"{missing} more directions could be seen with other poses or load cases, so that not"
        " all of these combinations are harmless."
    )
    groups = enumerate(map(describe_briefly, seen.unobservable), start=1)
    yield blocks.Bullets(tuple(f"Group {number}: {group}" for number, group in groups))


COMPLIANCES = blocks.Section("compliances", "Compliances", 50, _compliances)


_WORDS = {
    Verdict.PASS: "Passed:",
    Verdict.FAIL: "Failed:",
    Verdict.UNDECIDED: "Not decided:",
    None: "Not judged:",
}


def _recertification(evidence: Evidence) -> Iterator[blocks.Block]:
    found = evidence.recertification
    if found is None:
        yield blocks.Paragraph(
            "This calibration was not compared with an earlier one, so nothing is said of how"
            " the cell changed."
        )
        return
    yield blocks.Paragraph(
        f"{_WORDS[found.verdict]} {found.reason}. {_moved_springs(found)}", "sentence"
    )
    if found.deflection is not None:
        yield _deflections(found.deflection, found.limit)
    yield _change_table(found)
    yield blocks.picture(
        partial(recertification_figure, found),
        f"Springs of both calibrations with their intervals, and the change of deflection."
        f" {_moved_springs(found)} {found.reason}",
        "Round: the earlier calibration; diamonds: this one. What lies outside the grey band moved"
        " beyond what both calibrations leave open.",
    )
    # The origin of the readings is a path; where a folder lies is no part of a report.
    origin = f" ({found.old_provenance})"
    yield blocks.Bullets(tuple(note.replace(origin, "") for note in found.notes))


def _moved_springs(found: CompareSummary) -> str:
    names = ", ".join(found.moved)
    if not found.springs_judged and found.ground is not None:
        return f"{found.ground.sentence.capitalize()}."
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


def _change_table(found: CompareSummary) -> blocks.Block:
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


RECERTIFICATION = blocks.Section(
    "recertification", "Change since the last calibration", 80, _recertification
)
