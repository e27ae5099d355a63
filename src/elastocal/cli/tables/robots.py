"""What ``elastocal robots`` shows of a robot."""

from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from elastocal.robot import catalogue

Facts = dict[str, Any]


def robot_facts(name: str) -> Facts:
    """Return a catalogue robot as JSON-ready data, SI units; unknown numbers are null."""
    robot = catalogue.load(name)
    limits = robot.limits
    return {
        "name": name,
        "reach": catalogue.entry(name).reach,
        "joints": [
            {
                "name": joint,
                "lower": _known(limits.lower[index]),
                "upper": _known(limits.upper[index]),
                "velocity": _known(limits.velocity[index]),
                "effort": _known(limits.effort[index]),
            }
            for index, joint in enumerate(robot.joint_names)
        ],
        "sources": dict(catalogue.entry(name).sources),
        "assumptions": {a.field: a.reason for a in robot.assumptions},
    }


def show_robots(console: Console, rows: list[Facts]) -> None:
    """Print a line a robot."""
    table = Table(box=None, pad_edge=False)
    table.add_column("robot")
    table.add_column("reach", justify="right")
    for heading in ("limits", "speeds", "torques", "masses"):
        table.add_column(heading)
    for row in rows:
        reach = f"{row['reach']:.3f} m" if row["reach"] else "-"
        table.add_row(row["name"], reach, *_marks(row))
    console.print(table)
    console.print(
        "\n[dim]sourced: from a named source; assumed: no source, never used silently; -: not"
        " known. `elastocal robots NAME` shows every source.[/dim]"
    )


def show_robot(console: Console, row: Facts) -> None:
    """Print one robot with its sources."""
    console.print(f"[bold]{row['name']}[/bold]")
    table = Table(box=None, pad_edge=False)
    for heading in ("joint", "from", "to", "speed", "torque"):
        table.add_column(heading, justify="left" if heading == "joint" else "right")
    for joint in row["joints"]:
        table.add_row(
            joint["name"],
            _degrees(joint["lower"], "°"),
            _degrees(joint["upper"], "°"),
            _degrees(joint["velocity"], "°/s"),
            "-" if joint["effort"] is None else f"{joint['effort']:.0f} N·m",
        )
    console.print(table)
    for title, texts in (("source of", row["sources"]), ("assumed", row["assumptions"])):
        for field, text in texts.items():
            console.print(f"{title} {field}: {text}", markup=False)


def _marks(row: Facts) -> tuple[str, ...]:
    fields = (("position", "lower"), ("velocity", "velocity"), ("effort", "effort"))
    marks = [
        _mark(field in row["assumptions"], all(joint[key] is not None for joint in row["joints"]))
        for field, key in fields
    ]
    return (*marks, _mark("inertia" in row["assumptions"], True))


def _mark(assumed: bool, known: bool) -> str:
    if not known:
        return "[dim]-[/dim]"
    return "[yellow]assumed[/yellow]" if assumed else "[green]sourced[/green]"


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _degrees(value: float | None, unit: str) -> str:
    return "-" if value is None else f"{np.degrees(value):.1f}{unit}"
