"""Surface, pool and chosen poses (paper Fig. 2 and 3)."""

from functools import partial
from html import escape
from typing import Any

from elastocal.planning import PlanFile
from elastocal.report.document.markup import Markup, facts, folded, paragraph, table
from elastocal.report.document.pictures import picture
from elastocal.report.document.section import Content, Section
from elastocal.report.pages.plan_page import key_figures, view_data
from elastocal.report.pages.templating import template
from elastocal.report.plots import (
    plan_figure,
    plan_view,
)
from elastocal.verdict.evidence import Evidence
from elastocal.wording import counted, mm


def body(evidence: Evidence) -> Content:
    """Return the section."""
    plan, pool = evidence.plan, evidence.pool
    if plan is None:
        return Content(
            paragraph("The plan is not known, so nothing is said of how the poses were chosen.")
        )
    html = facts(key_figures(plan)) + _choice(plan)
    if pool is None or evidence.surface is None or evidence.cell is None:
        told = paragraph("Without cell, mesh and pool there is no picture.")
        return Content(html + told + _notes(plan) + _poses(plan))
    view = plan_view(evidence.cell, evidence.surface, plan, pool)
    data: dict[str, Any] = view_data(view, plan, pool)
    labels = {"last": str(len(plan.poses)), "first": str(min(1, len(plan.poses)))}
    html += _filled(template("report_view.html"), labels)
    html += picture(
        partial(plan_figure, evidence.surface, plan, pool),
        _alt(plan),
        "After the paper's Fig. 3: the surface unrolled; colour is the distance of each candidate"
        " from its nearest chosen pose.",
        ".png",
    )
    return Content(html + _notes(plan) + _poses(plan, shown=True), data)


def _poses(plan: PlanFile, shown: bool = False) -> str:
    """Return the table of the poses, with buttons where there is a view that shows them."""
    rows = [
        (
            _button(pose.id) if shown else str(pose.id),
            str(plan.search.order.index(pose.id) + 1),
            *(f"{1e3 * value + 0.0:.1f}" for value in pose.tcp_position),
            pose.seen_by or "no station",
        )
        for pose in plan.poses
    ]
    heads = ("Pose", "Chosen as no.", "x in mm", "y in mm", "z in mm", "Seen by")
    inner = table("Poses in visiting order, contact point in base", heads, rows)
    told = f"The {counted(len(plan.poses), 'pose')} in visiting order"
    return folded(told, f'<div id="pose-table">{inner}</div>')


def _button(pose: int) -> Markup:
    return Markup(f'<button type="button" aria-label="Show pose {pose}">{pose}</button>')


def _choice(plan: PlanFile) -> str:
    search, other = plan.search, plan.comparison
    rows = [(search.name, search.spread)] + ([(other.name, other.spread)] if other else [])
    return table(
        "How the poses lie in the pool",
        ("Technique", "Covering radius", "To the edge, mean", "To the next pose, mean", "O1"),
        [
            (
                f"{name}{'' if name == search.name else ' (not used)'}",
                mm(spread.covering_radius, 1),
                "no edge" if spread.boundary_distance is None else mm(spread.boundary_distance, 1),
                "one pose" if spread.nearest_neighbour is None else mm(spread.nearest_neighbour, 1),
                f"{spread.o1:.4f}",
            )
            for name, spread in rows
        ],
    )


def _alt(plan: PlanFile) -> str:
    names = [plan.search.name] + ([plan.comparison.name] if plan.comparison else [])
    return (
        f"Flat map of the surface with {len(plan.poses)} poses chosen by {' and by '.join(names)};"
        f" covering radius {mm(plan.search.covering_radius, 1)}"
    )


def _notes(plan: PlanFile) -> str:
    if not plan.findings:
        return ""
    folder = plan.cell.file.rpartition("/")[0]
    told = [text.replace(f"{folder}/", "") if folder else text for text in plan.findings]
    items = "".join(f"<li>{escape(text)}</li>" for text in told)
    return folded("Notes of the planner", f"<ul>{items}</ul>")


def _filled(text: str, values: dict[str, str]) -> str:
    for name, value in values.items():
        text = text.replace(f"${name}", value)
    return text


SECTION = Section("poses", "Surface, pool and poses", body)
