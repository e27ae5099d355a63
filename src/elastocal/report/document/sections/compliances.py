"""Compliances with intervals, and what the readings tell apart."""

from collections.abc import Iterator
from functools import partial

from elastocal.identification import CalibrationSummary, Term, describe
from elastocal.report.document.blocks import (
    Block,
    Bullets,
    Content,
    Facts,
    Heading,
    Paragraph,
    Row,
    Section,
    Table,
    picture,
)
from elastocal.report.plots import SpringBar, spring_bars, spring_figure
from elastocal.verdict import Evidence, ModelEvidence
from elastocal.wording import mm

_MOST_TERMS = 6


def _body(evidence: Evidence) -> Content:
    """Return the section."""
    if evidence.calibrated is None:
        return Content((Paragraph("There is no calibrated model, so no compliance is known."),))
    return Content(tuple(_blocks(evidence.calibrated)))


def _blocks(found: ModelEvidence) -> Iterator[Block]:
    springs = spring_bars(found.model)
    observable = sum(each.group is None for each in springs)
    yield _head(found, observable)
    yield from _ladder(found.figures)
    yield picture(
        partial(spring_figure, springs),
        f"Compliances of {len(springs)} springs with 95 % intervals; {len(springs) - observable} of"
        " them have no value of their own",
        "Filled: known by itself, with its 95 % interval. Hollow: not known by itself; the number"
        " is the smallest one that explains the readings.",
    )
    heads = ("Spring", "Known?", "Compliance", "95 % interval", "Unit", "Stiffness")
    yield Table("Compliances", heads, tuple(map(_row, springs)), texts=2)
    yield from _not_told_apart(found)


def _row(spring: SpringBar) -> Row:
    name, unit, value = spring.name, spring.unit, spring.value
    if spring.group is not None:
        known = f"not by itself, group {spring.group}"
        return name, known, f"({value:.4f})", "none", unit.shown, "none"
    stiff = f"{1.0 / value:.3f} {unit.stiffness}" if value > 0.0 else "rigid"
    if not unit.stiffness:
        stiff = "none"
    known = "at its bound"
    if value > 0.0:
        known = f"±{(spring.high - spring.low) / 2 / value:.0%}"
    span = f"{spring.low:.3f} to {spring.high:.3f}"
    return name, known, f"{value:.4f}", span, unit.shown, stiff


def _head(found: ModelEvidence, observable: int) -> Block:
    seen, figures = found.model.observability, found.figures
    residual = mm(figures.residual.mean) if figures else "not known"
    return Facts(
        (
            ("Springs", seen.springs),
            ("Known by themselves", observable),
            ("Rank", f"{seen.rank} of {seen.springs}"),
            ("Condition number", f"{seen.condition:.0f}"),
            ("Bootstrap draws", len(found.model.draws)),
            ("Residual at the poses fitted, mean", residual),
        )
    )


def _ladder(figures: CalibrationSummary | None) -> Iterator[Block]:
    """Yield the models that were tried on the same left-out poses."""
    if figures is None or len(figures.ladder) < 2:
        return
    yield Heading("Which model the readings carry")
    yield Table(
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


def _not_told_apart(found: ModelEvidence) -> Iterator[Block]:
    seen = found.model.observability
    if not seen.unobservable:
        yield Paragraph("Every spring is observable by itself.")
        return
    attainable = found.figures.rank_attainable if found.figures else seen.rank
    missing = attainable - seen.rank
    yield Heading("What cannot be told apart")
    yield Paragraph(
        "These combinations change no deflection under a force, so their springs have no value of"
        " their own. Predictions do not need one."
        if missing <= 0
        else f"{missing} more directions could be seen with other poses or load cases, so that not"
        " all of these combinations are harmless."
    )
    groups = enumerate(seen.unobservable, start=1)
    yield Bullets(tuple(f"Group {number}: {_described(group)}" for number, group in groups))


def _described(group: tuple[Term, ...]) -> str:
    return describe(group) if len(group) <= _MOST_TERMS else f"{len(group)} springs mixed"


COMPLIANCES = Section("compliances", "Compliances", 50, _body)
