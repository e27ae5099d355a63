"""``elastocal robots``: the robot catalogue, with where its numbers come from."""

from typing import Annotated

import typer

from elastocal.cli import options, output, tables


def _robots(
    name: Annotated[
        str | None,
        typer.Argument(
            help="Show one robot in full.", autocompletion=options.robot_names, show_default=False
        ),
    ] = None,
    urdf: Annotated[
        bool, typer.Option("--urdf", help="Print the named robot's URDF on standard output.")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the catalogue as one JSON object.")
    ] = False,
) -> None:
    """List the robots that elastocal knows, with the source of each number."""
    from elastocal.errors import RobotError
    from elastocal.robot import catalogue

    if urdf:
        if name is None:
            raise RobotError("--urdf needs the name of a robot (see `elastocal robots`)")
        text = catalogue.urdf(name)
        if as_json:
            output.print_json({"robot": catalogue.entry(name).name, "urdf": text})
        else:
            typer.echo(text, nl=False)
        return
    chosen = [catalogue.entry(name).name] if name else list(catalogue.names())
    rows = [tables.robot_facts(robot) for robot in chosen]
    if as_json:
        output.print_json({"robots": rows})
    elif name:
        tables.show_robot(output.console(), rows[0])
    else:
        tables.show_robots(output.console(), rows)
