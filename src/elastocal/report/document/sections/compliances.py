"""Section: compliances with intervals, determined combinations, and changes since last time."""

from collections.abc import Iterator
from functools import partial

from elastocal import blocks
from elastocal.identification import (
    CalibrationSummary,
    condition_text,
    show_budget,
    show_contact,
    show_encoders,
    show_ladder,
    show_sums,
    show_unseen,
    spring_summaries,
    spring_table,
    sum_summaries,
)
from elastocal.identification.recertification import show_comparison
from elastocal.report.document.section import Section
from elastocal.report.plots import recertification_figure, spring_bars, spring_figure
from elastocal.verdict import Evidence, ModelEvidence
from elastocal.wording import mm, phrase


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
    known = found.figures.known if found.figures else ()
    rows, seen = spring_summaries(found.model, settings, known), found.model.observability
    yield spring_table(rows)
    attainable = found.figures.rank_attainable if found.figures else seen.rank
    ranks = seen.rank, attainable, seen.parameters
    yield from show_unseen(rows, (seen.unobservable, seen.hidden), ranks, seen.condition)
    yield from show_sums(sum_summaries(found.model))
    if found.figures:
        yield from show_contact(found.figures.contact)
        yield from show_encoders(found.figures.encoders, found.figures.held_out.mean)
    yield from show_budget(found.figures.budget if found.figures else None)


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
                condition_text(seen.condition),
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
    yield from show_ladder(figures.ladder)
    yield blocks.Paragraph(
        phrase(
            "By how much one is worse is the mean over poses of paired differences; poses far from"
            " all others do not count, and the low load is left out with each pose. So it is not"
            " the difference of the errors beside it."
        ),
        "sub",
    )


COMPLIANCES = Section(
    "compliances",
    phrase("Compliances"),
    phrase("How soft is the robot, and what can be told apart?"),
    50,
    _compliances,
)


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
    yield from show_comparison(found)
    yield blocks.Picture(
        partial(recertification_figure, found),
        phrase(
            "Springs of both calibrations with their intervals, and the change of deflection."
            " {moved}",
            moved=found.moved_sentence,
        ),
        phrase(
            "Round: the earlier calibration; diamonds: this one. What lies outside the grey band"
            " moved beyond what both calibrations leave open."
        ),
    )
    yield blocks.Bullets(found.notes)


RECERTIFICATION = Section(
    "recertification",
    phrase("Change since the last calibration"),
    phrase("What changed since last time?"),
    80,
    _recertification,
)
