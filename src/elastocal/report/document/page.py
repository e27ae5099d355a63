"""The whole document: verdict, contents, sections, a place to sign."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from markupsafe import Markup

from elastocal import __version__
from elastocal.files import write_text
from elastocal.identification import UnseenErrors
from elastocal.report.document import sections as exported
from elastocal.report.document.blocks import Block, Facts, Paragraph, Section
from elastocal.report.pages import render
from elastocal.verdict import (
    EMPTY_MANIFEST,
    Evidence,
    Signature,
    Verdict,
    embed_manifest,
    judge_evidence,
    manifest_of,
)
from elastocal.wording import mm

_EXPORTED = (getattr(exported, name) for name in dir(exported))
SECTIONS: tuple[Section, ...] = tuple(
    sorted((each for each in _EXPORTED if isinstance(each, Section)), key=lambda each: each.place)
)
"""Every section that `elastocal.report.document.sections` exports, in order."""


@dataclass(frozen=True)
class WrittenReport:
    """A report that was written."""

    path: Path
    verdict: Verdict


def write_report(
    path: Path, evidence: Evidence, sign: Callable[[str], Signature] | None = None
) -> WrittenReport:
    """Write the report, atomically.

    Parameters
    ----------
    path : Path
        An HTML file.
    evidence : Evidence
        Whatever is there.
    sign : callable, optional
        Returns the signature of a hash, here of the manifest; by default there is none.

    Raises
    ------
    FileAccessError
        If it cannot be written.
    """
    verdict = judge_evidence(evidence)
    sections = [(section, section.body(evidence)) for section in SECTIONS]
    data = {section.identifier: content.data for section, content in sections if content.data}
    page = render(
        "report.html",
        title=f"Calibration report: {evidence.name}",
        styles=("report.css",),
        scripts=("view.js", "report.js"),
        # Only the view in three dimensions needs the drawing library.
        interactive="poses" in data,
        data=data,
        evidence=evidence,
        sections=sections,
        version=__version__,
        verdict=verdict,
        blocks=tuple(_accuracy(evidence, verdict)),
        empty_manifest=Markup(EMPTY_MANIFEST),
    )
    manifest = manifest_of(page, evidence, verdict, __version__, sign)
    write_text(path, embed_manifest(page, manifest))
    return WrittenReport(Path(path), verdict)


def verdict_html(evidence: Evidence, verdict: Verdict) -> str:
    """Return the verdict as HTML."""
    return render("verdict.html", verdict=verdict, blocks=tuple(_accuracy(evidence, verdict)))


def _accuracy(evidence: Evidence, verdict: Verdict) -> Iterator[Block]:
    if evidence.simulated:
        yield Paragraph("A simulated cell: no real robot was measured.", "banner")
    yield Paragraph(verdict.sentence, "sentence")
    if evidence.unseen is not None:
        yield from _unseen(evidence.unseen)


def _unseen(unseen: UnseenErrors) -> Iterator[Block]:
    def span(low: float, high: float) -> str:
        return f"({mm(low)} to {mm(high)})"

    mean, p95 = unseen.mean, unseen.p95
    yield Facts(
        (
            ("Mean error (95 % interval)", f"{mm(mean.value)} {span(mean.low, mean.high)}"),
            ("95 % of errors below (95 % interval)", f"{mm(p95.value)} {span(p95.low, p95.high)}"),
            ("Largest error", mm(unseen.max)),
            ("Held out", f"{unseen.poses} poses, {len(unseen.error)} readings"),
        )
    )
    yield Paragraph(
        f"Every pose was left out of the fit once ({unseen.folds} refits) and predicted by the"
        " others. Intervals: whole poses drawn with replacement. If one more pose were drawn"
        " like these, the chance that its error is larger than the largest here is at most 1 in"
        f" {unseen.poses + 1}.", "sub",
    )  # fmt: skip
