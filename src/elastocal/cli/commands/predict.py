"""``elastocal predict``: the deflection of each row of joints and force."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output


def _predict(  # noqa: PLR0913 (a command has as many options as it has)
    model: Annotated[Path, typer.Argument(help="Model file from calibrate.")],
    rows: Annotated[Path, typer.Argument(help="CSV: joint columns, force_x[N] …, moment_x[N*m] …")],
    out: Annotated[Path, typer.Option(help="CSV to write.")],
    *,
    tool: options.NewTool = None,
    tool_mass: options.ToolMass = None,
    tool_centre: options.ToolCentre = None,
    geometry: options.Geometry = None,
    payload: options.Payload = None,
    payload_centre: options.PayloadCentre = None,
    force: options.Force = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print a summary as one JSON object.")
    ] = False,
) -> None:
    """Predict the deflection of each row, with 95 % intervals of the fit and of a measurement."""
    result = workflows.predict(
        model,
        rows=rows,
        out=out,
        tool_frame=tool,
        tool_mass=tool_mass,
        tool_centre=tool_centre,
        geometry=geometry,
        payload=payload,
        payload_centre=payload_centre,
        force=force,
    )
    if as_json:
        output.print_json(result.summary)
        return
    figures, size = result.summary, result.summary.deflection
    output.console().print(
        f"{figures.rows} rows: predicted deflection {1e3 * size.mean:.3f} mm mean,"
        f" {1e3 * size.max:.3f} mm max; written to {out}",
        soft_wrap=True,
    )
    output.console().print(f"tool: {figures.tool}", soft_wrap=True)
    for note in figures.notes:
        output.console().print(f"Note: {note}", soft_wrap=True)
    if figures.warning:
        output.console().print(f"{output.yellow('warning:')} {figures.warning}", soft_wrap=True)
    if figures.misfit is None:
        output.console().print(
            "Note: the model does not know its errors at left-out poses, so that there are no"
            " intervals of what would be measured; calibrate again to have them",
            soft_wrap=True,
        )
