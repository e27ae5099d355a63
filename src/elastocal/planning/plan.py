"""From a cell to a plan: requirements, surface, pool, search, visiting order (paper 2.2, 3.1).

`elastocal check` and `plan` both test the requirements on a cell before any candidate is made;
requirements on a single pose are left to the checks of the pool.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from scipy.spatial.transform import Rotation

from elastocal import __version__
from elastocal.arrays import FloatArray, IndexArray, triple
from elastocal.cell import Cell, contact_time, fingerprint, straight_time
from elastocal.errors import PlanningError
from elastocal.findings import Finding, Kind, as_number
from elastocal.parallel import one_blas_thread
from elastocal.planning.checks import (
    EdgeCheck,
    FlatnessCheck,
    FrictionCheck,
    SensorCheck,
    SightCheck,
    TorqueCheck,
    registration_shortages,
    station_shortage,
    unseen_bumps,
)
from elastocal.planning.more import SHARE
from elastocal.planning.motion import (
    Mover,
    clear_retreats,
    mover_for,
    plan_route,
    require_free_home,
)
from elastocal.planning.plan_result import (
    POOL,
    CellRecord,
    CheckRecord,
    ComparisonRecord,
    ContactRecord,
    PlanResult,
    PoolRecord,
    PoseRecord,
    RobotRecord,
    SearchRecord,
)
from elastocal.planning.pool import REACH_ADVICE, Pool, SampledPool, sample_pool
from elastocal.planning.pool_file import NOT_CHOSEN, PoolData
from elastocal.planning.postures import Postures
from elastocal.planning.production import production_findings
from elastocal.planning.rounds import Round, joined_moves
from elastocal.planning.scene import (
    OF_WRONG_CELLS,
    cell_surface,
    collision_scene,
    surface_findings,
)
from elastocal.planning.search import Cover, CoverSelection, SearchTechnique, Selection, technique
from elastocal.planning.search_pool import SearchPool
from elastocal.planning.surface import (
    Surface,
    arm_reach,
    sample_uniform,
    tiny_finding,
)
from elastocal.planning.variant import PlanVariant
from elastocal.progress import Progress, silent
from elastocal.robot import has_wrist

_POINTS = 200
"""Points of the surface at which a place for the contact disk is looked for."""


def require_possible_search(cell: Cell, compare: str | None = None) -> None:
    """Require a possible search, as far as this can be decided without a pool.

    Parameters
    ----------
    compare : str, optional
        Search technique to compare with the cell's own.

    Raises
    ------
    PlanningError
        If a technique is unknown, or an accuracy is requested without a process; if the process has
        no force, or fewer candidates are requested than poses.
    """
    search = cell.file.search
    technique(cell.technique)
    if compare is not None:
        technique(compare)
    if search.accuracy is not None and cell.process is None:
        raise PlanningError(
            "search.accuracy is the error on production: name its path in process.file of the cell"
            " file"
        )
    if cell.process is not None and not np.any(cell.process.force):
        raise PlanningError(
            "process.file: no row has a force, and a process without forces deflects nothing: give"
            " the force on the robot of each row (force_x[N] …), or leave process out"
        )
    wanted = search.pose_limit or 0
    if not search.pool >= wanted:
        raise PlanningError(
            f"search.pool: must be at least the {wanted} poses that are to be chosen (the default"
            f" of search.poses), got {search.pool}"
        )


def require_loads_possible_anywhere(cell: Cell, surface: Surface) -> None:
    """Require load cases that a pose could hold, and a robot whose torques can be judged.

    Parameters
    ----------
    cell, surface : Cell, Surface
        Who presses, and on what.

    Raises
    ------
    PlanningError
        If friction, or the sensor's range, refuses the load cases wherever they are applied; if
        torques are limited and the robot has no masses, so that the share of gravity is unknown; if
        the contact disk fits flat nowhere on the surface.
    SurfaceError
        If the region holds no part of the surface.
    """
    friction, sensor = FrictionCheck.of(cell, surface), SensorCheck.of(cell, surface)
    if not friction.everywhere > 0.0:
        raise PlanningError(
            f"load_cases: at every pose friction is {-friction.everywhere:.4g} N short of holding"
            f" them (friction fz / safety against the lateral force): {friction.advice}"
        )
    if sensor is not None and not sensor.everywhere > 0.0:
        raise PlanningError(
            "load_cases: at every pose they need"
            f" {1.0 - sensor.everywhere:.3g} times the sensor's range, the tool's weight included:"
            f" {sensor.advice}"
        )
    torque = TorqueCheck.of(cell, surface)
    if torque is not None and not cell.robot.has_masses:
        raise PlanningError(
            f"limits.torque: the torques of {', '.join(torque.judged)} are limited, and what the"
            f" arm's weight takes of them is not known: robot {cell.robot.name!r} has no link"
            " masses; give its links masses in the URDF (<inertial>), or leave the torques out"
            " (effort in the URDF, limits.torque.values)"
        )
    _require_place_for_disk(cell, surface)


def _require_place_for_disk(cell: Cell, surface: Surface) -> None:
    """Require that the whole contact disk lies on the surface, and flat, at one of many points."""
    points = sample_uniform(surface, _POINTS, np.random.default_rng(cell.file.search.seed))
    radius = 1e3 * cell.file.engagement.disk_radius
    for check in (EdgeCheck.of(cell, surface, points), FlatnessCheck.of(cell, surface, points)):
        best = float(check.at_points.max())
        if not best > 0.0:
            short = f"{-1e3 * best:.3g} mm" if check.unit == "m" else f"{-np.degrees(best):.3g} deg"
            doubts = tiny_finding(surface, arm_reach(cell.robot))
            advice = doubts[0] if doubts else check.advice
            raise PlanningError(
                f"engagement: no place of the surface takes the contact disk (radius {radius:.4g}"
                f" mm): of {_POINTS} points the best is {short} short of check {check.name!r};"
                f" {advice}"
            )


TORQUES_UNKNOWN = Kind("plan.torques-unknown", "torques of {joints} are not known and not judged")
NO_WRIST = Kind(
    "plan.no-wrist",
    "limits.wrist_angle is not judged: {name} has no six joints of which the fourth"
    " and the sixth turn",
)


def unjudged_limits(cell: Cell) -> list[Finding]:
    """Return the limits of the cell file that no check can judge on this robot."""
    known = zip(cell.robot.joint_names, np.isfinite(cell.torque_limits), strict=True)
    unknown = [name for name, is_known in known if not is_known]
    notes = [TORQUES_UNKNOWN(joints=unknown)] if unknown else []
    return notes if has_wrist(cell.robot) else [*notes, NO_WRIST(name=cell.robot.name)]


_SURFACE, _SEARCH = "surface", "search"
"""Stages under which progress is reported, beside `CANDIDATES` and `VISITING`."""
_REPLACEMENTS = 10
"""Number of times that poses without a free path are replaced by others."""


@dataclass(frozen=True, eq=False)
class PlanAndPool:
    """A plan, the pool beside it, and the surface that it lies on."""

    plan: PlanResult
    pool: PoolData
    surface: Surface
    share: float = 1.0
    """Share of the variance of the predictions on production that poses leave that add to
    measured ones."""


@dataclass(frozen=True, eq=False)
class _Choice:
    """The poses of a plan, with all that it was decided by."""

    cell: Cell
    surface: Surface
    pool: Pool
    search_pool: SearchPool
    selection: Selection
    """Numbers in the pool, in search order."""
    rounds: tuple[Round, ...]
    """The first goes through all poses; others repeat some."""

    @property
    def place(self) -> IndexArray:
        """Place of each chosen pose in the visiting order, shape (pose,), in search order."""
        return np.argsort(self.rounds[0].order)


_PLAIN = PlanVariant()


@one_blas_thread()
def make_plan(
    cell: Cell,
    compare: str | None = None,
    jobs: int | None = None,
    progress: Progress = silent,
    variant: PlanVariant = _PLAIN,
) -> PlanAndPool:
    """Return the calibration poses of a cell, checked and in visiting order.

    Everything random is drawn from ``search.seed`` of the cell file: the same cell gives the same
    plan.

    Parameters
    ----------
    compare : str, optional
        Search technique that is to choose as many poses from the same pool, for comparison.
    jobs : int, optional
        Number of processes; all cores by default.
    progress : callable, optional
        Hears the stage (``surface``, ``candidates``, ``search``, ``visiting order``), what is done
        of it and how much there is.
    variant : PlanVariant, optional
        What is done otherwise: `AddedTo` measured poses, or `Untracked`.

    Raises
    ------
    PlanningError
        If no plan can be made: the message says what refused most points and what to move.
    SurfaceError, FileAccessError
        If the surface cannot be read, or its region is empty.
    """
    other = None if compare is None else technique(compare)
    require_possible_search(cell, compare)
    for_findings, for_points, for_search = np.random.default_rng(cell.file.search.seed).spawn(3)
    progress(_SURFACE, 0, 1)
    surface = cell_surface(cell)
    findings = surface_findings(cell, surface, for_findings)
    require_loads_possible_anywhere(cell, surface)
    mover = mover_for(cell, collision_scene(cell, surface))
    require_free_home(cell.home, mover)
    progress(_SURFACE, 1, 1)
    sampled = sample_pool(cell, surface, for_points, jobs, progress)
    _require_enough(cell, sampled, findings)
    sampled = variant.pool(cell, surface, sampled)
    progress(_SEARCH, 0, 1)
    search_pool = SearchPool.of(cell, surface, sampled)
    selection, first = _choose(cell, search_pool, sampled, mover, for_search, progress, variant)
    further = variant.further_rounds(cell, surface, sampled, selection, mover, progress)
    chosen = _Choice(cell, surface, sampled.pool, search_pool, selection, (first, *further))
    progress(_SEARCH, 1, 1)
    production = search_pool.production(cell, selection.order) if variant.complete else None
    compared = None if other is None else _compared(cell, search_pool, other, selection, for_search)
    notes = [*_notes(chosen)]
    notes += production_findings(cell, production) if variant.complete else ()
    notes += variant.findings(cell, chosen.rounds)
    plan = PlanResult(
        elastocal=__version__,
        cell=CellRecord(name=cell.name, file=str(cell.path), fingerprint=fingerprint(cell)),
        robot=robot_record(cell),
        contact=_contact(cell),
        poses=_poses(chosen),
        moves=joined_moves(chosen.rounds, tuple(cell.home.tolist())),
        search=_search(chosen),
        comparison=compared,
        pool=_pool(sampled.pool),
        findings=(*findings, *notes),
        production=production,
        without=variant.without,
    )
    share = float(selection.trace[SHARE][-1]) if SHARE in selection.trace else 1.0
    return PlanAndPool(plan, _pool_data(chosen, sampled.points.position), surface, share)


def _compared(
    cell: Cell,
    pool: SearchPool,
    other: SearchTechnique,
    selection: Selection,
    rng: Generator,
) -> ComparisonRecord:
    """Return the choice of another technique from the same pool, as many poses."""
    everyone = pool.preferred(cell, np.arange(len(pool.candidates)))
    taken = pool.take(other, everyone, len(selection), rng).order
    return ComparisonRecord(
        name=other.name, candidates=tuple(taken.tolist()), spread=pool.spread(taken)
    )


def _require_enough(cell: Cell, sampled: SampledPool, findings: tuple[Finding, ...]) -> None:
    """Require a pool with enough poses, or state what to move."""
    pool, wanted = sampled.pool, cell.file.search.poses or 1
    found = len(pool.postures)
    if found >= wanted:
        return
    refused = ", ".join(f"{name} {pool.refused[name]}" for name in pool.commonest_refusals)
    odd = [each for each in findings if each.kind in OF_WRONG_CELLS]
    why = "; ".join([*odd, pool.advice])
    short = f", and {wanted} poses are wanted (search.poses)" if wanted > 1 else ""
    raise PlanningError(
        f"{found} of {pool.sampled} points on the surface can be pressed on{short};"
        f" refused by {refused}; {why}"
    )


def _choose(
    cell: Cell,
    search_pool: SearchPool,
    sampled: SampledPool,
    mover: Mover,
    rng: Generator,
    progress: Progress,
    variant: PlanVariant,
) -> tuple[Selection, Round]:
    """Return poses with free paths from HOME and on to the surface; replace others."""
    left: IndexArray = np.arange(len(search_pool.candidates))
    for _ in range(_REPLACEMENTS):
        selection = variant.choose(cell, search_pool, sampled, left, rng)
        postures = sampled.pool.postures.take(selection.order)
        route = plan_route(cell.home, postures, mover, progress)
        blocked = np.union1d(
            route.unreachable, np.flatnonzero(~clear_retreats(cell, mover, postures))
        )
        if not len(blocked):
            return selection, Round(np.arange(len(selection)), postures, route)
        left = np.setdiff1d(left, selection.order[blocked])
    raise PlanningError(
        f"no way without collision leads from HOME to {len(blocked)} of"
        f" {len(selection)} poses, and others in their place fared no better: move motion.home or"
        " the fixtures, or lengthen engagement.approach_distance"
    )


FEW_CANDIDATES = Kind(
    "plan.few-candidates",
    "only {found} of {wanted} candidates were found among {sampled} points; most of"
    " the others were refused by {checks}; {advice}",
    shown={"checks": " and ".join},
)
NOT_COVERED = Kind(
    "plan.not-covered",
    "d_max of {d_max} mm was not reached: the worst-covered candidate is {radius} mm"
    " from the nearest of {poses} poses",
    shown=dict.fromkeys(("d_max", "radius"), as_number(".4g", 1e3)),
)
NO_D_MAX = Kind(
    "plan.no-d-max", "{name} knows no d_max: it chose as many poses as cover needs for it"
)
ASSUMED = Kind("plan.assumed", "assumed, {field}: {reason}")
MOVE_STATION = Kind(
    "plan.move-station",
    "{shortage}; no station sees enough poses beside: move or add one, or plan more poses",
)


def _notes(choice: _Choice) -> tuple[Finding, ...]:
    """Return remarks on how the poses were found, a line each."""
    notes: list[Finding] = []
    cell, pool, search, poses = choice.cell, choice.pool, _search(choice), _poses(choice)
    wanted = cell.file.search.pool
    if len(pool.postures) < wanted:
        notes.append(
            FEW_CANDIDATES(
                found=len(pool.postures),
                wanted=wanted,
                sampled=pool.sampled,
                checks=pool.commonest_refusals[:2],
                advice=pool.advice,
            )
        )
    if search.d_max is not None and not search.covered:
        notes.append(
            NOT_COVERED(d_max=search.d_max, radius=search.covering_radius, poses=len(search.order))
        )
    if search.d_max is not None and not isinstance(technique(search.name), Cover):
        notes.append(NO_D_MAX(name=search.name))
    notes.extend(_assumptions(cell))
    notes.extend(unjudged_limits(cell))
    notes.extend(_shortages(poses))
    notes.extend(unseen_bumps([pose.seen_by for pose in poses]))
    return tuple(notes)


def _shortages(poses: tuple[PoseRecord, ...]) -> Iterator[Finding]:
    """Yield each station that no choice of stations gives enough poses to be registered."""
    for station, few in registration_shortages([pose.seen_by for pose in poses]).items():
        yield MOVE_STATION(shortage=station_shortage(station, few))


def _assumptions(cell: Cell) -> list[Finding]:
    """Return the assumptions of the robot's description that the cell file does not replace."""
    given = set()
    if cell.file.limits.torque.values:
        given.add("effort")
    if cell.file.motion.speed:
        given.add("velocity")
    return [
        ASSUMED(field=each.field, reason=each.reason)
        for each in cell.robot.assumptions
        if each.field not in given
    ]


def robot_record(cell: Cell) -> RobotRecord:
    """Return the robot of a cell, as a plan states it."""
    robot, home = cell.robot, tuple(cell.home.tolist())
    return RobotRecord(
        robot.name, robot.urdf, robot.base, tcp=robot.tip, joints=robot.joint_names, home=home
    )


def _contact(cell: Cell) -> ContactRecord:
    engagement = cell.file.engagement
    return ContactRecord(
        approach_distance=engagement.approach_distance,
        near_contact=engagement.near_contact,
        axis_override=cell.file.motion.override,
        contact_speed=cell.file.motion.contact_speed,
        straight_time=straight_time(cell),
        load_cases={name: triple(force) for name, force in cell.file.presses.items()},
    )


def _poses(choice: _Choice) -> tuple[PoseRecord, ...]:
    check = SightCheck.of(choice.cell, choice.surface)
    poses: list[PoseRecord] = []
    for lap, each in enumerate(choice.rounds):
        postures = each.postures.take(each.route.order)
        stations = check.assigned(postures) if check else [None] * len(postures)
        for number, (chosen, station) in enumerate(zip(each.order.tolist(), stations, strict=True)):
            candidate = int(choice.selection.order[chosen])
            pose = _pose(choice, len(poses), candidate, postures.take([number]), station)
            poses.append(replace(pose, doubles=int(choice.place[chosen]) if lap else None))
    return tuple(poses)


def _pose(
    choice: _Choice, number: int, candidate: int, posture: Postures, seen_by: str | None
) -> PoseRecord:
    """Return the record of one posture."""
    margins = choice.pool.margins
    # From the joints and not from the frame wanted: what the robot will do.
    T = choice.cell.robot.forward(posture.q[0])
    x, y, z, w = Rotation.from_matrix(T[:3, :3]).as_quat()
    named = zip(margins.names, margins.margin[:, candidate], strict=True)
    return PoseRecord(
        id=number,
        candidate=candidate,
        joints=tuple(posture.q[0].tolist()),
        approach_joints=tuple(posture.q_approach[0].tolist()),
        tcp_position=triple(T[:3, 3]),
        tcp_quaternion=(float(x), float(y), float(z), float(w)),
        normal=triple(posture.normal[0]),
        seen_by=seen_by,
        contact_time=contact_time(choice.cell),
        # JSON has no infinity: a check that cannot refuse is left out.
        margins={name: float(m) for name, m in named if np.isfinite(m)},
    )


def _search(choice: _Choice) -> SearchRecord:
    search, selection, pool = choice.cell.file.search, choice.selection, choice.search_pool
    spread = pool.spread(selection.order)
    has_process = choice.cell.process is not None
    visits = sum(len(each.chosen) for each in choice.rounds)
    return SearchRecord(
        name=selection.name,
        metric=search.metric,
        seed=search.seed,
        wanted=search.pose_limit,
        d_max=search.d_max,
        covering_radius=spread.covering_radius,
        lower_bound=selection.lower_bound if isinstance(selection, CoverSelection) else None,
        covered=None if search.d_max is None else spread.covering_radius <= search.d_max,
        order=(*choice.place.tolist(), *range(len(selection), visits)),
        spread=spread,
        process_unseen=pool.information.process_unseen if has_process else None,
    )


def _pool(pool: Pool) -> PoolRecord:
    refused = pool.refused
    units = (None, *pool.margins.units)
    advice = (REACH_ADVICE, *pool.margins.advice)
    return PoolRecord(
        file=POOL,
        sampled=pool.sampled,
        valid=len(pool.postures),
        checks=tuple(
            CheckRecord(name=name, unit=unit, refused=refused[name], advice=text)
            for name, unit, text in zip(pool.refusals, units, advice, strict=True)
        ),
        bottleneck=pool.bottleneck,
    )


def _pool_data(choice: _Choice, sampled: FloatArray) -> PoolData:
    """Return the pool that goes beside the plan; ``sampled`` are all points that were tried."""
    pool, postures = choice.pool, choice.pool.postures
    pose_id = np.full(len(postures), NOT_CHOSEN, dtype=np.intp)
    pose_id[choice.selection.order] = choice.place
    return PoolData(
        contact=postures.contact,
        normal=postures.normal,
        T_base_tcp=postures.T_base_tcp,
        q=postures.q,
        q_approach=postures.q_approach,
        joint_names=choice.cell.robot.joint_names,
        branch=pool.branch,
        margin=pool.margins.margin,
        check_names=pool.margins.names,
        check_units=pool.margins.units,
        boundary_distance=choice.search_pool.boundary_distance,
        pose_id=pose_id,
        point=postures.point,
        sampled=sampled,
        refused_by=pool.refused_by,
        refusal_names=pool.refusals,
    )
