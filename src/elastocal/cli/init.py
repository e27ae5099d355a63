"""``elastocal init``: write an example cell to start from."""

from pathlib import Path
from typing import Annotated

import typer


def init(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder to write into.")],
    like: Annotated[
        str, typer.Option(help="Which example: afp (dome on a rail) or machining (block).")
    ] = "afp",
    force: Annotated[bool, typer.Option("--force", help="Replace files that are there.")] = False,
) -> None:
    """Write a commented example cell with its mesh."""
    from rich.markup import escape

    from elastocal.cell.examples import write_example
    from elastocal.cli.output import console

    cell, *meshes = write_example(folder, like, force)
    names = ", ".join(mesh.name for mesh in meshes)
    console().print(
        f"wrote [bold]{escape(str(cell))}[/bold] and {names}: edit it, then"
        f" `elastocal check {escape(str(cell))}`",
        soft_wrap=True,
    )
