"""``elastocal run``: Procedure 1 on the devices that the cell names."""

from pathlib import Path
from typing import Annotated

import typer


def run(
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
        bool, typer.Option("--dry-run", help="List the steps with their times; nothing moves.")
    ] = False,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Seed of simulated devices; default: the cell's.")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the figures as one JSON object.")
    ] = False,
) -> None:
    """Press on the tooling at every pose of a plan and record what happens."""
    from elastocal.cli.output import console, print_json
    from elastocal.cli.run_session import Asked, prepare, run_session
    from elastocal.cli.run_table import dry_figures, figures, show_itinerary, show_result
    from elastocal.procedure import RunEnd

    job = prepare(cell, plan, out, seed)
    if dry_run:
        if as_json:
            print_json(dry_figures(job))
        else:
            show_itinerary(console(), job)
        return
    finished = run_session(job, Asked(resume=resume, yes=yes), console())
    if as_json and finished.result.end is RunEnd.DONE:
        print_json(figures(job, finished))
    else:
        show_result(console(), job, finished)
    if finished.problem is not None:
        raise finished.problem
    if finished.result.end is RunEnd.INTERRUPTED:
        raise typer.Exit(130)
