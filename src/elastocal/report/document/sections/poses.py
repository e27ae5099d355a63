"""Surface, pool and chosen poses (paper Fig. 2 and 3)."""

from collections.abc import Iterator
from functools import partial

from elastocal import blocks
from elastocal.planning import PlanResult, expected, key_figures, spreads
from elastocal.report.document.section import PlanScene, Section
from elastocal.report.plots import plan_figure, plan_view
from elastocal.units import in_unit
from elastocal.verdict import Evidence
from elastocal.wording import Phrase, counted, mm, phrase, phrases, sentences


def _body(evidence: Evidence) -> Iterator[blocks.Block]:
    plan = evidence.plan
    if plan is None:
        text = phrase("The plan is not known, so nothing is said of how the poses were chosen.")
        yield blocks.Paragraph(text)
        return
    yield blocks.Facts(key_figures(plan))
    yield spreads(plan)
    if plan.production is not None:
        yield expected(plan, plan.production)
    pictures = tuple(_pictures(evidence, plan))
    yield from pictures or (
        blocks.Paragraph(phrase("Without cell, mesh and pool there is no picture.")),
    )
    yield from _notes(plan)
    if plan.search.name == _BY_PRODUCTION and plan.comparison is not None:
        yield blocks.Paragraph(
            phrase(
                "{search} seeks the least error on the production path; a small covering radius"
                " is not its aim. {other} stands beside it to compare.",
                search=plan.search.name,
                other=plan.comparison.name,
            ),
            "sub",
        )
    yield _poses(plan, buttons=bool(pictures))


def _pictures(evidence: Evidence, plan: PlanResult) -> Iterator[blocks.Block]:
    cell, surface, pool = evidence.cell, evidence.surface, evidence.pool
    if pool is None or surface is None or cell is None:
        return
    yield blocks.Picture(
        partial(plan_figure, surface, plan, pool),
        _alt(plan),
        phrase(
            "The surface and its candidates as the note in the picture says; colour is the distance"
            " of each candidate from its nearest chosen pose."
        ),
    )
    yield PlanScene(plan_view(cell, surface, plan, pool), plan, pool)


def _poses(plan: PlanResult, buttons: bool) -> blocks.Block:
    """Return the table of the poses, with buttons where there is a scene that shows them."""
    rows = tuple(
        (
            blocks.PoseButton(pose.id) if buttons else str(pose.id),
            *(f"{in_unit(value, 'mm') + 0.0:.1f}" for value in pose.tcp_position),
            pose.seen_by or phrase("no station"),
        )
        for pose in plan.poses
    )
    heads = phrases("Pose", "x in mm", "y in mm", "z in mm", "Seen by")
    caption = phrase("Poses in visiting order, contact point in base")
    table = blocks.Table(caption, heads, rows, name="pose-table")
    return blocks.Details(
        phrase("The {poses} in visiting order", poses=counted(len(plan.poses), "pose")), (table,)
    )


def _alt(plan: PlanResult) -> Phrase:
    names = [plan.search.name] + ([plan.comparison.name] if plan.comparison else [])
    return phrase(
        "Flat map of the surface with {poses} chosen by {technique}; covering radius {radius}",
        poses=counted(len(plan.poses), "pose"),
        technique=sentences(names, ", "),
        radius=mm(plan.search.covering_radius, 1),
    )


def _notes(plan: PlanResult) -> Iterator[blocks.Block]:
    if not plan.findings:
        return
    # Where the folder lies is no part of a report.
    folder = plan.cell.file.rpartition("/")[0]
    notes = tuple(each.without(f"{folder}/") if folder else each for each in plan.findings)
    yield blocks.Details(phrase("Notes of the planner"), (blocks.Bullets(notes),))


_BY_PRODUCTION = "i_optimal"

POSES = Section("poses", phrase("Surface and poses"), phrase("Where was measured?"), 20, _body)
