"""``elastocal simulate-process``: the paper's Table 1 of a simulated cell."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output, tables


def _simulate_process(  # noqa: PLR0913 (a command has as many options as it has)
    cell: Annotated[Path, typer.Argument(help="Cell file, .yaml.")],
    model: Annotated[
        list[Path],
        typer.Option(help="Model of this cell from calibrate; once, or once for each --seed."),
    ],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder to write into.")],
    *,
    process: Annotated[
        str | None,
        options.choice("process", "Courses of fibre, or rings of a dome."),
    ] = None,
    path: Annotated[
        Path | None,
        typer.Option(help="Or a process of your own: CSV as for compensate; course, time[s]."),
    ] = None,
    speed: Annotated[
        str | None, typer.Option(help="Of --path, '0.1 m/s'; default: its column time[s].")
    ] = None,
    direction: Annotated[
        str, typer.Option(help="Of --path, what counts: lateral, normal or a vector in base.")
    ] = "lateral",
    start: Annotated[str | None, typer.Option(help=options.START_HELP)] = None,
    posture: Annotated[
        str,
        options.choice("posture", "As programmed, or the tool turned as the model says."),
    ] = "programmed",
    load: Annotated[
        str | None,
        typer.Option(help="Also at these shares of the force: '0.5,-1'; -1 turns it aside."),
    ] = None,
    tool: options.NewToolOrFile = None,
    tool_mass: options.ToolMass = None,
    tool_centre: options.ToolCentre = None,
    seed: Annotated[
        list[int] | None,
        typer.Option(min=0, help="Of forces and devices; as for run. Repeat it for more."),
    ] = None,
    settings: options.CompensatorFile = None,
    courses: Annotated[
        int | None, typer.Option(min=1, max=1000, help="Courses or rings; default: 5.")
    ] = None,
    budget: Annotated[
        bool, typer.Option("--budget", help="Switch each effect off in turn, for the first seed.")
    ] = False,
    jobs: Annotated[
        int | None, typer.Option(min=1, max=1024, help="Processes; default: all cores.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace files that are there.")] = False,
    as_json: options.Figures = False,
) -> None:
    """Run a process on the simulated cell without and with correction: how much is left."""
    from elastocal.records import to_data
    from elastocal.units import parse_quantity

    tools, frame = options.split_tools(tool)
    given = workflows.SimulateProcessSettings(
        cell,
        models=tuple(model),
        out=out,
        kind=process,
        path=path,
        speed=None if speed is None else parse_quantity(speed, "speed"),
        direction=direction,
        start=start,
        loads=options.parse_loads(load),
        posture=posture,
        tools=tools,
        seeds=tuple(seed or (0,)),
        compensator=settings,
        courses=courses,
        budget=budget,
        jobs=jobs,
        force=force,
        tool_frame=frame,
        tool_mass=tool_mass,
        tool_centre=tool_centre,
    )
    with output.progress_bars() as progress:
        result = workflows.simulate_process(given, progress)
    if as_json:
        output.print_json(to_data(result) | {"folder": str(out)})
    else:
        tables.show_process(output.console(), result)
        output.console().print(f"written to {out}")
