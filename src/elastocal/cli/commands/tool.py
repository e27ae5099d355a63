"""``elastocal tool``: tool weight, sensor bias, drift and matrix from static postures."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output, tables


def _tool(  # noqa: PLR0913 - one parameter an option
    data: Annotated[
        Path, typer.Argument(help="CSV of postures with raw wrenches, or the folder of a run.")
    ],
    out: Annotated[Path, typer.Option(help="Tool file (.json) to write.")],
    *,
    robot: Annotated[
        str | None,
        typer.Option(
            help="URDF, catalogue name or model (.json), for a CSV with joints.",
            autocompletion=options.robot_names,
        ),
    ] = None,
    flange: Annotated[
        str | None, typer.Option(help="Link that the sensor sits on; default: flange.")
    ] = None,
    sensor: Annotated[
        str | None,
        typer.Option(
            help="Sensor in that link as mounted: 'x, y, z, a, b, c' with units; default: the link."
        ),
    ] = None,
    down: Annotated[
        str | None, typer.Option(help="Direction of gravity in base: 'x, y, z'; default: 0, 0, -1.")
    ] = None,
    mass: Annotated[
        str | None, typer.Option(help="Mass of the tool as weighed, e.g. '43 kg', for a CSV.")
    ] = None,
    free_rotation: Annotated[
        bool,
        typer.Option(
            "--free-rotation/--keep-rotation",
            help="Find the sensor's rotation where unseen postures speak for it, or take it as"
            " mounted.",
        ),
    ] = False,
    matrix: Annotated[
        bool,
        typer.Option(
            "--matrix",
            help="Correct readings by the calibration matrix, too (then derive --tool as well).",
        ),
    ] = False,
    cross_talk: Annotated[
        float, typer.Option(help="Cross-talk by the sensor's data sheet, a share of its ranges.")
    ] = 0.01,
    force: options.Force = False,
    as_json: options.Written = False,
) -> None:
    """Find mass, centre of mass and sensor bias from static postures, and what else they carry."""
    from elastocal.records import to_data

    result = workflows.tool(
        data,
        out=out,
        robot=robot,
        flange=flange,
        sensor=sensor,
        down=None if down is None else options.parse_direction(down),
        mass=mass,
        free_rotation=free_rotation,
        matrix=matrix,
        cross_talk=cross_talk,
        force=force,
    )
    if as_json:
        # What this command always printed: the file without its schema.
        output.print_json({key: value for key, value in to_data(result).items() if key != "schema"})
    else:
        tables.show_tool(output.console(), result, out)
