"""``elastocal init``: write an example cell to start from."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import output, tables


def _init(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder to write into.")],
    like: Annotated[
        str,
        typer.Option(
            help="Which example: afp (dome on a rail), machining (block) or ur20 (force mode)."
        ),
    ] = "afp",
    force: Annotated[bool, typer.Option("--force", help="Replace files that are there.")] = False,
) -> None:
    """Write a commented example cell with its mesh."""
    tables.show_example(output.console(), workflows.init(folder, kind=like, force=force))
