"""One HTML page that shows a plan: a view to turn, its key figures and a table of its poses."""

from collections.abc import Callable
from pathlib import Path

from elastocal.cell import Cell
from elastocal.files import write_text
from elastocal.planning import (
    PlanResult,
    PoolData,
    PoseRecord,
    check_plan_robot,
    check_pool_of,
    expected,
    key_figures,
)
from elastocal.planning.surface import Surface
from elastocal.report.language import ENGLISH, Language
from elastocal.report.pages.templating import render
from elastocal.report.plots import PlanView, plan_view, weakest_margins
from elastocal.units import in_unit
from elastocal.viewer import packed, scene_data
from elastocal.wording import (
    counted,
    duration,
    millimetres,
    phrase,
    phrases,
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
        Plan and pool of one run.
    language : Language
        Language of the page's words.

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
            "Time to get there",
            "Time in contact",
        ),
        expected=None if plan.production is None else expected(plan, plan.production),
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
