"""``elastocal simulate``: the simulated cell on the wire."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import output


def _simulate(
    cell: Annotated[Path, typer.Argument(help="Cell file, .yaml.")],
    *,
    ports: Annotated[
        Path | None, typer.Option(metavar="FILE", help="JSON file for the ports that were taken.")
    ] = None,
    devices: Annotated[
        str | None,
        typer.Option(help="Drivers to answer, with commas; default: those of the cell file."),
    ] = None,
    rate: Annotated[
        float | None,
        typer.Option(help="Seconds of the cell a second of the wall; default: the cell's."),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Of the simulated cell; default: the cell's.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is there.")] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the ports as one JSON object.")
    ] = False,
) -> None:
    """Let the simulated cell speak as real devices do, until Ctrl-C."""

    def show(found: workflows.SimulateResult) -> None:
        if as_json:
            output.print_json(found)
        else:
            output.print_lines(found.lines())
        output.console().print("Ctrl-C ends it")
        found.wait()

    names = tuple(name.strip() for name in devices.split(",")) if devices else ()
    workflows.simulate(
        cell, out=ports, devices=names, rate=rate, seed=seed, force=force, meanwhile=show
    )
