"""``elastocal live``: a programmed path corrected while it is run."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output


def _live(  # noqa: PLR0913 - one parameter an option
    cell: Annotated[Path, typer.Argument(help="Cell file, .yaml.")],
    model: Annotated[Path, typer.Option(metavar="MODEL.json", help="Model file from calibrate.")],
    *,
    arm: Annotated[
        bool, typer.Option("--arm", help="A person has looked at the cell: correct the arm.")
    ] = False,
    duration: Annotated[
        str | None, typer.Option(help="End after this time, '60 s'; default: at Ctrl-C.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Folder for the log and the record.")
    ] = None,
    settings: options.CompensatorFile = None,
    tool: options.NewToolOrFile = None,
    tool_mass: options.ToolMass = None,
    tool_centre: options.ToolCentre = None,
    force: Annotated[bool, typer.Option("--force", help="Replace files that are there.")] = False,
    as_json: options.Figures = False,
) -> None:
    """Correct a path by the measured wrench while its program runs; soft real time."""
    from elastocal.cli._operator import LiveView, interruption
    from elastocal.errors import DeviceError

    screen = output.console()
    files, frame = options.split_tools(tool)
    with interruption() as interrupted, LiveView(screen) as view:
        result = workflows.live(
            cell,
            model=model,
            arm=arm,
            duration=duration,
            out=out,
            compensator=settings,
            tool=options.only_tool(files),
            tool_frame=frame,
            tool_mass=tool_mass,
            tool_centre=tool_centre,
            force=force,
            report=view.tell,
            warn=lambda text: output.print_remarks(screen, "warning", [text]),
            interrupted=interrupted,
        )
    if as_json:
        output.print_json(result)
    else:
        for label, text in result.facts():
            screen.print(f"{label}: {text}", soft_wrap=True)
    if result.problem is not None:
        raise DeviceError(result.problem)
