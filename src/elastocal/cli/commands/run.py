"""``elastocal run``: Procedure 1 on the devices that the cell names."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output, tables


def _run(  # noqa: PLR0913 - one parameter an option
    cell: Annotated[Path, typer.Argument(help="Cell file, .yaml.")],
    plan: Annotated[Path, typer.Option(metavar="DIR", help="Folder with the cell's plan.")],
    out: Annotated[Path, typer.Option(metavar="RUN", help="Folder of the run.")],
    *,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the run that is in the folder.")
    ] = False,
    yes: Annotated[
        bool, typer.Option("--yes", help="Do not ask: a person has looked at the cell.")
    ] = False,
    dry_run: Annotated[
        bool,
        typer.Option(
            "--dry-run", help="A line a pose on standard output: id, time, joints; nothing moves."
        ),
    ] = False,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Seed of simulated devices; default: the cell's.")
    ] = None,
    sign: Annotated[
        Path | None,
        typer.Option(metavar="KEY", help="Private key to sign with; `verify --new-key` makes one."),
    ] = None,
    state: options.State = None,
    as_json: options.Figures = False,
) -> None:
    """Press on the tooling at every pose of a plan and record what happens."""
    from elastocal.cell import read_statements
    from elastocal.cli._operator import TerminalOperator
    from elastocal.procedure import RunEnd

    operator = TerminalOperator(output.console(), asks=not (yes or as_json))
    stated = read_statements(tuple(state or ()))
    settings = workflows.RunSettings(
        cell, plan, out, resume, yes, seed, operator, sign, state=stated
    )
    if dry_run:
        rehearsed = workflows.dry_run(settings)
        if as_json:
            output.print_json(tables.dry_figures(rehearsed))
        else:
            output.print_lines(rehearsed.pose_lines())
            tables.show_itinerary(output.console(), rehearsed)
        return
    finished = workflows.run(settings)
    if as_json and finished.end is RunEnd.DONE:
        output.print_json(finished.figures)
    else:
        tables.show_run(output.console(), finished)
    if finished.problem is not None:
        raise finished.problem
    if finished.end is RunEnd.INTERRUPTED:
        raise typer.Exit(130)
