"""``plan``: from a cell to an ordered, checked, executable set of poses, with its files."""

from collections import Counter
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Annotated

import numpy as np

from elastocal import planning
from elastocal.cell import TRACKER, Cell, fingerprint, load_cell, without_tracker
from elastocal.compensation.programs import (
    PTP_PERCENT,
    AxisMove,
    Block,
    ProgramWriter,
    RobotProgram,
    Stop,
    choose_writer,
    write_plan_program,
)
from elastocal.errors import PlanningError
from elastocal.files import filling
from elastocal.geometry import PositionPlan, plan_positions as choose_positions
from elastocal.options import Option
from elastocal.planning import PLAN, PlanResult, ProductionRecord, SpreadRecord
from elastocal.planning.export import PLAN_TABLE, write_table as write_plan_table
from elastocal.progress import Progress
from elastocal.records import record, write_json
from elastocal.report import Language, language_of, write_plan_figure, write_plan_page
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.tables import write_table
from elastocal.workflows._workflow import workflow
from elastocal.workflows.more import MeasuredRun, measured_run

__all__ = [
    "POSITION_PLAN",
    "POSITION_TABLE",
    "PlanFigures",
    "PlanPositionsSettings",
    "PlanResult",
    "PlanSettings",
    "plan",
    "plan_figures",
    "plan_positions",
]

POSITION_PLAN, POSITION_TABLE = "positions.json", "positions.csv"
"""Files of a plan of positions: the plan, and the table that the tracker's values go into."""
_PAGE, _FIGURE = "plan.html", "plan.svg"
_FREE_SEARCH = "i_optimal"
"""Search technique of the poses in free space."""


@dataclass(frozen=True)
class PlanSettings:
    """Settings of a plan: the cell and the folder."""

    cell: Annotated[str | PathLike[str], Option(argument=True)]
    """Cell file, ``.yaml``."""
    out: Annotated[str | PathLike[str], Option(metavar="DIR")]
    """Folder to write the plan into."""
    compare: Annotated[str | None, Option(choices="technique or none")] = None
    """Search technique to lay beside the cell's, or ``none``; by default ``ioops`` beside
    ``cover``, else ``cover``."""
    program: str = "calib"
    """Name of the robot program."""
    jobs: Annotated[int | None, Option(least=1, most=1024)] = None
    """Processes for large pools; by default all cores."""
    force: bool = False
    """Replace the files of a plan that is there."""
    dry_run: bool = False
    """Make the plan, and write nothing."""
    poses: Annotated[int | None, Option(least=1, most=100_000)] = None
    """Number of poses in place of the cell's ``search.poses``."""
    language: Annotated[str | None, Option(choices="language")] = None
    """Language of the robot program, or ``none``; by default that of the robot's maker."""
    free_poses: Annotated[int | None, Option("--positions", least=1, most=100_000)] = None
    """Number of poses in free space for `geometry`, after the presses and in the same program;
    none: presses alone."""
    more: Annotated[Path | None, Option(metavar="RUN")] = None
    """Folder of a run: the poses that, with its own, bring the light of its report to green, each
    the best next one, or why no number of poses does. `calibrate` takes both datasets."""
    page_language: Annotated[str, Option(choices="page language")] = "en"
    """Language of ``plan.html``."""
    without: Annotated[str | None, Option(choices="instrument")] = None
    """Instrument that the run does without: ``tracker``. No line of sight is needed, tools are
    turned about the normal, and some places are pressed on two stacked disks as well."""
    doubled: Annotated[int | None, Option(least=0, most=1000)] = None
    """Places that are pressed on two stacked disks as well, without a tracker; by default 8 where
    the cell file gives ``engagement.disk_thickness``."""


@record()
class ComparedSpread:
    """Another technique, and how its choice lies in the pool."""

    technique: str
    spread: SpreadRecord


@record()
class PlanTimes:
    """Estimated times in s."""

    travel: float
    total: float
    """Time of the presses, including the motions."""
    positions: float | None = None
    """Positions on the paths through the poses in free space; None if there are none."""


@brief_repr
@record()
class PlanFigures:
    """The key figures of ``plan --json``."""

    folder: str
    files: tuple[str, ...]
    cell: str
    poses: int
    technique: str
    spread: SpreadRecord
    d_max: float | None
    covered: bool | None
    comparison: ComparedSpread | None
    pool: int
    """Valid candidates."""
    sampled: int
    refused: dict[str, int]
    """Number of points that each check refused."""
    bottleneck: str | None
    stations: dict[str, int]
    """Number of poses that each tracker station sees."""
    time: PlanTimes
    findings: tuple[str, ...]
    production: ProductionRecord | None = None
    """Coverage of production and the error to expect there; none where the cell names none."""
    program: str = ""
    """Language of the robot program, and why it is that one or none."""
    positions: int | None = None
    """Poses in free space for `geometry`; none: presses alone."""


@workflow(PlanSettings)
def plan(settings: PlanSettings, progress: Progress) -> PlanResult:
    """Choose calibration poses on the tooling, check them, and put them in order.

    Raises
    ------
    PlanningError
        If no plan can be made of this cell, or a controller does not accept the program's name.
    FileAccessError
        If a file cannot be read or written, or the folder holds files.

    Examples
    --------
    >>> import elastocal as ec
    >>> _ = ec.init("cell")
    >>> found = ec.plan("cell/cell.yaml", out="plan", poses=4)
    >>> dict(found.facts())["poses"]
    '4 by i_optimal from 3000 candidates'
    """
    _require_instrument(settings)
    cell = _wanted_cell(settings)
    added = None
    if settings.more is not None:
        added = measured_run(settings.more, cell, settings.poses)
        cell = _with_search(cell, poses=added.poses, accuracy=None, d_max=None)
    writer, _ = choose_writer(cell.robot, settings.language)
    if writer is not None:
        writer.check_name(settings.program)
    compare = settings.compare
    if added is not None:
        # Another technique would choose poses of their own, not ones to add.
        compare = "none"
    if compare is None:
        compare = "cover" if cell.technique != "cover" else "ioops"
    other = None if compare == "none" else compare
    _require_free_poses(settings)
    language = language_of(settings.page_language, "--page-language")
    if settings.dry_run:
        return _planned(cell, other, settings, progress, added).plan
    with filling(Path(settings.out), PLAN, settings.force) as folder:
        planned = _planned(cell, other, settings, progress, added)
        if settings.poses is not None or added is not None or settings.without is not None:
            # A plan belongs to the cell file, whatever number of poses an option requests.
            own = fingerprint(load_cell(Path(settings.cell)))
            record = replace(planned.plan.cell, fingerprint=own)
            planned = replace(planned, plan=replace(planned.plan, cell=record))
        free = None
        if settings.free_poses is not None:
            as_written = load_cell(Path(settings.cell))
            seed = cell.file.search.seed
            free = choose_positions(as_written, settings.free_poses, _FREE_SEARCH, seed, progress)
        _write_folder(folder, cell, planned, free, writer, settings.program, language)
    return planned.plan


def _planned(
    cell: Cell,
    other: str | None,
    settings: PlanSettings,
    progress: Progress,
    added: MeasuredRun | None,
) -> planning.PlanAndPool:
    """Return a plan of its own, or one of poses that add to a run, with what they bring."""
    if settings.without is not None:
        cell, variant = without_tracker(cell), planning.Untracked(settings.doubled)
        return planning.make_plan(cell, other, settings.jobs, progress, variant)
    if added is None:
        return planning.make_plan(cell, other, settings.jobs, progress)
    to = planning.AddedTo(added.joint_position, added.beside)
    made = planning.make_plan(cell, other, settings.jobs, progress, to)
    findings = (*added.findings, *added.gain(made.share), *made.plan.findings)
    return replace(made, plan=replace(made.plan, findings=findings))


def _require_instrument(settings: PlanSettings) -> None:
    """Refuse an instrument that no plan does without, and options that need it."""
    if settings.without is None:
        if settings.doubled is not None:
            raise PlanningError("--doubled goes with --without tracker")
        return
    if settings.without != TRACKER:
        raise PlanningError(
            f"--without {settings.without!r} is no instrument that a run can do without"
            f" (allowed: {TRACKER})"
        )
    for value, option in ((settings.free_poses, "--positions"), (settings.more, "--more")):
        if value is not None:
            raise PlanningError(f"{option} is for a tracker: leave --without tracker out")


def _require_free_poses(settings: PlanSettings) -> None:
    """Refuse a number of poses in free space that is not positive, or without a station."""
    if settings.free_poses is None:
        return
    if not settings.free_poses >= 1:
        raise PlanningError(f"--positions {settings.free_poses}: must be at least 1")
    if settings.dry_run:
        raise PlanningError("--dry-run shows presses alone: leave the positions out")


def _wanted_cell(settings: PlanSettings) -> Cell:
    """Return the cell with the number of poses that is asked for."""
    cell = load_cell(Path(settings.cell))
    if settings.poses is None:
        return cell
    if not settings.poses >= 1:
        raise PlanningError(f"--poses {settings.poses}: must be at least 1")
    return _with_search(cell, poses=settings.poses, accuracy=None)


def _with_search(cell: Cell, **changes: object) -> Cell:
    """Return a cell that searches otherwise."""
    search = cell.file.search.model_copy(update=changes)
    return replace(cell, file=cell.file.model_copy(update={"search": search}))


def plan_figures(
    found: PlanResult,
    folder: Path,
    program: str,
    language: str | None = None,
    free: PositionPlan | None = None,
) -> PlanFigures:
    """Return the key figures of a plan that was written into a folder.

    Parameters
    ----------
    found : PlanResult
        The plan.
    folder : Path
        Where it is.
    program : str
        Name of the robot program.
    language : str, optional
        Its language; by default that of the robot's controller.
    free : PositionPlan, optional
        Poses in free space, where the plan has them.
    """
    robot = Robot.from_urdf(found.robot.urdf, found.robot.tcp, found.robot.base)
    writer, reason = choose_writer(robot, language)
    programs = () if writer is None else writer.paths(folder, program)
    search, other = found.search, found.comparison
    seeing = Counter(pose.seen_by for pose in found.poses if pose.seen_by is not None)
    names = (PLAN, planning.POOL, PLAN_TABLE, *(each.name for each in programs), _PAGE, _FIGURE)
    if free is not None:
        names = (*names, POSITION_PLAN, POSITION_TABLE)
    return PlanFigures(
        folder=str(folder),
        files=tuple(name for name in names if (folder / name).is_file()),
        cell=found.cell.name,
        poses=len(found.poses),
        technique=search.name,
        spread=search.spread,
        d_max=search.d_max,
        covered=search.covered,
        comparison=None if other is None else ComparedSpread(other.name, other.spread),
        pool=found.pool.valid,
        sampled=found.pool.sampled,
        refused={check.name: check.refused for check in found.pool.checks},
        bottleneck=found.pool.bottleneck,
        stations=dict(sorted(seeing.items())),
        time=PlanTimes(
            found.travel_time, found.total_time, None if free is None else free.travel_time
        ),
        findings=found.findings,
        production=found.production,
        program=reason,
        positions=None if free is None else len(free.poses),
    )


def _write_folder(
    folder: Path,
    cell: Cell,
    planned: planning.PlanAndPool,
    free: PositionPlan | None,
    writer: ProgramWriter | None,
    program: str,
    language: Language,
) -> None:
    """Write every file of a plan; no robot program where the robot has no language of ours."""
    found, pool, surface = planned.plan, planned.pool, planned.surface
    planning.write_plan(folder, found)
    planning.write_pool(folder, pool)
    write_plan_table(folder, found)
    if free is not None:
        _write_positions(folder, cell.robot, free)
    if writer is not None:
        override = cell.file.motion.override
        after = None if free is None else _positions_program(free, cell.robot, program, override)
        write_plan_program(folder, found, writer, program, after)
    write_plan_page(folder / _PAGE, cell, surface, found, pool, language)
    write_plan_figure(folder / _FIGURE, surface, found, pool)


@dataclass(frozen=True)
class PlanPositionsSettings:
    """Settings of a plan of positions in free space for ``geometry``."""

    cell: str | PathLike[str]
    """Cell file, ``.yaml``, with marker and trackers."""
    out: str | PathLike[str]
    """Folder to write the plan into."""
    poses: int = 60
    """Number of poses."""
    search: str = _FREE_SEARCH
    """Search technique."""
    program: str = "positions"
    """Name of the robot program."""
    language: str | None = None
    """Language of the robot program, or ``none``; by default that of the robot's maker."""
    force: bool = False
    """Replace the files of a plan that is there."""


@workflow(PlanPositionsSettings)
def plan_positions(settings: PlanPositionsSettings, progress: Progress) -> PositionPlan:
    """Choose poses in free space that determine the geometry of the arm best; write plan and table.

    Raises
    ------
    PlanningError
        If no plan can be made of this cell, or a controller does not accept the program's name.
    FileAccessError
        If a file cannot be read or written, or the folder holds files.
    """
    cell = load_cell(Path(settings.cell))
    writer, _ = choose_writer(cell.robot, settings.language)
    if writer is not None:
        writer.check_name(settings.program)
    if not settings.poses >= 1:
        raise PlanningError(f"--poses {settings.poses}: must be at least 1")
    with filling(Path(settings.out), POSITION_PLAN, settings.force) as folder:
        found = choose_positions(
            cell, settings.poses, settings.search, cell.file.search.seed, progress
        )
        _write_positions(folder, cell.robot, found)
        if writer is not None:
            override = cell.file.motion.override
            writer.write(folder, _positions_program(found, cell.robot, settings.program, override))
    return found


def _write_positions(folder: Path, robot: Robot, found: PositionPlan) -> None:
    """Write the poses, and the table that ``geometry`` reads, its markers left to be filled in."""
    write_json(folder / POSITION_PLAN, found)
    joints = [
        f"{name}[{'deg' if turns else 'mm'}]"
        for name, turns in zip(robot.joint_names, robot.revolute, strict=True)
    ]
    scale = np.where(robot.revolute, 180.0 / np.pi, 1e3)
    header = ["pose", "station", *joints, *(f"marker_{axis}[mm]" for axis in "xyz")]
    rows = (
        [each.id, each.station, *(scale * np.array(each.joints)).tolist(), "", "", ""]
        for each in found.poses
    )
    write_table(folder / POSITION_TABLE, header, rows)


def _positions_program(
    found: PositionPlan, robot: Robot, name: str, override: float
) -> RobotProgram:
    """Return the program that stops at every pose until its marker has been measured."""
    home = AxisMove("XHOME", np.array(found.robot.home))
    blocks = [Block("", (home,))]
    ways = [
        tuple(AxisMove(f"XWAY{index}_{n}", np.array(q)) for n, q in enumerate(move.via, start=1))
        for index, move in enumerate(found.moves)
    ]
    for pose, way in zip(found.poses, ways[:-1], strict=True):
        there = AxisMove(f"XPOS{pose.id}", np.array(pose.joints))
        measure = Stop(f"Measure the marker by {pose.station}, then go on.")
        title = f"POSITION {pose.id} of 0 to {len(found.poses) - 1}"
        blocks.append(Block(title, (*way, there, measure)))
    blocks.append(Block("", (*ways[-1], home)))
    percent = max(1, min(PTP_PERCENT, int(100.0 * override + 1e-9)))
    return RobotProgram(
        name=name,
        robot=robot,
        axis_percent=percent,
        blocks=tuple(blocks),
        facts=(f"Poses in free space for elastocal geometry, of cell {found.cell.name}.",),
        motions=("Moves of the axes from pose to pose; the robot stops at each.",),
    )
