"""``elastocal tool``: tool weight, sensor bias and sensor rotation from static postures."""

from pathlib import Path
from typing import Annotated

import typer


def tool(
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
    as_json: Annotated[
        bool, typer.Option("--json", help="Print what was written as one JSON object.")
    ] = False,
) -> None:
    """Find mass, centre of mass, sensor bias and sensor rotation from static postures."""
    from elastocal.cli.output import console, print_json
    from elastocal.cli.tool_inputs import posture_robot, three_numbers, transform
    from elastocal.cli.tool_source import from_run, from_table
    from elastocal.cli.tool_table import show_tool
    from elastocal.compensation.conditioning import (
        fit_tool,
        refuse_mistakes,
        tool_result,
        write_tool,
    )
    from elastocal.records import to_data
    from elastocal.workflows import refuse_overwriting

    refuse_overwriting(out, data)
    if data.is_dir():
        source = from_run(data)
    else:
        arm = posture_robot(robot, flange)
        source = from_table(data, arm, flange, transform(sensor), three_numbers(down))
    fit = fit_tool(source.postures, source.R_nominal, keep_rotation)
    refuse_mistakes(source.postures, fit, source.R_nominal, source.expected_centre, source.points)
    record = tool_result(fit, source.mount, str(data))
    write_tool(out, record)
    if as_json:
        print_json(to_data(record))
    else:
        show_tool(console(), record, out)
