"""``elastocal export``: C99 of a model and its compensator for a real-time target."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output, tables


def _export(
    model: Annotated[Path, typer.Argument(help="Model file from calibrate.")],
    c: Annotated[Path, typer.Option("--c", help="Folder to write the C files into.")],
    *,
    settings: options.CompensatorFile = None,
    tool: Annotated[
        Path | None, typer.Option(help="Tool file from `elastocal tool`: weight, bias, sensor.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace files that are there.")] = False,
    as_json: options.Written = False,
) -> None:
    """Write a model as dependency-free C99 with filters, limits and a self-test."""
    result = workflows.export(model, c=c, settings=settings, tool=tool, force=force)
    if as_json:
        output.print_json(result)
        return
    tables.show_export(output.console(), result, tool is not None)
