"""``elastocal export``: C99 of a model and its compensator for a real-time target."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output, tables


def _export(  # noqa: PLR0913 - one parameter an option
    model: Annotated[Path, typer.Argument(help="Model file from calibrate.")],
    c: Annotated[Path, typer.Option("--c", help="Folder to write the C files into.")],
    *,
    settings: options.CompensatorFile = None,
    tool: options.NewToolOrFile = None,
    tool_mass: options.ToolMass = None,
    tool_centre: options.ToolCentre = None,
    target: Annotated[
        str | None,
        options.choice("target", "Besides, a program with the wire around it; needs --cell."),
    ] = None,
    cell: Annotated[
        Path | None, typer.Option(help="With --target: cell file, for addresses and limits.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace files that are there.")] = False,
    as_json: options.Written = False,
) -> None:
    """Write a model as dependency-free C99 with filters, limits and a self-test."""
    files, frame = options.split_tools(tool)
    result = workflows.export(
        model,
        out=c,
        compensator=settings,
        tool=options.only_tool(files),
        platform=target,
        cell=cell,
        force=force,
        tool_frame=frame,
        tool_mass=tool_mass,
        tool_centre=tool_centre,
    )
    if as_json:
        output.print_json(result)
        return
    tables.show_export(output.console(), result, bool(files))
