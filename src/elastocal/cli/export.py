"""``elastocal export``: C99 of a model and its compensator for a real-time target."""

from pathlib import Path
from typing import Annotated

import typer


def export(
    model: Annotated[Path, typer.Argument(help="Model file from calibrate.")],
    c: Annotated[Path, typer.Option("--c", help="Folder to write the C files into.")],
    *,
    settings: Annotated[
        Path | None, typer.Option(help="Settings of the compensator (.yaml).")
    ] = None,
    tool: Annotated[
        Path | None, typer.Option(help="Tool file from `elastocal tool`: weight, bias, sensor.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace files that are there.")] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print what was written as one JSON object.")
    ] = False,
) -> None:
    """Write a model as dependency-free C99 with filters, limits and a self-test."""
    import numpy as np

    from elastocal.cli.output import console, print_json
    from elastocal.compensation import read_settings
    from elastocal.compensation.conditioning import read_tool, sensor_load
    from elastocal.compensation.export import write_c
    from elastocal.compensation.online import design
    from elastocal.errors import CompensationError
    from elastocal.identification import read_model

    calibrated = read_model(model)
    chosen = None if settings is None else read_settings(settings)
    try:
        load = None if tool is None else sensor_load(read_tool(tool), calibrated.model.robot)
    except CompensationError as error:
        raise CompensationError(f"{tool}: {error}") from error
    try:
        numbers = design(calibrated, chosen, load)
    except CompensationError as error:
        raise CompensationError(f"{model}: {error}") from error
    files = write_c(c, numbers, force)
    delay = float(np.asarray(numbers.filters.delay()))
    if as_json:
        facts = {
            "folder": str(c),
            "files": list(files),
            "robot": calibrated.model.robot.name,
            "joints": numbers.joints,
            "springs": len(calibrated.model.springs),
            "cycle": numbers.settings.cycle,
            "filter_delay": delay,
            "limits": numbers.settings.limits.model_dump(),
        }
        print_json(facts)
        return
    out = console()
    out.print(f"{', '.join(files)} written to {c}")
    out.print(f"the filters delay a slow wrench by {1e3 * delay:.1f} ms")
    if load is None:
        out.print(
            "no --tool: wrenches are taken as at the tool centre point, in its axes, bias and tool"
            " weight removed"
        )
