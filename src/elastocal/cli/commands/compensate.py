"""``elastocal compensate``: a programmed path with its forces, corrected offline."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output, tables


def _compensate(  # noqa: PLR0913 (a command has as many options as it has)
    model: Annotated[Path, typer.Argument(help="Model file from calibrate.")],
    path: Annotated[Path, typer.Argument(help="Path, .csv, or KUKA program, .src beside .dat.")],
    out: Annotated[Path, typer.Option(help="CSV, or .src, to write.")],
    *,
    forces: Annotated[
        Path | None,
        typer.Option(help="Forces of a KUKA program: CSV with the columns point, force_x[N] …"),
    ] = None,
    base: Annotated[
        str | None,
        typer.Option(help="A program's $BASE in the model's base: 'x, y, z, a, b, c' with units."),
    ] = None,
    start: Annotated[str | None, typer.Option(help=options.START_HELP)] = None,
    largest: Annotated[
        str, typer.Option("--limit", help="Largest correction, deflection and geometry together.")
    ] = "20 mm",
    tool: options.NewTool = None,
    tool_mass: options.ToolMass = None,
    tool_centre: options.ToolCentre = None,
    geometry: options.Geometry = None,
    payload: options.Payload = None,
    payload_centre: options.PayloadCentre = None,
    program: Annotated[
        str | None,
        typer.Option(help="Of a .csv path: write it as a robot program of this name, too."),
    ] = None,
    language: options.Language = None,
    speed: Annotated[str, typer.Option(help="Speed of the tool in that program.")] = "50 mm/s",
    force: options.Force = False,
    as_json: options.Figures = False,
) -> None:
    """Correct a programmed path so that the loaded tool is where it was programmed."""
    from elastocal.errors import UnitError
    from elastocal.units import parse_quantity

    limit = parse_quantity(largest, "length")
    if not limit > 0.0:
        raise UnitError(f"--limit {largest!r} must be above 0")
    along = parse_quantity(speed, "speed")
    if not along > 0.0:
        raise UnitError(f"--speed {speed!r} must be above 0")
    given = workflows.CompensateSettings(
        model,
        path=path,
        out=out,
        forces=forces,
        base=base,
        start=start,
        largest=limit,
        tool_frame=tool,
        tool_mass=tool_mass,
        tool_centre=tool_centre,
        geometry=geometry,
        payload=payload,
        payload_centre=payload_centre,
        program=program,
        language=language,
        speed=along,
        force=force,
    )
    with output.progress_bars() as progress:
        result = workflows.compensate(given, progress)
    if as_json:
        output.print_json(result)
    else:
        tables.show_compensation(output.console(), result, out)
