"""``elastocal predict``: the deflection of each row of joints and force."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import output, tables


def _predict(
    model: Annotated[Path, typer.Argument(help="Model file from calibrate.")],
    rows: Annotated[Path, typer.Argument(help="CSV: joint columns, force_x[N] …, moment_x[N*m] …")],
    out: Annotated[Path, typer.Option(help="CSV to write.")],
    as_json: Annotated[
        bool, typer.Option("--json", help="Print a summary as one JSON object.")
    ] = False,
) -> None:
    """Predict the deflection of each row, with 95 % intervals of the fit and of a measurement."""
    result = workflows.predict(model, rows=rows, out=out)
    if as_json:
        output.print_json(result.summary)
    else:
        tables.show_predicted(output.console(), result, out)
