"""``elastocal robots``: the robot catalogue, with where its numbers come from."""

from typing import Annotated

import typer


def robots(
    name: Annotated[str | None, typer.Argument(help="Show one robot in full.")] = None,
    urdf: Annotated[
        bool, typer.Option("--urdf", help="Print the named robot's URDF on standard output.")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the catalogue as one JSON object.")
    ] = False,
) -> None:
    """List the robots that elastocal knows, with the source of each number."""
    from elastocal.cli.output import console, print_json
    from elastocal.cli.tables import robot_facts, show_robot, show_robots
    from elastocal.errors import RobotError
    from elastocal.robot import catalogue

    if urdf:
        if name is None:
            raise RobotError("--urdf needs the name of a robot (see `elastocal robots`)")
        typer.echo(catalogue.urdf(name), nl=False)
        return
    chosen = [catalogue.entry(name).name] if name else list(catalogue.names())
    rows = [robot_facts(robot) for robot in chosen]
    if as_json:
        print_json({"robots": rows})
    elif name:
        show_robot(console(), rows[0])
    else:
        show_robots(console(), rows)
