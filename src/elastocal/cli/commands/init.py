"""``elastocal init``: write an example cell to start from."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output, tables


def _init(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder to write into.")],
    like: Annotated[
        str,
        options.choice("example", "A dome on a rail, a block, or a cobot in force mode."),
    ] = "afp",
    force: Annotated[bool, typer.Option("--force", help="Replace files that are there.")] = False,
    wire: Annotated[
        bool,
        typer.Option("--wire", help="Devices on the wire, as `simulate` serves them."),
    ] = False,
    as_json: options.Written = False,
) -> None:
    """Write a commented example cell with its mesh."""
    result = workflows.init(folder, kind=like, force=force, wire=wire)
    if as_json:
        output.print_json(result)
    else:
        tables.show_example(output.console(), result)
