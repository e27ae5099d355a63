"""``elastocal compare``: two calibrations of one cell (recertification)."""

from pathlib import Path
from typing import Annotated

import typer


def compare(
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
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the comparison as one JSON object.")
    ] = False,
) -> None:
    """Say which springs moved between two calibrations, and whether predictions changed.

    Exits with 0 whatever the verdict; read it from --json.
    """
    from elastocal.cli.compare_rows import measured_rows, read_rows
    from elastocal.cli.compare_table import show_comparison
    from elastocal.cli.output import console, print_json
    from elastocal.cli.parsing import parse_limit
    from elastocal.identification.recertification import (
        recertify_files,
    )
    from elastocal.records import to_data, write_json
    from elastocal.workflows import refuse_overwriting

    accepted = None if limit is None else parse_limit(limit)
    inputs = [old, new] if rows is None else [old, new, rows]
    outputs = {"--out": out, "--figure": figure}
    for path in (each for each in outputs.values() if each is not None):
        refuse_overwriting(path, *inputs)
    loads = (None, None, None) if rows is None else read_rows(rows, new)
    found = recertify_files(old, new, *loads, limit=accepted)
    if figure is not None:
        from elastocal.report import write_recertification_figure

        write_recertification_figure(figure, found.summary)
    if out is not None:
        write_json(out, found.summary)
    if as_json:
        print_json(to_data(found.summary))
        return
    hint = (
        measured_rows(found.summary.new_provenance) if limit is not None and rows is None else None
    )
    show_comparison(console(), found, hint)
    for path in (each for each in outputs.values() if each is not None):
        console().print(f"written to {path}", markup=False, soft_wrap=True)
