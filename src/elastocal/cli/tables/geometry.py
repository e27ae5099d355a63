"""Print what ``geometry`` found: how far off the arm was and is, and which errors are known."""

from collections import Counter
from pathlib import Path

from rich.console import Console
from rich.table import Table

from elastocal.cli.output import yellow
from elastocal.geometry import GeometryAccuracy, GeometryModel, GeometryParameter, PositionPlan
from elastocal.wording import counted

_UNITS = {
    "m": (1e3, "mm"),
    "rad": (1e3, "mrad"),
    "rad/(N*m)": (1e6, "µrad/(N·m)"),
    "1": (1e6, "ppm"),
}
_MOST_ROWS = 12
"""Rows with blunders that are named."""


def show_geometry(
    console: Console, model: GeometryModel, accuracy: GeometryAccuracy, out: Path
) -> None:
    """Print a calibrated geometry for a person."""
    rungs = Table(title="errors at poses left out, mm", title_justify="left", box=None)
    for heading in ("model", "unknowns", "mean", "95 %", "largest", ""):
        rungs.add_column(heading, justify="left" if heading == "model" else "right")
    for each in model.ladder:
        figures = [f"{1e3 * x:.3f}" for x in vars(each.held_out).values()]
        rungs.add_row(each.rung, str(each.unknowns), *figures, "chosen" if each.chosen else "")
    console.print(rungs)
    table = Table(title="errors of the arm", title_justify="left", box=None)
    for heading in ("error", "value", "95 % interval", "unit", ""):
        table.add_column(
            heading, justify="right" if heading in ("value", "95 % interval") else "left"
        )
    for parameter in model.parameters:
        table.add_row(*_cells(parameter))
    console.print(table)
    _show_accuracy(console, accuracy)
    for finding in model.findings:
        console.print(f"{yellow('warning:')} {finding}", soft_wrap=True)
    blunders = model.blunders
    if blunders:
        named = ", ".join(map(str, blunders[:_MOST_ROWS]))
        more = " …" if len(blunders) > _MOST_ROWS else ""
        count = counted(len(blunders), "row")
        console.print(f"{count} left out as blunders (counted from 0): {named}{more}")
    if model.T_tcp_built is not None:
        x, y, z = 1e3 * model.T_tcp_built[:3, 3]
        console.print(f"tcp: {x:.3f}, {y:.3f}, {z:.3f} mm from where it is described")
    fixed = counted(len(model.fixed), "error")
    written = f"{fixed} not told apart from others; wrote {out}"
    console.print(written, soft_wrap=True)


def _show_accuracy(console: Console, accuracy: GeometryAccuracy) -> None:
    parts = (
        f"{each.axis} {1e3 * each.registration.rms:.3f} to {1e3 * each.chosen.rms:.3f}"
        for each in accuracy.axes
    )
    console.print(f"root mean square by axis before and after, mm: {', '.join(parts)}")
    if poses := accuracy.poses:
        largest = [
            1e3 * max(getattr(each, name) for each in poses)
            for name in ("registration", "chosen", "repeatability")
        ]
        console.print(
            f"ISO 9283, {counted(len(poses), 'repeated pose')}: AP at most {largest[0]:.3f} mm"
            f" before, {largest[1]:.3f} mm after; RP at most {largest[2]:.3f} mm",
            soft_wrap=True,
        )


def show_position_plan(console: Console, plan: PositionPlan, folder: Path) -> None:
    """Print where positions are to be measured, and what they will tell, for a person."""
    seen = Counter(pose.station for pose in plan.poses)
    stations = ", ".join(f"{counted(number, 'pose')} by {name}" for name, number in seen.items())
    console.print(
        f"{counted(len(plan.poses), 'pose')} in free space ({plan.technique}) of {plan.pool} that"
        f" can be measured, for {plan.errors} errors of the arm: {stations};"
        f" {plan.travel_time / 60.0:.0f} min on the way",
        soft_wrap=True,
    )
    table = Table(title="error of a predicted position", title_justify="left", box=None)
    table.add_column("poses", justify="right")
    table.add_column("in standard deviations of a measured coordinate", justify="right")
    for each in plan.expected:
        table.add_row(str(each.poses), f"{each.amplification:.2f}")
    console.print(table)
    for finding in plan.findings:
        console.print(f"{yellow('warning:')} {finding}", soft_wrap=True)
    refused = ", ".join(f"{name} {number}" for name, number in plan.refused.items())
    console.print(f"{plan.drawn} postures drawn; refused by {refused}", soft_wrap=True)
    console.print(f"wrote {folder}: fill the markers into its table, then elastocal geometry")


def _cells(parameter: GeometryParameter) -> tuple[str, ...]:
    scale, unit = _UNITS.get(parameter.unit, (1.0, parameter.unit))
    low, high = scale * parameter.low, scale * parameter.high
    return (
        parameter.name,
        f"{scale * parameter.value:.3f}",
        f"{low:.3f} to {high:.3f}",
        unit,
        "" if parameter.known else "not known",
    )
