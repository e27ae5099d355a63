"""The whole document: a certificate on one sheet, contents, and an appendix of sections."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from markupsafe import Markup

from elastocal import __version__, plugins
from elastocal.blocks import Block
from elastocal.errors import ReportError
from elastocal.files import replacing
from elastocal.report.document import sections as exported
from elastocal.report.document.certificate import certificate_of_evidence
from elastocal.report.document.section import Content, Section
from elastocal.report.language import ENGLISH, Language
from elastocal.report.pages import render, view_data
from elastocal.verdict import (
    EMPTY_MANIFEST,
    Evidence,
    Signature,
    Verdict,
    embed_manifest,
    judge_evidence,
    manifest_of,
)
from elastocal.wording import Phrase, phrase

_EXPORTED = (getattr(exported, name) for name in dir(exported))
SECTIONS = plugins.Registry[Section](
    "report section",
    {each.identifier: each for each in _EXPORTED if isinstance(each, Section)},
    ReportError,
)
"""Every section that `elastocal.report.document.sections` exports, and those of other packages."""


def ordered_sections() -> tuple[Section, ...]:
    """Return every section in the order in which a report shows them."""
    return tuple(sorted(SECTIONS.values(), key=lambda each: each.place))


def _contents(evidence: Evidence) -> Iterator[tuple[Section, Content]]:
    """Yield every section with what it shows."""
    for each in ordered_sections():
        make = partial(each.body, evidence)
        yield each, plugins.used(SECTIONS.kind, each.identifier, make)


def section_blocks(evidence: Evidence) -> Iterator[tuple[str, tuple[Block, ...]]]:
    """Yield the title of every section and what it shows."""
    return ((section.title, content.blocks) for section, content in _contents(evidence))


@dataclass(frozen=True)
class WrittenReport:
    """A report that was written."""

    path: Path
    verdict: Verdict


def write_report(
    path: Path,
    evidence: Evidence,
    sign: Callable[[str], Signature] | None = None,
    language: Language = ENGLISH,
    signer: str = "",
    beside: Callable[[Path], object] | None = None,
) -> WrittenReport:
    """Write the report, atomically: a certificate on one sheet, and an appendix that folds.

    Parameters
    ----------
    path : Path
        An HTML file.
    evidence : Evidence
        Available evidence.
    sign : callable, optional
        Returns the signature of a hash, here of the manifest; by default there is none.
    language : Language
        Language of its words; texts of other parts of the program stay English.
    signer : str
        Public key of who signs it.
    beside : callable, optional
        Writes files beside the report, from the finished page: if it raises, no report is written
        either.

    Raises
    ------
    FileAccessError
        If it cannot be written.
    """
    verdict = judge_evidence(evidence)
    sections = list(_contents(evidence))
    scene = next((content.scene for _, content in sections if content.scene), None)
    data = view_data(scene.view, scene.plan, scene.pool, language.say) if scene else {}
    page = render(
        "report.html",
        language,
        title=_title(evidence),
        styles=("page.css", "viewer.css", "report.css"),
        scripts=("viewer.js", "postures.js", "report.js"),
        data=data,
        evidence=evidence,
        certificate=certificate_of_evidence(evidence, verdict, signer),
        sections=sections,
        version=__version__,
        verdict=verdict,
        empty_manifest=Markup(EMPTY_MANIFEST),
    )
    manifest = manifest_of(page, evidence, verdict, __version__, sign)
    with replacing(path) as finished:
        finished.write_text(embed_manifest(page, manifest), encoding="utf-8", newline="")
        if beside is not None:
            beside(finished)
    return WrittenReport(Path(path), verdict)


def _title(evidence: Evidence) -> Phrase:
    if evidence.simulated:
        return phrase("Simulation, not a calibration of a robot: cell {name}", name=evidence.name)
    return phrase("Calibration certificate: {name}", name=evidence.name)


def verdict_html(evidence: Evidence, verdict: Verdict) -> str:
    """Return the verdict as HTML."""
    certificate = certificate_of_evidence(evidence, verdict)
    return render("verdict.html", verdict=verdict, evidence=evidence, certificate=certificate)
