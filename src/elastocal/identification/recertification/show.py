"""Show a comparison of two calibrations as blocks for every shell.

Was it within the limit, how far did predictions change, and which springs moved.
"""

from collections.abc import Iterator

import numpy as np

from elastocal.blocks import Block, Bullets, Cell, Facts, Graded, Paragraph, Row, Table
from elastocal.elastic import unit_of
from elastocal.identification.recertification.result import (
    CompareSummary,
    Estimate,
    RowComparison,
    SpringChange,
)
from elastocal.wording import Phrase, mm, phrase, phrases, point, sentences

_USUAL_UNIT = unit_of("rad/(N*m)")
"""Unit of most springs, shown in the heads; other springs name their own."""


def show_comparison(found: CompareSummary, rows: RowComparison | None = None) -> Iterator[Block]:
    """Yield the verdict, the change of deflection, and a row for each spring that both determine.

    Parameters
    ----------
    found : CompareSummary
        The comparison.
    rows : RowComparison, optional
        The rows behind its change: they say how far the arm was deflected before.
    """
    yield Paragraph(sentences([found.verdict_sentence, found.moved_sentence]), "sentence")
    yield Facts(tuple(_deflections(found, rows)))
    if found.springs:
        yield from _changes(found)
    left_out = phrases(
        "Only in the old model: {names}.",
        "Only in the new model: {names}.",
        "Not determined by both: {names}.",
    )
    lists = (found.only_old, found.only_new, found.not_compared)
    for sentence, names in zip(left_out, lists, strict=True):
        if names:
            yield Paragraph(phrase(sentence, names=", ".join(names)))


def _deflections(
    found: CompareSummary, rows: RowComparison | None
) -> Iterator[tuple[str, str | int]]:
    """Yield the robot, and the change over the rows, else over the new calibration's readings."""
    yield phrase("Robot"), found.robot
    given = found.deflection is not None
    change = found.deflection if given else found.calibrated
    if change is not None:
        yield (
            phrase("Poses and forces compared" if given else "Calibrated readings compared"),
            change.rows,
        )
        if rows is not None:
            before = np.linalg.norm(rows.old, axis=1)
            yield phrase("Deflection by the old model, mean"), mm(float(before.mean()))
            yield phrase("Deflection by the old model, largest"), mm(float(before.max()))
        yield phrase("Change, mean"), _span(change.mean)
        yield phrase("Change, largest"), _span(change.largest)
        row, place = change.where.row + 1, point(change.where.tcp_position, digits=0)
        where = phrase("row {row}, tcp at {place} mm in base", row=row, place=place)
        yield phrase("Largest change at"), where
    yield phrase("Limit"), phrase("none given") if found.limit is None else mm(found.limit)


def _span(found: Estimate) -> Phrase:
    return phrase(
        "{value} ({low} to {high})", value=mm(found.value), low=mm(found.low), high=mm(found.high)
    )


def _changes(found: CompareSummary) -> Iterator[Block]:
    """Yield a row for each spring that is soft in one calibration at least, and what it says."""
    rigid = [each.name for each in found.springs if each.old.value == each.new.value == 0.0]
    soft = [each for each in found.springs if each.name not in rigid]
    sums = [each.name for each in soft if len(each.terms) > 1]
    short = {name: phrase("sum {number}", number=n) for n, name in enumerate(sums, start=1)}
    first = phrase("Compliance, {unit}", unit=_USUAL_UNIT.shown)
    yield Table(
        phrase("Springs and sums that both calibrations determine"),
        (first, *phrases("Old", "New", "Change", "95 %, all at once"), ""),
        tuple(_row(each, short.get(each.name, each.name)) for each in soft),
    )
    yield Bullets(tuple(phrase("{short}: {name}", short=short[name], name=name) for name in sums))
    if rigid:
        yield Paragraph(phrase("Rigid in both: {names}.", names=", ".join(rigid)))
    yield Paragraph(
        phrase(
            "The interval holds for all {count} comparisons at once with 95 %; what has 0 outside"
            " it moved."
            if found.springs_judged
            else "The interval holds for all {count} comparisons at once with 95 %.",
            count=len(found.springs),
        )
    )


def _row(change: SpringChange, name: str) -> Row:
    unit = unit_of(change.unit)
    moved: Cell = Graded(phrase("moved"), "poor") if change.moved else ""
    return (
        name if unit == _USUAL_UNIT else f"{name}, {unit.shown}",
        f"{unit.factor * change.old.value:.3f}",
        f"{unit.factor * change.new.value:.3f}",
        f"{unit.factor * change.difference.value:+.3f}",
        f"{unit.factor * change.together.low:+.3f} … {unit.factor * change.together.high:+.3f}",
        moved,
    )
