"""One HTML file that shows a plan: a view to turn, its key figures and a table of its poses.

It holds all that it needs, the drawing library included, and asks the network for nothing: its
content security policy forbids it to.
"""

import json
from html import escape
from pathlib import Path
from string import Template
from typing import Any

from plotly.offline import get_plotlyjs

from elastocal.cell import Cell
from elastocal.files import write_text
from elastocal.planning import PlanFile, PoolData, PoseRecord, check_pool_of
from elastocal.planning.surface import Surface
from elastocal.report.pages.templating import POLICY, embedded, template
from elastocal.report.plots import (
    PlanView,
    plan_view,
    weakest_margins,
)
from elastocal.verdict.consistency import check_plan_robot
from elastocal.wording import duration, millimetres, readable


def write_plan_page(
    path: Path, cell: Cell, surface: Surface, plan: PlanFile, pool: PoolData
) -> Path:
    """Write the interactive page of a plan, atomically; return its path.

    Parameters
    ----------
    path : Path
        An HTML file.
    cell, surface : Cell, Surface
        That the plan was made for.
    plan, pool : PlanFile, PoolData
        Of one run.

    Raises
    ------
    SchemaError
        If plan and pool are not of one run.
    PlanningError
        If the robot of the cell is another.
    FileAccessError
        If the page cannot be written.
    """
    check_pool_of(plan, pool)
    check_plan_robot(plan, cell)
    write_text(path, _page(plan_view(cell, surface, plan, pool), plan, pool))
    return Path(path)


def _page(view: PlanView, plan: PlanFile, pool: PoolData) -> str:
    worst = weakest_margins(pool).label
    made = f"{len(plan.poses)} poses chosen by {plan.search.name} for {plan.robot.name}"
    return Template(template("plan.html")).substitute(
        policy=escape(POLICY),
        title=escape(f"Calibration plan: {plan.cell.name}"),
        subtitle=escape(f"{made}. Lengths in the base frame of the robot."),
        css=template("plan.css"),
        figures="".join(_figure(name, value) for name, value in key_figures(plan)),
        findings=_findings(plan),
        last=len(plan.poses),
        first=min(1, len(plan.poses)),
        rows="".join(_row(plan, pose, worst[pose.candidate]) for pose in plan.poses),
        footer=escape(
            f"Made by elastocal {plan.elastocal} from {plan.cell.file}"
            f" (fingerprint {plan.cell.fingerprint[:12]}). Times are estimates."
            + "".join(f" {layer.note}" for layer in view.layers if layer.note)
        ),
        data=embedded(view_data(view, plan, pool)),
        plotly=get_plotlyjs(),
        script=template("view.js") + template("plan.js"),
    )


def key_figures(plan: PlanFile) -> list[tuple[str, str]]:
    """Return the figures at the head of the page, as name and value with its unit."""
    search, pool = plan.search, plan.pool
    asked = f" (asked: {readable(search.d_max, 'm')})" if search.d_max is not None else ""
    return [
        ("Poses", str(len(plan.poses))),
        ("Covering radius", readable(search.covering_radius, "m") + asked),
        ("Total time", duration(plan.total_time)),
        ("of it on the way", duration(plan.travel_time)),
        ("Points with a posture", f"{pool.valid} of {pool.sampled}"),
        ("Check that refused most", pool.bottleneck or "none"),
    ]


def _figure(name: str, value: str) -> str:
    return f"<div><dt>{escape(name)}</dt><dd>{escape(value)}</dd></div>"


def _findings(plan: PlanFile) -> str:
    if not plan.findings:
        return ""
    items = "".join(f"<li>{escape(finding)}</li>" for finding in plan.findings)
    return f'<section class="findings"><h2>Findings</h2><ul>{items}</ul></section>'


def _row(plan: PlanFile, pose: PoseRecord, worst: str) -> str:
    rank = plan.search.order.index(pose.id) + 1
    way = sum(move.duration for move in plan.moves if move.end == pose.id)
    cells = [
        str(rank),
        *(f"{1e3 * value + 0.0:.1f}" for value in pose.tcp_position),
        worst,
        pose.seen_by or "no station",
        duration(way),
        duration(pose.contact_time),
    ]
    first = f'<td><button type="button" aria-label="Show pose {pose.id}">{pose.id}</button></td>'
    return f"<tr>{first}{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}</tr>"


def view_data(view: PlanView, plan: PlanFile, pool: PoolData) -> dict[str, Any]:
    """Return what the script of a page reads to show a view.

    Parameters
    ----------
    view : PlanView
        From `plan_view`.
    plan, pool : PlanFile, PoolData
        That it shows.
    """
    worst = weakest_margins(pool).label
    layers, start = [], 0
    for layer in view.layers:
        traces = list(range(start, start + len(layer.traces)))
        start += len(layer.traces)
        layers.append(
            {"label": layer.label, "colour": layer.colour, "shown": layer.shown, "traces": traces}
        )
    poses = [
        f"Pose {pose.id}: {millimetres(pose.tcp_position)} mm"
        f" · {f'seen by {pose.seen_by}' if pose.seen_by else 'no line of sight'}"
        f" · smallest margin: {worst[pose.candidate]}"
        for pose in plan.poses
    ]
    return {
        "figure": json.loads(view.figure.to_json()),
        "layers": layers,
        "cameras": view.cameras,
        "postures": ["HOME", *poses],
    }
