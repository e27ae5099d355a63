"""Limits of this report: what it does not show. The list is never empty."""

from collections.abc import Iterator

from elastocal.report.document import blocks
from elastocal.verdict import Evidence
from elastocal.wording import mm

_ALWAYS = (
    "Geometric calibration and the sag under the arm's own weight: only deflection under a force"
    " is modelled, and both must be corrected before it.",
    "Absolute accuracy: deflections are differences to the unloaded reading at the same pose.",
    "Temperature: nothing corrects for a warm arm.",
    "Payloads and tools other than the one of this run.",
    "Poses outside the region of the pool, and forces beyond those that were applied.",
    "Dynamic effects: readings were taken while the arm stood still.",
    "The controller that will apply the correction, and its delay.",
    "Safety: a calibrated model is not a safety function.",
)


def _body(evidence: Evidence) -> Iterator[blocks.Block]:
    yield blocks.Paragraph("Whatever the light says, this was not verified:")
    yield blocks.Bullets(tuple(_always(evidence)))
    yield blocks.Heading("Missing in this report")
    missing = tuple(
        f"{each.name[0].upper()}{each.name[1:]}{' (cannot be used)' if each.damaged else ''}:"
        f" {each.reason}"
        for each in evidence.missing
    )
    none = blocks.Paragraph("No part of the report is missing.")
    yield blocks.Bullets(missing, code=True) if missing else none
    if evidence.doubts:
        yield blocks.Heading("What does not fit together")
        yield blocks.Bullets(evidence.doubts)


def _always(evidence: Evidence) -> Iterator[str]:
    if evidence.simulated:
        yield "A real robot: all devices of this run are simulated."
    yield from _ALWAYS
    calibrated = evidence.calibrated
    if calibrated is not None and calibrated.model.observability.unobservable:
        yield (
            "Single springs that no reading tells apart (see Compliances): their numbers are not"
            " findings."
        )
    if evidence.plan is not None:
        yield (
            "Places on the surface farther than"
            f" {mm(evidence.plan.search.covering_radius, 1)} from every pose; that is how far the"
            " worst covered candidate is from one."
        )


NOT_VERIFIED = blocks.Section("not-verified", "What was not verified", 100, _body)
