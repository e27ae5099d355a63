"""Print the robots of the catalogue, and what ``init``, ``plan`` and ``run`` made.

A plan's poses and their checks, the steps of a run.
"""

import numpy as np
from rich.console import Console
from rich.table import Table

from elastocal.cli.output import bold, dim, green, print_blocks, print_remarks, visible, yellow
from elastocal.planning import PlanResult, show_plan as shown_plan
from elastocal.procedure import RunSummary
from elastocal.records import record
from elastocal.robot import catalogue
from elastocal.workflows import DryRunResult, InitResult, PlanFigures, RunResult

_LOST_SHOWN = 5
"""Readings that are not ok of which the reason is printed."""


def show_example(console: Console, result: InitResult) -> None:
    """Print where an example cell was written, and what comes next."""
    cell = str(result.cell)
    process = () if result.process is None else (result.process,)
    names = ", ".join(path.name for path in (*result.meshes, *process))
    console.print(
        f"wrote {bold(cell)} and {names}: edit it, then `elastocal check {cell}`",
        soft_wrap=True,
    )


def show_plan(console: Console, plan: PlanResult, figures: PlanFigures) -> None:
    """Print the plan for a person."""
    print_blocks(console, shown_plan(plan))
    if plan.production is not None:
        for name, text in plan.production.facts():
            console.print(f"{name}: {text}", soft_wrap=True)
    if figures.stations:
        seen = ", ".join(f"{name} {count}" for name, count in figures.stations.items())
        console.print(f"marker seen by: {seen}")
    print_remarks(console, "note", plan.findings)
    program = getattr(figures.program, "values", {}).get("reason", figures.program)
    console.print(f"robot program: {program}", soft_wrap=True)
    written = f"written to {figures.folder}: {', '.join(figures.files)}"
    console.print(written if figures.files else "Nothing was written.", soft_wrap=True)


@record()
class _StepFigures:
    """A step of ``run --dry-run --json``."""

    pose: int | None
    step: str
    what: str
    seconds: float


@record()
class _DryRunFigures:
    """The figures of ``run --dry-run --json``."""

    poses: int
    load_cases: tuple[str, ...]
    force_limit: float
    seconds: float
    warnings: tuple[str, ...]
    steps: tuple[_StepFigures, ...]


def dry_figures(found: DryRunResult) -> _DryRunFigures:
    """Return the steps of a run as its record."""
    return _DryRunFigures(
        poses=found.poses,
        load_cases=found.load_cases,
        force_limit=found.force_limit,
        seconds=found.seconds,
        warnings=found.warnings,
        steps=tuple(
            _StepFigures(step.pose, step.step.value, step.what, round(step.seconds, 3))
            for step in found.steps
        ),
    )


def show_itinerary(console: Console, found: DryRunResult) -> None:
    """Print what a run would take; its poses are for standard output, its steps for ``--json``."""
    console.print(
        f"{found.poses} poses, {len(found.load_cases)} load cases,"
        f" about {found.seconds / 60.0:.0f} min; force limit {found.force_limit:.0f} N."
        " Nothing was moved.",
        soft_wrap=True,
    )
    print_remarks(console, "warning", found.warnings)


def show_run(console: Console, result: RunResult) -> None:
    """Print how a run ended."""
    found = result.figures
    derived = "" if found.dataset else ", not derived"
    console.print(
        f"{found.state}: {found.committed} of {found.poses} poses committed"
        f" ({found.counts() or 'no readings'}{derived}),"
        f" {found.seconds / 60.0:.1f} min,"
        f" failed attempts: {found.failed_attempts}; the arm is {found.arm}",
        soft_wrap=True,
    )
    if found.message:
        console.print(found.message, soft_wrap=True)
    for line in found.lines:
        console.print(visible(line.sentence()), soft_wrap=True)
    if found.dataset:
        print_remarks(console, "warning", found.warnings)
        _show_lost(console, result.summary)
        console.print(
            f"wrote {bold(found.dataset)} and summary.json:"
            f" `elastocal calibrate {found.dataset} --out model.json`",
            soft_wrap=True,
        )


def _show_lost(console: Console, summary: RunSummary | None) -> None:
    """Print the first readings that are not ok, with why."""
    lost = () if summary is None else summary.readings.not_ok
    for each in lost[:_LOST_SHOWN]:
        line = f"   pose {each.pose}, {each.load_case}: {each.status.value}, {each.note}"
        console.print(visible(line), soft_wrap=True)
    if len(lost) > _LOST_SHOWN:
        console.print(f"   and {len(lost) - _LOST_SHOWN} more: summary.json, readings.not_ok")


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
        dim(
            "\nsourced: from a named source; assumed: no source, never used silently; -: not"
            " known. `elastocal robots NAME` shows every source."
        )
    )


def show_robot(console: Console, row: _RobotFacts) -> None:
    """Print one robot with its sources."""
    console.print(bold(row.name))
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
            console.print(f"{title} {field}: {text}")


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
        return dim("-")
    return yellow("assumed") if assumed else green("sourced")


def _degrees(value: float | None, unit: str) -> str:
    return "-" if value is None else f"{np.degrees(value):.1f}{unit}"
