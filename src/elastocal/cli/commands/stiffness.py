"""``elastocal stiffness``: which posture is stiffest along a path (paper section 4.3.1)."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output, tables


def _stiffness(  # noqa: PLR0913 (a command has as many options as it has)
    model: Annotated[Path, typer.Argument(help="Model file from calibrate.")],
    path: Annotated[Path, typer.Argument(help="CSV as for compensate; forces are not needed.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder to write into.")],
    *,
    direction: Annotated[
        str, typer.Option(help="'normal' (axis of the tool) or a vector in base: '1,0,0'.")
    ] = "normal",
    spins: Annotated[
        int, typer.Option(min=1, max=3600, help="Turns about the tool's axis to try.")
    ] = 36,
    stands: Annotated[
        int,
        typer.Option(
            min=1, max=1000, help="Positions of each external axis to try (with --cell: its)."
        ),
    ] = 9,
    stations: Annotated[
        int, typer.Option(min=1, max=100_000, help="Rows of the path to look at.")
    ] = 60,
    cell: Annotated[
        Path | None, typer.Option(help="Cell file: its margins, tooling and fixtures.")
    ] = None,
    start: Annotated[str | None, typer.Option(help=options.START_HELP)] = None,
    tool: options.NewTool = None,
    tool_mass: options.ToolMass = None,
    tool_centre: options.ToolCentre = None,
    force: Annotated[bool, typer.Option("--force", help="Replace files that are there.")] = False,
    as_json: options.KeyFigures = False,
) -> None:
    """Map the stiffness over spin, rail and path; choose the stiffest posture."""
    from elastocal.records import to_data

    given = workflows.StiffnessSettings(
        model,
        path=path,
        out=out,
        direction=direction,
        spins=spins,
        external_positions=stands,
        stations=stations,
        cell=cell,
        start=start,
        force=force,
        tool_frame=tool,
        tool_mass=tool_mass,
        tool_centre=tool_centre,
    )
    with output.progress_bars() as progress:
        result = workflows.stiffness(given, progress)
    if as_json:
        output.print_json(to_data(result.summary) | {"folder": str(out)})
    else:
        tables.show_stiffness(output.console(), result)
        output.console().print(f"written to {out}: {', '.join(result.summary.files)}")
