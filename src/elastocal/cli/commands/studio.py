"""``elastocal studio``: the cell in the browser."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import output


def _studio(
    cell: Annotated[Path, typer.Argument(help="Cell file, .yaml; edits are written back to it.")],
    *,
    model: Annotated[
        Path | None,
        typer.Option(help="Calibrated model to predict with; default: springs by rule of thumb."),
    ] = None,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port; default: one that is free.")
    ] = 0,
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Only print the address.")
    ] = False,
    arm: Annotated[
        bool,
        typer.Option("--arm", help="Let a run move devices that are not simulated."),
    ] = False,
    host: Annotated[
        str, typer.Option(help="Address to answer on; another lets the network in.")
    ] = "127.0.0.1",
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the address in one JSON object.")
    ] = False,
) -> None:
    """Show and edit a cell in the browser, plan it, and watch a run, until Ctrl-C."""

    def show(found: workflows.StudioResult) -> None:
        if as_json:
            output.print_json(found.figures)
        else:
            output.print_lines([found.figures.address])
        output.print_remarks(output.console(), "warning", found.figures.notes)
        output.console().print("Ctrl-C ends it; whoever has the address can use it")
        if not no_browser:
            found.open_page()
        try:
            found.wait()
        finally:
            if found.session.is_running:
                output.console().print("stopping the run: the arm is brought to safety")

    workflows.studio(cell, model=model, host=host, port=port, arm=arm, while_open=show)
