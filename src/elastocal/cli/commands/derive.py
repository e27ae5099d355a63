"""``elastocal derive``: from a run's journal and raw streams to its dataset, again."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import output


def _derive(
    run: Annotated[Path, typer.Argument(help="Folder of a run.")],
    *,
    tool: Annotated[
        Path | None,
        typer.Option(help="Tool file whose sensor rotation and matrix correct the readings."),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the summary as one JSON object.")
    ] = False,
) -> None:
    """Derive dataset.nc and summary.json of a run again from its raw streams."""
    result = workflows.derive(run, tool=tool)
    if as_json:
        output.print_json(result.summary)
        return
    console, folder = output.console(), result.folder
    console.print(f"{result.poses()}, readings: {result.counts()}")
    console.print(f"wrote {folder.dataset} and {folder.summary.name}", soft_wrap=True)
    output.print_remarks(console, "warning", result.summary.warnings)
