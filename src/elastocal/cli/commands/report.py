"""``elastocal report``: the document that stays when the engineer has left."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output, tables


def _report(  # noqa: PLR0913 - one parameter an option
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
    sign: Annotated[
        Path | None,
        typer.Option(metavar="KEY", help="Private key to sign with; `verify --new-key` makes one."),
    ] = None,
    language: options.PageLanguage = "en",
    xlsx: Annotated[
        bool, typer.Option("--xlsx", help="Also write its tables beside it, for Excel.")
    ] = False,
    state: options.State = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the verdict as one JSON object.")
    ] = False,
) -> None:
    """Write the report of a calibration: one HTML file that an inspector can sign."""
    accepted = None if tolerance is None else options.parse_limit(tolerance, "--tolerance")
    drift = None if limit is None else options.parse_limit(limit)
    from elastocal.cell import read_statements

    settings = workflows.ReportSettings(
        run, out, model, tool, codec, process, old, accepted, drift, pdf, force, sign,
        language=language, xlsx=xlsx, state=read_statements(tuple(state or ())),
    )  # fmt: skip
    result = workflows.report(settings)
    if as_json:
        output.print_json(result.figures)
        return
    tables.show_report(output.console(), result)
