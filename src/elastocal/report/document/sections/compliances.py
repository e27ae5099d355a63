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
from elastocal.wording import Phrase, lengths_with_interval, mm, phrase, phrases, sentences


def _compliances(evidence: Evidence) -> Iterator[blocks.Block]:
    found = evidence.calibrated
    if found is None:
        yield blocks.Paragraph(phrase("There is no calibrated model, so no compliance is known."))
        return
    settings = found.figures.settings if found.figures else None
    springs = spring_bars(found.model, settings)
    observable = sum(each.is_own for each in springs)
    yield _head(found, observable, len(springs))
    yield from _ladder(found.figures)
    yield blocks.Picture(
        partial(spring_figure, springs),
        phrase(
            "Compliances of {springs} springs with 95 % intervals; {open} of them have no value of"
            " their own",
            springs=len(springs),
            open=len(springs) - observable,
        ),
        phrase(
            "Filled: told by the readings, with its 95 % interval, which may be wide. Hollow: not"
            " told by itself; the number is the smallest one that explains the readings."
        ),
    )
    heads = phrases("Spring", "Known?", "Compliance", "95 % interval", "Unit", "Stiffness")
    yield blocks.Table(phrase("Compliances"), heads, tuple(map(_row, springs)), texts=2)
    yield from _not_told_apart(found, springs)
    yield from _budget(found.figures)


def _row(spring: SpringBar) -> blocks.Row:
    name, unit, value = spring.name, spring.unit, spring.value
    if spring.group is not None:
        known: str = phrase("not by itself, group {group}", group=spring.group)
        return name, known, f"({value:.4f})", _NONE, unit.shown, _NONE
    if spring.too_weak:
        return name, phrase("too weak to see"), f"({value:.4f})", _NONE, unit.shown, _NONE
    stiff = f"{1.0 / value:.3f} {unit.stiffness}" if value > 0.0 else phrase("rigid")
    if not unit.stiffness or value < 0.0:
        stiff = _NONE
    known = phrase("at its bound") if spring.at_bound else phrase("zero")
    if not (spring.low <= value <= spring.high or spring.at_bound):
        known = phrase("outside its interval: do not use, the file may have been changed")
    elif value != 0.0 and not spring.at_bound:
        half = (spring.high - spring.low) / 2 / abs(value)
        known = (
            phrase("{share}", share=f"±{half:.0%}")
            if half <= 1.0
            else phrase("hardly: ±{share}", share=f"{half:.0%}")
            if half <= _MOST_SAID
            else phrase("hardly: more than ±{share}", share=f"{_MOST_SAID:.0%}")
        )
    span = phrase("{low} to {high}", low=f"{spring.low:.3f}", high=f"{spring.high:.3f}")
    return name, known, f"{value:.4f}", span, unit.shown, stiff


def _head(found: ModelEvidence, observable: int, values: int) -> blocks.Block:
    seen, figures = found.model.observability, found.figures
    residual = mm(figures.residual.mean) if figures else phrase("not known")
    return blocks.Facts(
        (
            (phrase("Tool"), found.model.tool_name),
            (phrase("Numbers that the fit found, friction included"), seen.parameters),
            (
                phrase("Values with an interval of their own"),
                phrase("{rank} of {all}", rank=observable, all=values),
            ),
            (
                phrase("Combinations of them that the readings tell (rank)"),
                phrase("{rank} of {all}", rank=seen.rank, all=seen.parameters),
            ),
            (
                phrase("Condition number (large: single springs are hardly told apart)"),
                f"{seen.condition:.0f}",
            ),
            (phrase("Bootstrap draws"), len(found.model.draws)),
            (phrase("Residual at the poses fitted, mean"), residual),
        )
    )


def _ladder(figures: CalibrationSummary | None) -> Iterator[blocks.Block]:
    """Yield the models that were tried on the same left-out poses."""
    if figures is None or len(figures.ladder) < 2:
        return
    yield blocks.Heading(phrase("Which model the readings carry"))
    yield blocks.Table(
        phrase("Models at the same left-out poses"),
        (
            *phrases("Springs", "Numbers", "Error at left-out poses"),
            phrase("Worse than the best by (95 %)"),
            "",
        ),
        tuple(
            (
                rung.springs,
                str(rung.parameters),
                mm(rung.held_out),
                phrase(
                    "{value} ({low} to {high})",
                    value=mm(rung.difference.mean),
                    low=mm(rung.difference.low),
                    high=mm(rung.difference.high),
                ),
                phrase("taken") if rung.chosen else "",
            )
            for rung in figures.ladder
        ),
    )
    yield blocks.Paragraph(
        phrase(
            "By how much one is worse is the mean over poses of paired differences; poses far from"
            " all others do not count, and the low load is left out with each pose. So it is not"
            " the difference of the errors beside it."
        ),
        "sub",
    )


def _budget(figures: CalibrationSummary | None) -> Iterator[blocks.Block]:
    """Yield what the error at left-out poses is made of, where ``calibrate`` was asked."""
    if figures is None or figures.budget is None:
        return
    yield blocks.Heading(phrase("What the error is made of"))
    yield blocks.Table(
        phrase("Parts of the root mean square error at left-out poses, which add up in quadrature"),
        phrases("Part", "Error", "95 % interval in mm", "Known from"),
        tuple(
            (name, *lengths_with_interval(part.error, part.low, part.high), part.source)
            for name, part in figures.budget.parts
        ),
    )
    yield blocks.Table(
        phrase("What each term takes away, likewise; below zero where it adds"),
        (*phrases("Term", "In the model", "Takes away", "95 % interval in mm"), ""),
        tuple(
            (
                term.label,
                phrase("yes") if term.taken else phrase("no"),
                *lengths_with_interval(term.worth, term.low, term.high),
                term.reason or "",
            )
            for term in figures.budget.terms
        ),
    )


def _not_told_apart(found: ModelEvidence, springs: list[SpringBar]) -> Iterator[blocks.Block]:
    seen = found.model.observability
    yield blocks.Paragraph(
        phrase(
            "{own} of {all} values have an interval of their own, {bound} of these lie at their"
            " bound; {weak} are too weak to see. Do not use single values: what they predict"
            " together was tested, and nothing else.",
            own=sum(each.is_own for each in springs),
            all=len(springs),
            bound=sum(each.at_bound for each in springs if each.is_own),
            weak=sum(each.too_weak for each in springs),
        )
    )
    if not seen.unobservable:
        return
    attainable = found.figures.rank_attainable if found.figures else seen.rank
    missing = attainable - seen.rank
    yield blocks.Heading(phrase("What cannot be told apart"))
    yield blocks.Paragraph(
        phrase(
            "These combinations change no deflection under a force, so their springs have no value"
            " of their own. Predictions do not need one."
        )
        if missing <= 0
        else phrase(
            "{missing} more directions could be seen with other poses or load cases, so that not"
            " all of these combinations are harmless.",
            missing=missing,
        )
    )
    groups = enumerate(map(describe_briefly, seen.unobservable), start=1)
    yield blocks.Bullets(
        tuple(phrase("Group {number}: {springs}", number=n, springs=each) for n, each in groups)
    )


_NONE = phrase("none")
_MOST_SAID = 10.0
"""Half an interval by its value, from which on its size says nothing more."""
COMPLIANCES = blocks.Section(
    "compliances",
    phrase("Compliances"),
    phrase("How soft is the robot, and what can be told apart?"),
    50,
    _compliances,
)


_WORDS = {
    Verdict.PASS: phrase("Passed:"),
    Verdict.FAIL: phrase("Failed:"),
    Verdict.UNDECIDED: phrase("Not decided:"),
    None: phrase("Not judged:"),
}


def _recertification(evidence: Evidence) -> Iterator[blocks.Block]:
    found = evidence.recertification
    if found is None:
        yield blocks.Paragraph(
            phrase(
                "This calibration was not compared with an earlier one, so nothing is said of how"
                " the cell changed."
            )
        )
        return
    yield blocks.Paragraph(
        sentences([_WORDS[found.verdict], f"{found.reason}.", _moved_springs(found)]), "sentence"
    )
    if found.deflection is not None:
        yield _deflections(found.deflection, found.limit)
    yield _change_table(found)
    yield blocks.Picture(
        partial(recertification_figure, found),
        phrase(
            "Springs of both calibrations with their intervals, and the change of deflection."
            " {moved}",
            moved=_moved_springs(found),
        ),
        phrase(
            "Round: the earlier calibration; diamonds: this one. What lies outside the grey band"
            " moved beyond what both calibrations leave open."
        ),
    )
    # The origin of the readings is a path; where a folder lies is no part of a report.
    origin = f" ({found.old_provenance})"
    yield blocks.Bullets(tuple(note.replace(origin, "") for note in found.notes))


def _moved_springs(found: CompareSummary) -> Phrase:
    names = ", ".join(found.moved)
    if not found.springs_judged and found.ground is not None:
        return phrase("{sentence}", sentence=f"{found.ground.sentence.capitalize()}.")
    if not names:
        return phrase("No compared spring moved beyond its interval.")
    return phrase("Moved beyond their intervals: {names}.", names=names)


def _deflections(change: DeflectionChange, limit: float | None) -> blocks.Block:
    return blocks.Facts(
        (
            (phrase("Poses and forces compared"), change.rows),
            (phrase("Change, mean"), _span(change.mean)),
            (phrase("Change, largest"), _span(change.largest)),
            (phrase("Limit"), phrase("none given") if limit is None else mm(limit)),
        )
    )


def _change_table(found: CompareSummary) -> blocks.Block:
    rows = tuple(
        (
            each.name,
            phrase("moved") if each.moved else "",
            f"{unit.factor * each.old.value:.4f}",
            f"{unit.factor * each.new.value:.4f}",
            f"{unit.factor * each.difference.value:+.4f}",
            phrase(
                "{low} to {high}",
                low=f"{unit.factor * each.together.low:+.3f}",
                high=f"{unit.factor * each.together.high:+.3f}",
            ),
            unit.shown,
        )
        for each, unit in ((each, unit_of(each.unit)) for each in found.springs)
    )
    first, *others = phrases("Spring or sum", "Old", "New", "Change", "95 %, all at once", "Unit")
    caption = phrase("Springs and sums that both calibrations determine")
    return blocks.Table(caption, (first, "", *others), rows, texts=2)


def _span(found: Estimate) -> Phrase:
    return phrase(
        "{value} ({low} to {high})", value=mm(found.value), low=mm(found.low), high=mm(found.high)
    )


RECERTIFICATION = blocks.Section(
    "recertification",
    phrase("Change since the last calibration"),
    phrase("What changed since last time?"),
    80,
    _recertification,
)
