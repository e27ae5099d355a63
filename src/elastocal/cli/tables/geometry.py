"""Print what ``geometry`` found: how far off the arm was and is, and which errors are known."""

from collections import Counter
from pathlib import Path

from rich.console import Console
from rich.table import Table

from elastocal.cli.output import print_blocks, yellow
from elastocal.geometry import (
    GeometryAccuracy,
    GeometryModel,
    PositionPlan,
    show_geometry as shown_geometry,
)
from elastocal.wording import counted

_MOST_ROWS = 12
"""Rows with blunders that are named."""


def show_geometry(
    console: Console, model: GeometryModel, accuracy: GeometryAccuracy, out: Path
) -> None:
    """Print a calibrated geometry for a person."""
    print_blocks(console, shown_geometry(model, accuracy))
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
