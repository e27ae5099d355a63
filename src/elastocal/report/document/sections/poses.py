"""Surface, pool and chosen poses (paper Fig. 2 and 3)."""

from functools import partial

from elastocal.planning import PlanResult
from elastocal.report.document.blocks import (
    Block,
    Bullets,
    Content,
    Details,
    Facts,
    Paragraph,
    PlanScene,
    PoseButton,
    Section,
    Table,
    picture,
)
from elastocal.report.pages import key_figures, view_data
from elastocal.report.plots import plan_figure, plan_view
from elastocal.verdict import Evidence
from elastocal.wording import counted, mm


def _body(evidence: Evidence) -> Content:
    """Return the section."""
    plan, pool = evidence.plan, evidence.pool
    if plan is None:
        text = "The plan is not known, so nothing is said of how the poses were chosen."
        return Content((Paragraph(text),))
    head = (Facts(key_figures(plan)), _spreads(plan))
    if pool is None or evidence.surface is None or evidence.cell is None:
        text = "Without cell, mesh and pool there is no picture."
        return Content((*head, Paragraph(text), *_notes(plan), _poses(plan, buttons=False)))
    view = plan_view(evidence.cell, evidence.surface, plan, pool)
    flat_map = picture(
        partial(plan_figure, evidence.surface, plan, pool),
        _alt(plan),
        "After the paper's Fig. 3: the surface unrolled; colour is the distance of each candidate"
        " from its nearest chosen pose.",
        ".png",
    )
    scene = PlanScene(len(plan.poses))
    blocks = (*head, scene, flat_map, *_notes(plan), _poses(plan, buttons=True))
    return Content(blocks, view_data(view, plan, pool))


def _poses(plan: PlanResult, buttons: bool) -> Block:
    """Return the table of the poses, with buttons where there is a scene that shows them."""
    rows = tuple(
        (
            PoseButton(pose.id) if buttons else str(pose.id),
            str(plan.search.order.index(pose.id) + 1),
            *(f"{1e3 * value + 0.0:.1f}" for value in pose.tcp_position),
            pose.seen_by or "no station",
        )
        for pose in plan.poses
    )
    heads = ("Pose", "Chosen as no.", "x in mm", "y in mm", "z in mm", "Seen by")
    caption = "Poses in visiting order, contact point in base"
    table = Table(caption, heads, rows, name="pose-table")
    return Details(f"The {counted(len(plan.poses), 'pose')} in visiting order", (table,))


def _spreads(plan: PlanResult) -> Block:
    search, other = plan.search, plan.comparison
    rows = [(search.name, search.spread)] + ([(other.name, other.spread)] if other else [])
    return Table(
        "How the poses lie in the pool",
        ("Technique", "Covering radius", "To the edge, mean", "To the next pose, mean", "O1"),
        tuple(
            (
                f"{name}{'' if name == search.name else ' (not used)'}",
                mm(spread.covering_radius, 1),
                "no edge" if spread.boundary_distance is None else mm(spread.boundary_distance, 1),
                "one pose" if spread.nearest_neighbour is None else mm(spread.nearest_neighbour, 1),
                f"{spread.o1:.4f}",
            )
            for name, spread in rows
        ),
    )


def _alt(plan: PlanResult) -> str:
    names = [plan.search.name] + ([plan.comparison.name] if plan.comparison else [])
    return (
        f"Flat map of the surface with {len(plan.poses)} poses chosen by {' and by '.join(names)};"
        f" covering radius {mm(plan.search.covering_radius, 1)}"
    )


def _notes(plan: PlanResult) -> tuple[Block, ...]:
    if not plan.findings:
        return ()
    # Where the folder lies is no part of a report.
    folder = plan.cell.file.rpartition("/")[0]
    notes = tuple(text.replace(f"{folder}/", "") if folder else text for text in plan.findings)
    return (Details("Notes of the planner", (Bullets(notes),)),)


POSES = Section("poses", "Surface, pool and poses", 20, _body)
