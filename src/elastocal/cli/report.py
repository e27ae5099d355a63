"""``elastocal report``: the document that stays when the engineer has left."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from elastocal.report.document import (
        WrittenReport,
    )
    from elastocal.verdict import (
        Evidence,
    )


def report(  # noqa: PLR0913 - one parameter an option
    run: Annotated[
        Path,
        typer.Argument(
            metavar="RUN", help="Folder of a run, a folder that holds one, or a model file."
        ),
    ],
    out: Annotated[Path, typer.Option(metavar="REPORT.html", help="HTML file to write.")],
    *,
    model: Annotated[
        Path | None, typer.Option(help="Model file; default: model.json beside the run.")
    ] = None,
    tool: Annotated[
        Path | None, typer.Option(help="Tool file; default: tool.json beside the run.")
    ] = None,
    codec: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Codec; default: codec beside the run.")
    ] = None,
    process: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Simulated process; default: process beside the run."),
    ] = None,
    old: Annotated[
        Path | None, typer.Option(metavar="MODEL", help="Model file of an earlier calibration.")
    ] = None,
    tolerance: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH",
            help="Largest error at unseen poses, e.g. '0.3 mm'; default: the cell file's.",
        ),
    ] = None,
    limit: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH",
            help="Largest change since --old, e.g. '0.1 mm'; default: the cell file's drift.",
        ),
    ] = None,
    pdf: Annotated[
        bool, typer.Option("--pdf", help="Also print a PDF beside it; needs a Chromium.")
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace a report that is there.")] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the verdict as one JSON object.")
    ] = False,
) -> None:
    """Write the report of a calibration: one HTML file that an inspector can sign."""
    from datetime import UTC, datetime

    from rich.markup import escape

    from elastocal.cli.output import console, print_json
    from elastocal.cli.parsing import parse_limit
    from elastocal.report.document import (
        find_browser,
        write_pdf,
        write_report,
    )
    from elastocal.verdict import (
        EvidenceOptions,
        gather_evidence,
    )

    paper = out.with_suffix(".pdf") if pdf else None
    check_places(out, paper, force)
    browser = find_browser() if pdf else ""
    accepted = None if tolerance is None else parse_limit(tolerance, "--tolerance")
    drift = None if limit is None else parse_limit(limit)
    made = datetime.now(UTC).isoformat(timespec="seconds")
    evidence = gather_evidence(
        EvidenceOptions(run, model, tool, codec, process, old, accepted, drift), made
    )
    written = write_report(out, evidence)
    if paper is not None:
        write_pdf(out, paper, browser)
    if as_json:
        print_json(_figures(evidence, written, paper))
        return
    shown = console()
    verdict = written.verdict
    light = f" ({verdict.light.value} light)" if verdict.light else ""
    shown.print(f"[bold]{verdict.word}[/bold]{light}: {escape(verdict.sentence)}")
    for reason in verdict.reasons:
        shown.print(f"   {reason}", markup=False)
    shown.print(f"written to {out}{f' and {paper}' if paper else ''}", markup=False)


def check_places(out: Path, paper: Path | None, force: bool) -> None:
    """Refuse places for a report before the work, so that none is done in vain.

    Raises
    ------
    FileAccessError
        If a file is there and is not to be replaced, or the name is not that of a page: it could
        be that of a model.
    """
    from elastocal.errors import FileAccessError

    if out.suffix.lower() not in (".html", ".htm"):
        raise FileAccessError(f"--out {out}: the report is a page, its name must end in .html")
    if not out.parent.is_dir():
        raise FileAccessError(f"cannot write {out}: there is no folder {out.parent}")
    for path in (out, paper):
        if path is not None and path.exists() and not force:
            raise FileAccessError(f"{path} is there already: name another file, or give --force")


def _figures(evidence: "Evidence", written: "WrittenReport", paper: Path | None) -> dict[str, Any]:
    verdict, again = written.verdict, evidence.reproduction
    unseen = again.unseen if again is not None and again.same else None
    return {
        "report": str(written.path),
        "pdf": str(paper) if paper else None,
        "light": verdict.light.value if verdict.light else None,
        "verdict": verdict.sentence,
        "reasons": list(verdict.reasons),
        "advice": list(verdict.advice),
        "tolerance": evidence.limits.tolerance,
        "unseen": None if unseen is None else {
            "mean": _estimate(unseen.mean), "p95": _estimate(unseen.p95), "max": unseen.max,
            "poses": unseen.poses, "readings": len(unseen.error),
        },
        "missing": [each.name for each in evidence.missing],
    }  # fmt: skip


def _estimate(found: Any) -> dict[str, float]:
    return {"value": found.value, "low": found.low, "high": found.high}
