"""One HTML page that shows a plan: a view to turn, its key figures and a table of its poses."""

from collections.abc import Callable
from dataclasses import dataclass
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
from elastocal.report.language import ENGLISH, Language
from elastocal.report.pages.templating import render
from elastocal.report.plots import PlanView, plan_view, weakest_margins
from elastocal.results import brief_repr
from elastocal.units import in_unit
from elastocal.viewer import packed, scene_data
from elastocal.wording import (
    counted,
    duration,
    millimetres,
    mm,
    phrase,
    phrases,
    readable,
)


def write_plan_page(
    path: Path,
    cell: Cell,
    surface: Surface,
    plan: PlanResult,
    pool: PoolData,
    language: Language = ENGLISH,
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
    language : Language
        Of the page's words.

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
        language,
        title=phrase("Calibration plan: {name}", name=plan.cell.name),
        styles=("page.css", "viewer.css"),
        scripts=("viewer.js", "postures.js", "plan.js"),
        data=view_data(view, plan, pool, language.say),
        plan=plan,
        figures=key_figures(plan),
        rows=[(pose.id, _cells(plan, pose, worst[pose.candidate])) for pose in plan.poses],
        heads=phrases(
            "Pose",
            "x in mm",
            "y in mm",
            "z in mm",
            "Smallest margin",
            "Seen by",
            "Way to it",
            "In contact",
        ),
        expected=None if plan.production is None else expected_table(plan, plan.production),
        subtitle=phrase(
            "{poses} chosen by {technique} for {robot}. Lengths in the base frame of the robot.",
            poses=counted(len(plan.poses), "pose"),
            technique=plan.search.name,
            robot=plan.robot.name,
        ),
        made=phrase(
            "Made by elastocal {version} from {file} (fingerprint {fingerprint}).",
            version=plan.elastocal,
            file=plan.cell.file,
            fingerprint=plan.cell.fingerprint[:12],
        ),
        notes=[layer.note for layer in view.scene.layers if layer.note],
    )
    write_text(path, page)
    return Path(path)


@brief_repr
@dataclass(frozen=True)
class ExpectedTable:
    """The error to expect on production from some numbers of poses, and what they take."""

    caption: str
    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def expected_table(plan: PlanResult, production: ProductionRecord) -> ExpectedTable:
    """Return the error to expect from some numbers of poses, as texts of a table."""
    sigma, is_known = mm(production.sigma), production.floor is not None
    return ExpectedTable(
        phrase(
            "Error to expect on production, root mean square of the deviation, from readings that"
            " scatter by {sigma}",
            sigma=sigma,
        )
        if is_known
        else phrase(
            "Error to expect on production, root mean square of the deviation, from readings that"
            " scatter by {sigma}; the model's own error comes on top and is not known before a"
            " calibration",
            sigma=sigma,
        ),
        (
            *phrases("Poses", "Error from noise"),
            *(phrases("With the model's own error") if is_known else ()),
            phrase("In the cell"),
        ),
        tuple(
            (
                str(each.poses),
                mm(each.noise),
                *((mm(each.error),) if is_known else ()),
                f"{plan.time_of(each.poses) / 60.0:.0f} min",
            )
            for each in production.some_expected()
        ),
    )


def key_figures(plan: PlanResult) -> tuple[tuple[str, str], ...]:
    """Return the figures at the head of the page, as name and value with its unit."""
    search, pool = plan.search, plan.pool
    radius: str = readable(search.covering_radius, "m")
    if search.d_max is not None:
        asked = readable(search.d_max, "m")
        radius = phrase("{radius} (asked: {asked})", radius=radius, asked=asked)
    return (
        (phrase("Poses"), str(len(plan.poses))),
        (phrase("Covering radius"), radius),
        (phrase("Total time"), duration(plan.total_time)),
        (phrase("of it on the way"), duration(plan.travel_time)),
        (
            phrase("Points with a posture"),
            phrase("{rank} of {all}", rank=pool.valid, all=pool.sampled),
        ),
        (phrase("Most frequent reason to refuse a point"), phrase(pool.bottleneck or "none")),
        *(_covered(plan.production) if plan.production is not None else ()),
    )


def _covered(production: ProductionRecord) -> tuple[tuple[str, str], ...]:
    found = production.expected_of(production.poses)
    label = (
        phrase("Error on production from noise alone")
        if production.floor is None
        else phrase("Expected error on production")
    )
    error = ((label, mm(found.error)),) if found is not None else ()
    return ((phrase("Production covered"), f"{production.coverage.covered:.0%}"), *error)


def _cells(plan: PlanResult, pose: PoseRecord, worst: str) -> list[str]:
    way = sum(move.duration for move in plan.moves if move.end == pose.id)
    return [
        *(f"{in_unit(value, 'mm') + 0.0:.1f}" for value in pose.tcp_position),
        worst,
        pose.seen_by or phrase("no station"),
        duration(way),
        duration(pose.contact_time),
    ]


def view_data(
    view: PlanView, plan: PlanResult, pool: PoolData, say: Callable[[object], str] = str
) -> dict[str, object]:
    """Return the data from which the script of a page shows a view.

    Parameters
    ----------
    view : PlanView
        From `plan_view`.
    plan, pool : PlanResult, PoolData
        That it shows.
    say : callable
        Returns a text in the language of the page.
    """
    worst = weakest_margins(pool).label
    poses = [
        phrase(
            "Pose {pose}: {place} mm · {sight} · smallest margin: {margin}",
            pose=pose.id,
            place=millimetres(pose.tcp_position),
            sight=phrase("seen by {station}", station=pose.seen_by)
            if pose.seen_by
            else phrase("no line of sight"),
            margin=worst[pose.candidate],
        )
        for pose in plan.poses
    ]
    return scene_data(view.scene, say) | {
        "sight": packed(view.sight),
        "postures": ["HOME", *map(say, poses)],
    }
