"""``elastocal plan``: from a cell to an ordered, checked, executable set of poses."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output, tables


def _plan(  # noqa: PLR0913 - one parameter an option
    cell: Annotated[Path, typer.Argument(help="Cell file, .yaml.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder to write the plan into.")],
    *,
    compare: Annotated[
        str | None,
        typer.Option(
            help="Search technique to lay beside the cell's, or none."
            " Default: ioops beside cover, else cover."
        ),
    ] = None,
    poses: Annotated[
        int | None,
        typer.Option(min=1, help="Number of poses; default: search.poses of the cell file."),
    ] = None,
    program: Annotated[str, typer.Option(help="Name of the robot program.")] = "calib",
    language: Annotated[
        str | None,
        typer.Option(
            help="Language of the robot program: krl, rapid, fanuc, urscript or none."
            " Default: that of the robot's maker."
        ),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option(min=1, max=1024, help="Processes for large pools; default: all cores."),
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Replace the files of a plan that is there.")
    ] = False,
    dry_run: Annotated[
        bool,
        typer.Option(
            "--dry-run", help="Write nothing; a line a pose on standard output: id, time, joints."
        ),
    ] = False,
    as_json: options.KeyFigures = False,
) -> None:
    """Choose calibration poses on the tooling, check them, and put them in order."""
    from elastocal.planning.export import pose_lines

    settings = workflows.PlanSettings(
        cell, out, compare, program, jobs, force, dry_run, poses, language
    )
    with output.progress_bars() as progress:
        found = workflows.plan(settings, progress)
    figures = workflows.plan_figures(found, out, program, language)
    if dry_run:
        figures = replace(figures, files=())
    if as_json:
        output.print_json(figures)
    else:
        tables.show_plan(output.console(), found, figures)
        if dry_run:
            output.print_lines(pose_lines(found))
