"""``elastocal watch``: every device of a cell, live, without a run."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output


def _watch(
    cell: Annotated[Path, typer.Argument(help="Cell file, .yaml.")],
    *,
    duration: Annotated[
        str | None, typer.Option("--for", help="End after this time, '10 s'; default: at Ctrl-C.")
    ] = None,
    as_json: options.Figures = False,
) -> None:
    """Show every device of a cell, live; nothing is moved."""
    from elastocal.cli._operator import DevicesView, interruption
    from elastocal.errors import DeviceError

    screen = output.console()
    with interruption() as interrupted, DevicesView(screen) as view:
        result = workflows.watch(cell, duration=duration, show=view.tell, interrupted=interrupted)
        ended = not interrupted()
    if as_json:
        output.print_json(result.figures)
    else:
        for label, text in result.facts():
            screen.print(f"{label}: {text}", soft_wrap=True)
    if ended and result.problem is not None:
        raise DeviceError(result.problem)
