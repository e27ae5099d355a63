"""``elastocal release``: bring a tool that stands at a surface off it."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output


def _release(
    cell: Annotated[Path, typer.Argument(help="Cell file, .yaml.")],
    *,
    arm: Annotated[
        bool, typer.Option("--arm", help="Move the arm; without it only say what would be done.")
    ] = False,
    yes: Annotated[
        bool, typer.Option("--yes", help="Do not ask: a person has looked at the cell.")
    ] = False,
    as_json: options.Figures = False,
) -> None:
    """Bring a tool that stands at a surface off it, along its own axis."""
    from elastocal.cli._operator import TerminalOperator

    screen = output.console()
    result = workflows.release(cell, arm=arm, confirmed=yes, operator=TerminalOperator(screen))
    if as_json:
        output.print_json(result.figures)
        return
    for label, text in result.facts():
        screen.print(f"{label}: {text}", soft_wrap=True)
