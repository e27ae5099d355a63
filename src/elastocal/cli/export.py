"""``elastocal export``: C99 of a model and its compensator for a real-time target."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows


def export(
    model: Annotated[Path, typer.Argument(help="Model file from calibrate.")],
    c: Annotated[Path, typer.Option("--c", help="Folder to write the C files into.")],
    *,
    settings: Annotated[
        Path | None, typer.Option(help="Settings of the compensator (.yaml).")
    ] = None,
    tool: Annotated[
        Path | None, typer.Option(help="Tool file from `elastocal tool`: weight, bias, sensor.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace files that are there.")] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print what was written as one JSON object.")
    ] = False,
) -> None:
    """Write a model as dependency-free C99 with filters, limits and a self-test."""
    from elastocal.cli.output import console, print_json

    result = workflows.export(model, c=c, settings=settings, tool=tool, force=force)
    if as_json:
        print_json(result)
        return
    out = console()
    out.print(f"{', '.join(result.files)} written to {c}")
    out.print(f"the filters delay a slow wrench by {1e3 * result.filter_delay:.1f} ms")
    if tool is None:
        out.print(
            "no --tool: wrenches are taken as at the tool centre point, in its axes, bias and tool"
            " weight removed"
        )
