"""The head of the report: light, key figures, reasons, advice."""

from elastocal.identification.reproduction import UnseenErrors
from elastocal.report.document.markup import coded, facts, heading, html, listed, paragraph
from elastocal.verdict.evidence import Evidence
from elastocal.verdict.judgement import Light, Verdict
from elastocal.wording import mm

_SHAPES = {
    Light.GREEN: '<circle cx="24" cy="24" r="21"/><path class="sign" d="M14 25l7 7 14-15"/>',
    Light.YELLOW: '<path d="M24 3L46 44H2z"/><path class="sign" d="M24 18v13M24 36v3"/>',
    Light.RED: (
        '<path d="M15 3h18l12 12v18L33 45H15L3 33V15z"/>'
        '<path class="sign" d="M16 16l16 16M32 16L16 32"/>'
    ),
}
"""Of the light: a disc with a tick, a triangle with a mark, an octagon with a cross."""


def verdict_html(evidence: Evidence, verdict: Verdict) -> str:
    """Return the verdict as HTML."""
    again = evidence.reproduction
    unseen = again.unseen if again is not None and again.same else None
    text = _light(verdict)
    if evidence.simulated:
        text += paragraph("A simulated cell: no real robot was measured.", "banner")
    text += paragraph(verdict.sentence, "sentence")
    if unseen is not None:
        text += _figures(unseen)
    if verdict.reasons:
        why = "Why it is not green" if verdict.light else "What has to be known"
        text += heading(why) + listed(map(coded, verdict.reasons), "reasons")
    if verdict.notes:
        text += heading("Good to know") + listed(map(coded, verdict.notes))
    advice = listed(map(coded, verdict.advice)) or paragraph(
        "Nothing in these data asks for a change."
    )
    return text + heading("What would improve the result") + advice


def _light(verdict: Verdict) -> str:
    if verdict.light is None:
        return f'<p class="light none"><strong>{html(verdict.word)}</strong></p>'
    return (
        f'<p class="light {verdict.light.value}"><svg viewBox="0 0 48 48" width="48" height="48"'
        f' aria-hidden="true">{_SHAPES[verdict.light]}</svg><strong>{html(verdict.word)}</strong>'
        f'<span class="colour">{html(verdict.light.value)} light</span></p>'
    )


def _figures(unseen: UnseenErrors) -> str:
    def span(low: float, high: float) -> str:
        return f"({mm(low)} to {mm(high)})"

    mean, p95 = unseen.mean, unseen.p95
    return facts(
        [
            ("Mean error (95 % interval)", f"{mm(mean.value)} {span(mean.low, mean.high)}"),
            ("95 % of errors below (95 % interval)", f"{mm(p95.value)} {span(p95.low, p95.high)}"),
            ("Largest error", mm(unseen.max)),
            ("Held out", f"{unseen.poses} poses, {len(unseen.error)} readings"),
        ]
    ) + paragraph(
        f"Every pose was left out of the fit once ({unseen.folds} refits) and predicted by the"
        " others. Intervals: whole poses drawn with replacement. If one more pose were drawn"
        " like these, the chance that its error is larger than the largest here is at most 1 in"
        f" {unseen.poses + 1}.", "sub",
    )  # fmt: skip
