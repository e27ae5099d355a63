"""``report``: the document that stays when the engineer has left."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Annotated

from elastocal.blocks import Block, Bullets, Facts, Paragraph
from elastocal.cell import unstated
from elastocal.errors import FileAccessError
from elastocal.files import require_place
from elastocal.identification.recertification import Estimate
from elastocal.options import Option, Statements
from elastocal.progress import Progress
from elastocal.records import record
from elastocal.report import language_of
from elastocal.report.document import (
    WrittenReport,
    find_browser,
    require_excel,
    section_blocks,
    write_pdf,
    write_report,
    write_workbook,
)
from elastocal.results import Result, brief_repr
from elastocal.verdict import (
    OF_REPORT,
    Evidence,
    EvidenceOptions,
    Verdict,
    gather_evidence,
    public_key,
    read_private_key,
    sign,
)
from elastocal.workflows._workflow import workflow


@brief_repr
@dataclass(frozen=True)
class ReportSettings:
    """Settings of a report: the run and the page."""

    run: Annotated[str | PathLike[str], Option(argument=True, metavar="RUN")]
    """Folder of a run, a folder that holds one, or a model file."""
    out: Annotated[str | PathLike[str], Option(metavar="REPORT.html", ends=(".html", ".htm"))]
    """HTML file to write."""
    model: Path | None = None
    """Model file; by default ``model.json`` beside the run."""
    tool: Path | None = None
    """Tool file; by default ``tool.json`` beside the run."""
    codec: Annotated[Path | None, Option(metavar="DIR")] = None
    """Codec; by default ``codec`` beside the run."""
    process: Annotated[Path | None, Option(metavar="DIR")] = None
    """Simulated process; by default ``process`` beside the run."""
    old: Annotated[Path | None, Option(metavar="MODEL")] = None
    """Model file of an earlier calibration."""
    tolerance: Annotated[
        float | None,
        Option(
            metavar="LENGTH",
            read="length",
            help="Largest error at unseen poses, e.g. '0.3 mm'; default: the cell file's.",
        ),
    ] = None
    """Largest error at unseen poses in m; by default the cell file's."""
    limit: Annotated[
        float | None,
        Option(
            metavar="LENGTH",
            read="length",
            help="Largest change since --old, e.g. '0.1 mm'; default: the cell file's drift.",
        ),
    ] = None
    """Largest change since ``old`` in m; by default the cell file's drift."""
    pdf: bool = False
    """Also print a PDF beside it; needs a Chromium."""
    force: bool = False
    """Replace a report that is there."""
    sign: Annotated[Path | None, Option(metavar="KEY")] = None
    """Private key that signs the report; made by `elastocal verify --new-key`."""
    language: Annotated[str, Option(choices="page language")] = "en"
    """Language of the report."""
    xlsx: bool = False
    """Also write its tables beside it, as a workbook."""
    state: Statements = field(default_factory=dict)
    """Statements for the certificate, in addition to those of cell file and run; see
    `elastocal.cell.read_statements`."""
    identify: Callable[[Sequence[str]], Mapping[str, str]] | None = None
    """Function that asks a person for the entries of a signed certificate that nobody has stated,
    by their keys, and returns statements. None: nobody is asked."""


@brief_repr
@record()
class UnseenFigures:
    """Errors at poses that were left out of the fit, in m."""

    mean: Estimate
    p95: Estimate
    max: float
    poses: int
    readings: int


@brief_repr
@record()
class ReportFigures:
    """The figures of ``report --json``."""

    report: str
    pdf: str | None
    xlsx: str | None
    light: str | None
    """None if nothing can be judged."""
    verdict: str
    reasons: tuple[str, ...]
    advice: tuple[str, ...]
    next_step: str
    """The one of them that brings most, with a figure."""
    effect: str | None
    """Deviation on production before and after correction; None where it is not known."""
    tolerance: float | None
    unseen: UnseenFigures | None
    """None if the calibration could not be repeated."""
    missing: tuple[str, ...]
    """Parts that were not found."""


@dataclass(frozen=True, eq=False, repr=False)
class ReportResult(Result):
    """A written report and its verdict."""

    verdict: Verdict
    figures: ReportFigures

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        return (
            (f"{self.verdict.word}{self.light}", f"{self.verdict.meaning} {self.verdict.sentence}"),
            *(("because", reason) for reason in self.verdict.reasons),
            ("next", self.verdict.next_step),
            ("written to", self.files),
        )

    def show(self) -> Iterator[Block]:
        """Yield the verdict, its reasons, the effect on production and the next step."""
        word, *_ = self.facts()
        yield Facts((word,))
        yield Bullets(self.verdict.reasons)
        if self.verdict.effect is not None:
            yield Paragraph(self.verdict.effect.sentence)
        yield Facts((("next", self.verdict.next_step),))

    @property
    def light(self) -> str:
        """The colour of the light as it follows the verdict's word; empty without one."""
        return f" ({self.figures.light} light)" if self.figures.light else ""

    @property
    def files(self) -> str:
        """The files that were written, as a phrase."""
        found = self.figures
        return " and ".join(filter(None, (found.report, found.pdf, found.xlsx)))


@workflow(ReportSettings)
def report(settings: ReportSettings, progress: Progress) -> ReportResult:
    """Write the report of a calibration: one HTML file that an inspector can sign.

    Raises
    ------
    FileAccessError
        If a file cannot be read, or the report cannot be written where it should be.
    ElastocalError
        If a part that was named cannot be used, or the key.
    """
    out = Path(settings.out)
    require_place(out)
    paper = out.with_suffix(".pdf") if settings.pdf else None
    tables = out.with_suffix(".xlsx") if settings.xlsx else None
    _require_free((out, paper, tables), settings.force)
    language = language_of(settings.language)
    if tables is not None:
        require_excel()
    browser = find_browser() if settings.pdf else ""
    made = datetime.now(UTC).isoformat(timespec="seconds")
    key = None if settings.sign is None else read_private_key(settings.sign)
    options = EvidenceOptions(
        Path(settings.run),
        settings.model,
        settings.tool,
        settings.codec,
        settings.process,
        settings.old,
        settings.tolerance,
        settings.limit,
        stated=settings.state,
    )
    steps = 3 if settings.pdf else 2
    progress("report", 0, steps)
    evidence = gather_evidence(options, made)
    if key is not None and settings.identify is not None:
        answers = settings.identify(unstated(evidence.certificate))
        evidence = replace(evidence, stated={**evidence.stated, **answers})
    progress("report", 1, steps)
    signed = None if key is None else partial(sign, key, OF_REPORT, made=made)

    def write_beside(page: Path) -> None:
        progress("report", 2, steps)
        if paper is not None:
            write_pdf(page, paper, browser)
            progress("report", 3, steps)
        if tables is not None:
            write_workbook(tables, section_blocks(evidence), language)

    signer = public_key(key) if key else ""
    written = write_report(out, evidence, signed, language, signer, write_beside)
    return ReportResult(written.verdict, _figures(written, evidence, paper, tables))


def _figures(
    written: WrittenReport, evidence: Evidence, paper: Path | None, tables: Path | None
) -> ReportFigures:
    verdict, again, unseen = written.verdict, evidence.reproduction, None
    if again is not None and again.same:
        left = again.unseen
        unseen = UnseenFigures(left.mean, left.p95, left.max, left.poses, len(left.error))
    return ReportFigures(
        report=str(written.path),
        pdf=str(paper) if paper else None,
        xlsx=str(tables) if tables else None,
        light=verdict.light.value if verdict.light else None,
        verdict=f"{verdict.meaning} {verdict.sentence}",
        reasons=tuple(verdict.reasons),
        advice=tuple(verdict.advice),
        next_step=verdict.next_step,
        effect=verdict.effect.sentence if verdict.effect else None,
        tolerance=evidence.limits.tolerance,
        unseen=unseen,
        missing=tuple(each.name for each in evidence.missing),
    )


def _require_free(places: tuple[Path | None, ...], force: bool) -> None:
    for path in places:
        if path is not None and path.exists() and not force:
            raise FileAccessError(f"{path} is there already: name another file, or give --force")
