"""One HTML page that shows a plan: a view to turn, its key figures and a table of its poses."""

import json
from pathlib import Path

from elastocal.cell import Cell
from elastocal.files import write_text
from elastocal.planning import (
    PlanResult,
    PoolData,
    PoseRecord,
    ProductionRecord,
    check_plan_robot,
    check_pool_of,
)
from elastocal.planning.surface import Surface
from elastocal.report.pages.templating import render
from elastocal.report.plots import PlanView, plan_view, weakest_margins
from elastocal.wording import duration, millimetres, readable, um


def write_plan_page(
    path: Path, cell: Cell, surface: Surface, plan: PlanResult, pool: PoolData
) -> Path:
    """Write the interactive page of a plan, atomically; return its path.

    Parameters
    ----------
    path : Path
        An HTML file.
    cell, surface : Cell, Surface
        That the plan was made for.
    plan, pool : PlanResult, PoolData
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
    view = plan_view(cell, surface, plan, pool)
    worst = weakest_margins(pool).label
    page = render(
        "plan.html",
        title=f"Calibration plan: {plan.cell.name}",
        styles=("plan.css",),
        scripts=("view.js", "plan.js"),
        interactive=True,
        data=view_data(view, plan, pool),
        plan=plan,
        figures=key_figures(plan),
        rows=[(pose.id, _cells(plan, pose, worst[pose.candidate])) for pose in plan.poses],
        expected=[
            (
                each.poses,
                um(each.noise),
                "not known" if production.floor is None else um(each.error),
                f"{plan.time_of(each.poses) / 60.0:.0f} min",
            )
            for production in [plan.production]
            if production is not None
            for each in production.some_expected()
        ],
        notes=[layer.note for layer in view.layers if layer.note],
    )
    write_text(path, page)
    return Path(path)


def key_figures(plan: PlanResult) -> tuple[tuple[str, str], ...]:
    """Return the figures at the head of the page, as name and value with its unit."""
    search, pool = plan.search, plan.pool
    asked = f" (asked: {readable(search.d_max, 'm')})" if search.d_max is not None else ""
    return (
        ("Poses", str(len(plan.poses))),
        ("Covering radius", readable(search.covering_radius, "m") + asked),
        ("Total time", duration(plan.total_time)),
        ("of it on the way", duration(plan.travel_time)),
        ("Points with a posture", f"{pool.valid} of {pool.sampled}"),
        ("Check that refused most", pool.bottleneck or "none"),
        *(_covered(plan.production) if plan.production is not None else ()),
    )


def _covered(production: ProductionRecord) -> tuple[tuple[str, str], ...]:
    found = production.expected_of(production.poses)
    error = (("Expected error on production", um(found.error)),) if found is not None else ()
    return (("Production covered", f"{production.coverage.covered:.0%}"), *error)


def _cells(plan: PlanResult, pose: PoseRecord, worst: str) -> list[str]:
    way = sum(move.duration for move in plan.moves if move.end == pose.id)
    return [
        str(plan.search.order.index(pose.id)),
        *(f"{1e3 * value + 0.0:.1f}" for value in pose.tcp_position),
        worst,
        pose.seen_by or "no station",
        duration(way),
        duration(pose.contact_time),
    ]


def view_data(view: PlanView, plan: PlanResult, pool: PoolData) -> dict[str, object]:
    """Return the data from which the script of a page shows a view.

    Parameters
    ----------
    view : PlanView
        From `plan_view`.
    plan, pool : PlanResult, PoolData
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
