"""``elastocal plan``: from a cell to an ordered, checked, executable set of poses."""

from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output, tables


class _Purpose(StrEnum):
    """What the poses are for."""

    ELASTICITY = "elasticity"
    GEOMETRY = "geometry"
    BOTH = "both"


def _plan(  # noqa: PLR0913 - one parameter an option
    cell: Annotated[Path, typer.Argument(help="Cell file, .yaml.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder to write the plan into.")],
    *,
    compare: Annotated[
        str | None,
        options.choice(
            "technique or none",
            "Search technique to lay beside the cell's. Default: ioops beside cover, else cover.",
        ),
    ] = None,
    purpose: Annotated[
        _Purpose,
        typer.Option(
            "--for",
            help="elasticity: presses on the tooling; geometry: positions in free space for"
            " elastocal geometry; both: presses, then positions, in one program.",
        ),
    ] = _Purpose.ELASTICITY,
    search: Annotated[
        str | None,
        options.choice("technique", "With --for geometry: search technique; default: i_optimal."),
    ] = None,
    poses: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=100_000,
            help="Number of poses; default: search.poses of the cell file; 60 for geometry.",
        ),
    ] = None,
    free_poses: Annotated[
        int | None,
        typer.Option(
            "--positions", min=1, max=100_000, help="With --for both: number of these; default: 60."
        ),
    ] = None,
    program: Annotated[
        str | None,
        typer.Option(help="Name of the robot program; default: calib, or positions."),
    ] = None,
    language: options.Language = None,
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
    from elastocal.errors import PlanningError

    if free_poses is not None and purpose is not _Purpose.BOTH:
        raise PlanningError("--positions is for --for both")
    if purpose is _Purpose.GEOMETRY:
        if dry_run or compare or jobs:
            raise PlanningError("--dry-run, --compare and --jobs are for presses, not for geometry")
        free = workflows.PlanPositionsSettings(
            cell,
            out,
            poses=poses or 60,
            search=search or "i_optimal",
            program=program or "positions",
            language=language,
            force=force,
        )
        _plan_positions(free, out, as_json)
        return
    if search is not None:
        raise PlanningError("--search is for --for geometry: the cell file names its technique")
    program = program or "calib"
    settings = workflows.PlanSettings(
        cell,
        out,
        compare,
        program,
        jobs,
        force,
        dry_run,
        poses,
        language,
        (free_poses or 60) if purpose is _Purpose.BOTH else None,
    )
    with output.progress_bars() as progress:
        found = workflows.plan(settings, progress)
    _show_plan(settings, found, as_json)


def _plan_positions(settings: "workflows.PlanPositionsSettings", out: Path, as_json: bool) -> None:
    with output.progress_bars() as progress:
        found = workflows.plan_positions(settings, progress)
    if as_json:
        output.print_json(found)
    else:
        tables.show_position_plan(output.console(), found, out)


def _show_plan(
    settings: "workflows.PlanSettings", found: "workflows.PlanResult", as_json: bool
) -> None:
    from elastocal.geometry import PositionPlan
    from elastocal.planning.export import pose_lines
    from elastocal.records import read_json

    out = Path(settings.out)
    free = None
    if settings.free_poses is not None:
        free = read_json(out / workflows.POSITION_PLAN, PositionPlan)
    figures = workflows.plan_figures(found, out, settings.program, settings.language, free)
    if settings.dry_run:
        figures = replace(figures, files=())
    if as_json:
        output.print_json(figures)
        return
    if settings.dry_run:
        output.print_lines(pose_lines(found))
    tables.show_plan(output.console(), found, figures)
    if free is not None:
        tables.show_position_plan(output.console(), free, out)
