"""What ``elastocal plan`` tells: the poses, how they lie, and what refused the others."""

import math

from rich.console import Console
from rich.table import Table

from elastocal.planning import PlanResult, SpreadRecord
from elastocal.workflows import PlanFigures


def show_plan(console: Console, plan: PlanResult, figures: PlanFigures) -> None:
    """Print the plan for a person."""
    search, pool = plan.search, plan.pool
    console.print(
        f"[bold]{len(plan.poses)} poses[/bold] by {search.name} from {pool.valid} candidates"
        f" ({pool.sampled} points tried); covering radius"
        f" {1e3 * search.covering_radius:.1f} mm; about {_minutes(plan.total_time)}"
        f" ({_minutes(plan.travel_time)} on the way)"
    )
    console.print(_spread_table(plan))
    console.print(_check_table(plan))
    if figures.stations:
        seen = ", ".join(f"{name} {count}" for name, count in figures.stations.items())
        console.print(f"marker seen by: {seen}", markup=False)
    for finding in plan.findings:
        console.print(f"note: {finding}", markup=False, soft_wrap=True)
    written = ", ".join(figures.files)
    console.print(f"written to {figures.folder}: {written}", markup=False, soft_wrap=True)


def _spread_table(plan: PlanResult) -> Table:
    table = Table(title="How the poses lie in the pool", title_justify="left")
    table.add_column("technique")
    for title in ("covering radius", "to the edge, mean", "to the next pose, mean", "O1"):
        table.add_column(title, justify="right")
    rows = [(plan.search.name, plan.search.spread)]
    if plan.comparison:
        rows.append((f"{plan.comparison.name} (not used)", plan.comparison.spread))
    for name, spread in rows:
        table.add_row(name, *_lengths(spread), f"{spread.o1:.4g}")
    return table


def _lengths(spread: SpreadRecord) -> list[str]:
    values = (spread.covering_radius, spread.boundary_distance, spread.nearest_neighbour)
    return ["none" if value is None else f"{1e3 * value:.1f} mm" for value in values]


def _check_table(plan: PlanResult) -> Table:
    """Return what each check refused, and how near the chosen poses come to it."""
    table = Table(title="Checks", title_justify="left")
    table.add_column("check")
    for title in ("points refused", "smallest margin of a pose", "at pose"):
        table.add_column(title, justify="right")
    for check in plan.pool.checks:
        margins = {
            pose.id: pose.margins[check.name] for pose in plan.poses if check.name in pose.margins
        }
        worst = min(margins, key=lambda pose: margins[pose], default=None)
        mark = " <- most" if check.name == plan.pool.bottleneck else ""
        table.add_row(
            check.name,
            f"{check.refused}{mark}",
            "" if worst is None else _with_unit(margins[worst], check.unit),
            "" if worst is None else str(worst),
        )
    return table


def _with_unit(margin: float, unit: str | None) -> str:
    if unit == "m":
        return f"{1e3 * margin:.1f} mm"
    if unit == "rad":
        return f"{math.degrees(margin):.1f} deg"
    return f"{margin:.3f}" if unit in (None, "1") else f"{margin:.1f} {unit}"


def _minutes(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest:02d} s" if minutes else f"{rest} s"
