"""``elastocal compare``: two calibrations of one cell (recertification)."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output, tables


def _compare(
    old: Annotated[Path, typer.Argument(help="Model file of the earlier calibration.")],
    new: Annotated[Path, typer.Argument(help="Model file of the later one.")],
    *,
    rows: Annotated[
        Path | None,
        typer.Option(
            help="Poses and forces that matter: CSV as for predict, or a dataset (.nc, .csv)."
        ),
    ] = None,
    limit: Annotated[
        str | None,
        typer.Option(help='Largest accepted change of deflection at the rows, e.g. "0.1 mm".'),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Comparison file (.json) to write.")] = None,
    figure: Annotated[
        Path | None, typer.Option(help="Figure to write: .svg, .png or .pdf.")
    ] = None,
    force: options.Force = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the comparison as one JSON object.")
    ] = False,
) -> None:
    """Say which springs moved between two calibrations, and whether predictions changed.

    Exits with 0 whatever the verdict; read it from --json.
    """
    found = workflows.compare(
        old,
        new=new,
        rows=rows,
        limit=None if limit is None else options.parse_limit(limit),
        out=out,
        figure=figure,
        force=force,
    )
    if as_json:
        output.print_json(found.summary)
        return
    asked = limit is not None and rows is None
    hint = workflows.measured_rows(found.summary.new_provenance) if asked else None
    tables.show_comparison(output.console(), found, hint)
    for path in (each for each in (out, figure) if each is not None):
        output.console().print(f"written to {path}", soft_wrap=True)
