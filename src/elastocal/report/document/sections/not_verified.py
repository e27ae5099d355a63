"""What this report does not show. The list is never empty."""

from collections.abc import Iterator

from elastocal.report.document.markup import coded, heading, listed, paragraph
from elastocal.report.document.section import Content, Finding, Section
from elastocal.verdict.evidence import Evidence
from elastocal.wording import mm

ALWAYS = (
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
ESSENTIAL = ("run", "journal", "cell", "plan", "summary of the run", "dataset", "calibrated model",
             "calibration made again")  # fmt: skip
"""Evidence without which no light is green; the codec has a finding of its own."""
TOLD_ELSEWHERE = ("codec", "earlier calibration")
"""A codec has a finding of its own; a first calibration has no earlier one."""


def body(evidence: Evidence) -> Content:
    """Return the section."""
    html = paragraph("Whatever the light says, this was not verified:") + listed(_always(evidence))
    absent = [
        f"{each.name[0].upper()}{each.name[1:]}{' (cannot be used)' if each.damaged else ''}:"
        f" {each.reason}"
        for each in evidence.missing
    ]
    html += heading("Missing in this report")
    html += listed(map(coded, absent)) or paragraph("No part of the report is missing.")
    if evidence.doubts:
        html += heading("What does not fit together") + listed(evidence.doubts)
    return Content(html, findings=tuple(_findings(evidence)))


def _always(evidence: Evidence) -> Iterator[str]:
    if evidence.simulated:
        yield "A real robot: all devices of this run are simulated."
    yield from ALWAYS
    if evidence.calibrated is not None and evidence.calibrated.model.observability.unobservable:
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


def _findings(evidence: Evidence) -> Iterator[Finding]:
    for each in evidence.missing:
        if each.name in TOLD_ELSEWHERE and not each.damaged:
            continue
        word = "cannot be used" if each.damaged else "is missing"
        advice = ""
        if each.name == "tool file" and not each.damaged:
            advice = (
                "Run `elastocal tool`: without it the compensation relies on the cell file's tool."
            )
        yield Finding(f"the {each.name} {word}: {each.reason}", each.name in ESSENTIAL, advice)
    for doubt in evidence.doubts:
        yield Finding(doubt)


SECTION = Section("not-verified", "What was not verified", body)
