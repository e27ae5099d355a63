"""Print what the catalogue knows of a robot."""

import numpy as np
from rich.console import Console
from rich.table import Table

from elastocal.records import record
from elastocal.robot import catalogue


@record()
class _JointFacts:
    """A joint in SI units; an unknown number is None."""

    name: str
    lower: float | None
    upper: float | None
    velocity: float | None
    effort: float | None


@record()
class _RobotFacts:
    """A robot of ``robots --json``."""

    name: str
    reach: float
    joints: tuple[_JointFacts, ...]
    sources: dict[str, str]
    assumptions: dict[str, str]


def robot_facts(name: str) -> _RobotFacts:
    """Return what the catalogue knows of a robot."""
    robot = catalogue.load(name)
    limits = robot.limits
    ranges = zip(limits.lower, limits.upper, limits.velocity, limits.effort, strict=True)
    return _RobotFacts(
        name,
        catalogue.entry(name).reach,
        tuple(
            _JointFacts(joint, *(float(value) if np.isfinite(value) else None for value in values))
            for joint, values in zip(robot.joint_names, ranges, strict=True)
        ),
        dict(catalogue.entry(name).sources),
        {each.field: each.reason for each in robot.assumptions},
    )


def show_robots(console: Console, rows: list[_RobotFacts]) -> None:
    """Print a line a robot."""
    table = Table(box=None, pad_edge=False)
    table.add_column("robot")
    table.add_column("reach", justify="right")
    for heading in ("limits", "speeds", "torques", "masses"):
        table.add_column(heading)
    for row in rows:
        reach = f"{row.reach:.3f} m" if row.reach else "-"
        table.add_row(row.name, reach, *_marks(row))
    console.print(table)
    console.print(
        "\n[dim]sourced: from a named source; assumed: no source, never used silently; -: not"
        " known. `elastocal robots NAME` shows every source.[/dim]"
    )


def show_robot(console: Console, row: _RobotFacts) -> None:
    """Print one robot with its sources."""
    console.print(f"[bold]{row.name}[/bold]")
    table = Table(box=None, pad_edge=False)
    for heading in ("joint", "from", "to", "speed", "torque"):
        table.add_column(heading, justify="left" if heading == "joint" else "right")
    for joint in row.joints:
        table.add_row(
            joint.name,
            _degrees(joint.lower, "°"),
            _degrees(joint.upper, "°"),
            _degrees(joint.velocity, "°/s"),
            "-" if joint.effort is None else f"{joint.effort:.0f} N·m",
        )
    console.print(table)
    for title, texts in (("source of", row.sources), ("assumed", row.assumptions)):
        for field, text in texts.items():
            console.print(f"{title} {field}: {text}", markup=False)


def _marks(row: _RobotFacts) -> tuple[str, ...]:
    fields = (("position", "lower"), ("velocity", "velocity"), ("effort", "effort"))
    marks = [
        _mark(
            field in row.assumptions, all(getattr(joint, key) is not None for joint in row.joints)
        )
        for field, key in fields
    ]
    return (*marks, _mark("inertia" in row.assumptions, True))


def _mark(assumed: bool, known: bool) -> str:
    if not known:
        return "[dim]-[/dim]"
    return "[yellow]assumed[/yellow]" if assumed else "[green]sourced[/green]"


def _degrees(value: float | None, unit: str) -> str:
    return "-" if value is None else f"{np.degrees(value):.1f}{unit}"
