"""Plan file ``plan.json``: poses in visiting order, the path between them, and their choice.

A plan belongs to one cell: it carries the cell's fingerprint and its robot whole. All numbers are
SI; joint positions are in rad (m for prismatic joints) in the order of ``robot.joints``.
"""

import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import field, fields
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.blocks import Block, Facts
from elastocal.cell import TRACKER, Cell
from elastocal.errors import PlanningError, SchemaError
from elastocal.files import as_path, sha256, write_json
from elastocal.findings import Finding, group_alike
from elastocal.planning.production import ProductionRecord
from elastocal.records import read_json, record, to_data
from elastocal.results import Result, brief_repr

_SCHEMA = "elastocal.plan/2"
_OLDER = ("elastocal.plan/1",)
PLAN = "plan.json"
"""Name of the plan in its folder."""
POOL = "pool.nc"
"""Name of the pool beside it."""

Vector = tuple[float, float, float]
Joints = tuple[float, ...]


@record()
class CellRecord:
    """The cell that a plan was made for."""

    name: str
    file: str
    """Path of the cell file as it was given."""
    fingerprint: str
    """See `elastocal.cell.fingerprint`: changes with every number of the cell and every file it
    names, not with comments."""


@brief_repr
@record()
class RobotRecord:
    """The robot with rail and tool."""

    name: str
    urdf: str
    base: str
    tcp: str
    joints: tuple[str, ...]
    home: Joints


@brief_repr
@record()
class ContactRecord:
    """Approach of the tool to the surface and its contact forces."""

    approach_distance: float
    near_contact: float
    axis_override: float
    """Part of the axes' largest speeds that the times of moves are estimated for."""
    contact_speed: float
    """Fastest straight motion of the robot program between approach pose and contact, in m/s."""
    load_cases: dict[str, Vector]
    """Force on the robot in the tcp frame, in N, in the order in which they are applied; what
    belongs to the reference (`CellFile.presses`) among them."""
    straight_time: float | None = None
    """Part of each ``contact_time`` spent on straight motions, in s; None in plans of earlier
    versions, whose times are for ``contact_speed`` there and back."""


@brief_repr
@record()
class PoseRecord:
    """One calibration pose."""

    id: int
    """Number in visiting order, from 0: the ``pose`` of the dataset."""
    candidate: int
    """Number in the pool."""
    joints: Joints
    """Joint positions in contact."""
    approach_joints: Joints
    """Off the surface by the approach distance, along the normal."""
    tcp_position: Vector
    """Contact point in base, in m."""
    tcp_quaternion: tuple[float, float, float, float]
    """Orientation of the tcp frame in base, x, y, z, w; its z axis points into the surface."""
    normal: Vector
    """Outward unit normal of the surface in base."""
    seen_by: str | None
    """Tracker station that sees the marker best; None in a cell without trackers."""
    contact_time: float
    """Estimated seconds from the approach pose through all load cases and back to it."""
    margins: dict[str, float]
    """Margin of each check, in its unit; positive is allowed. A check that cannot refuse (the edge
    of a surface that has none) is left out."""
    doubles: int | None = None
    """Pose that is pressed once more here, on two stacked disks; None: it is one by itself."""

    @property
    def disks(self) -> int:
        """Number of disks that are stacked at the press."""
        return 1 if self.doubles is None else 2

    @property
    def T_base_tcp(self) -> FloatArray:
        """Contact frame in base, shape (4, 4), in m."""
        T = np.eye(4)
        T[:3, :3] = Rotation.from_quat(self.tcp_quaternion).as_matrix()
        T[:3, 3] = self.tcp_position
        return T


@brief_repr
@record()
class MoveRecord:
    """One joint-space move between HOME and approach poses."""

    start: int | None
    """Pose it leaves; None: HOME."""
    end: int | None
    """Pose it leads to; None: HOME."""
    via: tuple[Joints, ...]
    """Joint positions in between; each leg is straight in joint space."""
    duration: float
    """Estimated, in s."""


@record()
class SpreadRecord:
    """Distribution of the chosen poses in their pool: the numbers behind the paper's Fig. 3."""

    covering_radius: float
    """Distance of the worst-covered candidate from its nearest chosen pose, in m."""
    boundary_distance: float | None
    """Mean distance of the chosen points from the edge of the surface, in m; None without edge."""
    nearest_neighbour: float | None
    """Mean distance of a chosen point from the nearest other one, in m; None for one pose."""
    o1: float
    """Observability index O1 over the springs' observable directions (paper Eq. 20)."""


@brief_repr
@record()
class SearchRecord:
    """Search by which the poses were chosen."""

    name: str
    metric: str
    seed: int
    wanted: int | None
    """Largest number of poses asked for; None: as many as d_max needs."""
    d_max: float | None
    """Cover distance asked for, in m."""
    covering_radius: float
    """Reached, in m."""
    lower_bound: float | None
    """No choice of as many candidates has a smaller covering radius, in m (COVER only)."""
    covered: bool | None
    """Whether d_max was reached; None when none was asked for."""
    order: tuple[int, ...]
    """Ids of the poses in the order in which they were chosen: any beginning of it is a sensible
    smaller plan."""
    spread: SpreadRecord
    process_unseen: float | None = None
    """Part of the process rows (by norm, scaled) that no candidate can show, whatever is chosen;
    None in a cell without process."""


@brief_repr
@record()
class ComparisonRecord:
    """The choice of another technique from the same pool, as many poses."""

    name: str
    candidates: tuple[int, ...]
    """Numbers in the pool, in search order."""
    spread: SpreadRecord


@record()
class CheckRecord:
    """One check, and how many of the sampled points it left without a posture."""

    name: str
    unit: str | None
    """Unit of its margin; None for the reach of the robot, which has none."""
    refused: int
    advice: str


@brief_repr
@record()
class PoolRecord:
    """The candidates that the search chose from."""

    file: str
    sampled: int
    valid: int
    checks: tuple[CheckRecord, ...]
    bottleneck: str | None
    """The check that refused most points."""


@record(_SCHEMA, reads=_OLDER)
class PlanResult(Result):
    """The calibration poses of a cell: what ``plan.json`` holds, but for its hash."""

    elastocal: str
    """Version that made it."""
    cell: CellRecord
    robot: RobotRecord
    contact: ContactRecord
    poses: tuple[PoseRecord, ...]
    """Poses in visiting order."""
    moves: tuple[MoveRecord, ...]
    """Moves from HOME through all poses and back, one more than there are poses."""
    search: SearchRecord
    comparison: ComparisonRecord | None
    pool: PoolRecord
    findings: tuple[Finding, ...]
    """Notes and warnings for the user; sentences alone in files of version 1."""
    production: ProductionRecord | None = None
    """None in a cell that names no process."""
    without: tuple[str, ...] = ()
    """Instruments that a run does without: ``tracker``; see `elastocal.cell.without_tracker`."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the plan in a few words, for a console or a notebook."""
        search = self.search
        return (
            ("cell", self.cell.name),
            ("robot", self.robot.name),
            ("poses", f"{len(self.poses)} by {search.name} from {self.pool.valid} candidates"),
            ("covering radius", f"{1e3 * search.covering_radius:.4g} mm"),
            *(() if self.production is None else self.production.facts()),
            ("estimated time", f"{self.total_time / 60.0:.0f} min"),
        )

    def show(self) -> Iterator[Block]:
        """Yield its key figures, how its poses lie, what they promise, the checks, the notes."""
        from elastocal.planning.show import show_plan

        yield from show_plan(self)
        covered = () if self.production is None else self.production.facts()
        seen = Counter(sorted(pose.seen_by for pose in self.poses if pose.seen_by is not None))
        stations = ", ".join(f"{name} {count}" for name, count in seen.items())
        notes = (("note", text) for text in group_alike(self.findings))
        yield Facts((*covered, *((("marker seen by", stations),) if seen else ()), *notes))

    @property
    def tracked(self) -> bool:
        """Whether a tracker measures the presses."""
        return TRACKER not in self.without

    @property
    def doubled(self) -> tuple[int, ...]:
        """Ids of the poses that are pressed on two disks."""
        return tuple(pose.id for pose in self.poses if pose.disks > 1)

    @property
    def travel_time(self) -> float:
        """Estimated time of the moves between poses, in s."""
        return sum(move.duration for move in self.moves)

    @property
    def total_time(self) -> float:
        """Estimated seconds from HOME to HOME, all load cases included."""
        return self.travel_time + sum(pose.contact_time for pose in self.poses)

    def time_of(self, poses: int) -> float:
        """Return about how many seconds another number of poses takes, in proportion."""
        return self.total_time * poses / len(self.poses)


@record(_SCHEMA, reads=_OLDER)
class _WrittenPlan(PlanResult):
    """A plan in the form of its file."""

    sha256: str = field(kw_only=True)
    """See `_content_hash`."""


def _written(plan: PlanResult) -> dict[str, Any]:
    """Return the data of a plan's file: without what only plans without a tracker have."""
    data: dict[str, Any] = to_data(plan, stored=True)
    if not plan.without:
        del data["without"]
    for pose, kept in zip(plan.poses, data["poses"], strict=True):
        if pose.doubles is None:
            del kept["doubles"]
    return data


def _content_hash(plan: PlanResult, schema: str = _SCHEMA) -> str:
    """Return a SHA-256 over the contents of a plan, which reveals changes by hand.

    It is computed from the parsed numbers: line breaks and number formats do not count, the order
    of load cases does. A key that earlier versions did not write counts only where it has a value.
    """
    data = _written(plan) | {"schema": schema}
    if plan.contact.straight_time is None:
        del data["contact"]["straight_time"]
    if plan.production is None:
        del data["production"]
    elif not plan.production.coverage.first:
        del data["production"]["coverage"]["first"]
    return sha256(json.dumps(data, separators=(",", ":"), allow_nan=False))


def write_plan(folder: Path, plan: PlanResult) -> Path:
    """Write ``plan.json`` into a folder, atomically; return its path.

    Raises
    ------
    SchemaError
        If the plan contradicts itself; see `check_plan`.
    FileAccessError
        If it cannot be written.
    """
    path = Path(folder) / PLAN
    check_plan(plan, str(path))
    data = _written(plan)
    write_json(path, {"schema": data.pop("schema"), "sha256": _content_hash(plan), **data})
    return path


def read_plan(folder: Path) -> PlanResult:
    """Return the plan of a folder (or of the ``plan.json`` itself).

    Raises
    ------
    SchemaError
        If it has another schema, does not fit it, contradicts itself, or was changed since it was
        written: its parts were checked together.
    FileAccessError
        If it cannot be read.
    """
    path = as_path(folder, "folder")
    path = path / PLAN if path.is_dir() else path
    written = read_json(path, _WrittenPlan)
    plan = PlanResult(**{each.name: getattr(written, each.name) for each in fields(PlanResult)})
    check_plan(plan, str(path))
    if written.sha256 not in [_content_hash(plan, schema) for schema in (_SCHEMA, *_OLDER)]:
        raise SchemaError(f"{path} was changed by hand: make it anew with `elastocal plan`")
    return plan


def check_plan(plan: PlanResult, what: str = "plan") -> None:
    """Refuse a plan whose parts contradict each other.

    Parameters
    ----------
    what : str
        How the message names it.

    Raises
    ------
    SchemaError
        With the first contradiction, in one line.
    """
    for problem in (*_pose_problems(plan), *_move_problems(plan), *_number_problems(plan)):
        raise SchemaError(f"{what}: {problem}")


def check_plan_robot(plan: PlanResult, cell: Cell) -> None:
    """Refuse a cell whose robot has other joints than the plan's.

    Raises
    ------
    PlanningError
        By the names of the joints.
    """
    if plan.robot.joints != cell.robot.joint_names:
        raise PlanningError(
            f"the plan is for joints {', '.join(plan.robot.joints)}; the robot of cell"
            f" {cell.name!r} has {', '.join(cell.robot.joint_names)}"
        )


def _pose_problems(plan: PlanResult) -> Iterator[str]:
    if not plan.poses:
        yield "poses: there is none"
    names = {check.name for check in plan.pool.checks}
    for number, pose in enumerate(plan.poses):
        if pose.id != number:
            yield f"poses.{number}.id: must be {number}, its place in visiting order, got {pose.id}"
        if not 0 <= pose.candidate < plan.pool.valid:
            yield f"poses.{number}.candidate: {pose.candidate} is not one of {plan.pool.valid}"
        for key in pose.margins:
            if key not in names:
                yield f"poses.{number}.margins: {key!r} is no check (known: {', '.join(names)})"
    if len({(pose.candidate, pose.disks) for pose in plan.poses}) < len(plan.poses):
        yield "poses: a candidate stands twice"
    yield from _doubled_problems(plan)


def _doubled_problems(plan: PlanResult) -> Iterator[str]:
    """Yield presses on two disks that repeat none on one, or come before one of those."""
    single = [pose.id for pose in plan.poses if pose.doubles is None]
    for pose in plan.poses:
        if pose.doubles is None:
            continue
        if pose.doubles not in single:
            yield f"poses.{pose.id}.doubles: {pose.doubles} is no pose on one disk"
        elif pose.id < single[-1]:
            yield f"poses.{pose.id}.doubles: pose {single[-1]} on one disk comes after it"


def _move_problems(plan: PlanResult) -> Iterator[str]:
    stops = (None, *(pose.id for pose in plan.poses), None)
    ends = [(move.start, move.end) for move in plan.moves]
    if len(ends) != len(stops) - 1:
        yield f"moves: {len(plan.poses)} poses need {len(stops) - 1} moves, got {len(ends)}"
    for number, (found, wanted) in enumerate(zip(ends, pairwise(stops), strict=False)):
        if found != wanted:
            yield f"moves.{number}: (start, end) must be {wanted} (None: HOME), got {found}"


def _number_problems(plan: PlanResult) -> Iterator[str]:
    """Yield lists that do not have as many numbers as there are joints or poses."""
    count = len(plan.robot.joints)
    lists = {"robot.home": plan.robot.home}
    for number, pose in enumerate(plan.poses):
        lists[f"poses.{number}.joints"] = pose.joints
        lists[f"poses.{number}.approach_joints"] = pose.approach_joints
    for number, move in enumerate(plan.moves):
        lists |= {f"moves.{number}.via.{stop}": q for stop, q in enumerate(move.via)}
    for key, joints in lists.items():
        if len(joints) != count:
            yield f"{key}: needs a position of each of {count} joints, got {len(joints)}"
    if sorted(plan.search.order) != list(range(len(plan.poses))):
        yield f"search.order: must hold each pose id once, got {list(plan.search.order)}"
    for number in plan.comparison.candidates if plan.comparison else ():
        if not 0 <= number < plan.pool.valid:
            yield f"comparison.candidates: must be among {plan.pool.valid}, got {number}"
