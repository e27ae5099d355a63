"""Compliances with intervals, and what the readings tell apart."""

from collections.abc import Iterator
from functools import partial

from elastocal.identification import CalibrationSummary, Term, describe
from elastocal.report.document import blocks
from elastocal.report.plots import SpringBar, spring_bars, spring_figure
from elastocal.verdict import Evidence, ModelEvidence
from elastocal.wording import mm

_MOST_TERMS = 6


def _body(evidence: Evidence) -> Iterator[blocks.Block]:
    found = evidence.calibrated
    if found is None:
        yield blocks.Paragraph("There is no calibrated model, so no compliance is known.")
        return
    springs = spring_bars(found.model)
    observable = sum(each.group is None for each in springs)
    yield _head(found, observable)
    yield from _comparison(found.figures)
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


def _row(spring: SpringBar) -> blocks.Row:
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


def _head(found: ModelEvidence, observable: int) -> blocks.Block:
    seen, figures = found.model.observability, found.figures
    residual = mm(figures.residual.mean) if figures else "not known"
    return blocks.Facts(
        (
            ("Springs", seen.springs),
            ("Known by themselves", observable),
            ("Rank", f"{seen.rank} of {seen.springs}"),
            ("Condition number", f"{seen.condition:.0f}"),
            ("Bootstrap draws", len(found.model.draws)),
            ("Residual at the poses fitted, mean", residual),
        )
    )


def _comparison(figures: CalibrationSummary | None) -> Iterator[blocks.Block]:
    other = figures.comparison if figures else None
    if other is None:
        return
    low, high = other.difference.low, other.difference.high
    judged = (
        "more springs are better" if low > 0.0
        else "fewer springs are better" if high < 0.0
        else "the poses do not decide"
    )  # fmt: skip
    yield blocks.Paragraph(
        f"With one axial spring a joint alone the error at left-out poses is"
        f" {mm(other.held_out.mean)} on average: {1e3 * other.difference.mean:+.3f} mm"
        f" ({1e3 * low:+.3f} to {1e3 * high:+.3f}, 95 %); {judged}."
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
    groups = enumerate(seen.unobservable, start=1)
    yield blocks.Bullets(tuple(f"Group {number}: {_described(group)}" for number, group in groups))


def _described(group: tuple[Term, ...]) -> str:
    return describe(group) if len(group) <= _MOST_TERMS else f"{len(group)} springs mixed"


COMPLIANCES = blocks.Section("compliances", "Compliances", 50, _body)
