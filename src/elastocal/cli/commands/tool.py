"""``elastocal tool``: tool weight, sensor bias and sensor rotation from static postures."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output, tables


def _tool(
    data: Annotated[
        Path, typer.Argument(help="CSV of postures with raw wrenches, or the folder of a run.")
    ],
    out: Annotated[Path, typer.Option(help="Tool file (.json) to write.")],
    *,
    robot: Annotated[
        str | None,
        typer.Option(help="URDF, catalogue name or model (.json), for a CSV with joints."),
    ] = None,
    flange: Annotated[str, typer.Option(help="Link that the sensor sits on.")] = "flange",
    sensor: Annotated[
        str, typer.Option(help="Sensor in that link as mounted: 'x, y, z, a, b, c' with units.")
    ] = "0 mm, 0 mm, 0 mm, 0 deg, 0 deg, 0 deg",
    down: Annotated[str, typer.Option(help="Direction of gravity in base: 'x, y, z'.")] = (
        "0, 0, -1"
    ),
    keep_rotation: Annotated[
        bool, typer.Option("--keep-rotation", help="Take the mounted rotation as it is.")
    ] = False,
    as_json: options.Written = False,
) -> None:
    """Find mass, centre of mass, sensor bias and sensor rotation from static postures."""
    from elastocal.records import to_data

    result = workflows.tool(
        data,
        out=out,
        robot=robot,
        flange=flange,
        sensor=sensor,
        down=options.parse_direction(down),
        keep_rotation=keep_rotation,
    )
    if as_json:
        # What this command always printed: the file without its schema.
        output.print_json({key: value for key, value in to_data(result).items() if key != "schema"})
    else:
        tables.show_tool(output.console(), result, out)
