"""Put the decisions of planning together as the plan's record and its pool."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal import __version__
from elastocal.arrays import FloatArray
from elastocal.cell import Cell, fingerprint
from elastocal.planning.motion import Route, contact_time
from elastocal.planning.plan_result import (
    POOL,
    CellRecord,
    CheckRecord,
    ComparisonRecord,
    ContactRecord,
    MoveRecord,
    PlanResult,
    PoolRecord,
    PoseRecord,
    RobotRecord,
    SearchRecord,
    SpreadRecord,
    Vector,
)
from elastocal.planning.pool import REACH_ADVICE, Pool
from elastocal.planning.pool_file import NOT_CHOSEN, PoolData
from elastocal.planning.pool_sampling import SampledPool
from elastocal.planning.search import CoverSelection, Selection
from elastocal.planning.search_pool import SearchPool


@dataclass(frozen=True, eq=False)
class Decisions:
    """Everything that a plan is put together from."""

    cell: Cell
    sampled: SampledPool
    search_pool: SearchPool
    selection: Selection
    """Numbers in the pool, in search order."""
    spread: SpreadRecord
    """How the selection lies in the pool."""
    comparison: Selection | None
    route: Route
    """Numbers in the selection, in visiting order."""
    seen_by: tuple[str | None, ...]
    """Station of each chosen pose, in search order."""
    findings: tuple[str, ...]


def plan_record(decisions: Decisions) -> PlanResult:
    """Return the plan's record."""
    cell, pool = decisions.cell, decisions.sampled.pool
    compared = decisions.comparison
    return PlanResult(
        elastocal=__version__,
        cell=CellRecord(name=cell.name, file=str(cell.path), fingerprint=fingerprint(cell)),
        robot=_robot(cell),
        contact=_contact(cell),
        poses=_poses(decisions),
        moves=_moves(decisions.route),
        search=_search(decisions),
        comparison=None if compared is None else _comparison(decisions, compared),
        pool=_pool(pool),
        findings=decisions.findings,
    )


def pool_data(decisions: Decisions) -> PoolData:
    """Return the pool that goes beside the plan."""
    pool, points = decisions.sampled.pool, decisions.sampled.points
    pose_id = np.full(len(pool.postures), NOT_CHOSEN, dtype=np.intp)
    pose_id[decisions.selection.order[decisions.route.order]] = np.arange(
        len(decisions.route.order)
    )
    return PoolData(
        contact=pool.postures.contact,
        normal=pool.postures.normal,
        T_base_tcp=pool.postures.T_base_tcp,
        q=pool.postures.q,
        q_approach=pool.postures.q_approach,
        joint_names=decisions.cell.robot.joint_names,
        branch=pool.branch,
        margin=pool.verdicts.margin,
        check_names=pool.verdicts.names,
        check_units=pool.verdicts.units,
        boundary_distance=decisions.search_pool.boundary_distance,
        pose_id=pose_id,
        point=pool.postures.point,
        sampled=points.position,
        refused_by=pool.refused_by,
        refusal_names=pool.refusals,
    )


def _robot(cell: Cell) -> RobotRecord:
    robot = cell.robot
    return RobotRecord(
        name=robot.name,
        urdf=robot.urdf,
        base=robot.base,
        tcp=robot.tip,
        joints=robot.joint_names,
        home=tuple(cell.home.tolist()),
    )


def _contact(cell: Cell) -> ContactRecord:
    engagement, loads = cell.file.engagement, cell.file.load_cases
    return ContactRecord(
        approach_distance=engagement.approach_distance,
        near_contact=engagement.near_contact,
        axis_override=cell.file.motion.override,
        contact_speed=cell.file.motion.contact_speed,
        load_cases={
            name: _vector(force) for name, force in zip(loads.cases, loads.force_tcp, strict=True)
        },
    )


def _poses(decisions: Decisions) -> tuple[PoseRecord, ...]:
    pool, robot = decisions.sampled.pool, decisions.cell.robot
    poses = []
    for number, chosen in enumerate(decisions.route.order):
        candidate = int(decisions.selection.order[chosen])
        posture = pool.postures.take([candidate])
        # From the joints and not from the frame wanted: what the robot will do.
        T = robot.forward(posture.q[0])
        margins = dict(zip(pool.verdicts.names, pool.verdicts.margin[:, candidate], strict=True))
        x, y, z, w = Rotation.from_matrix(T[:3, :3]).as_quat()
        poses.append(
            PoseRecord(
                id=number,
                candidate=candidate,
                joints=tuple(posture.q[0].tolist()),
                approach_joints=tuple(posture.q_approach[0].tolist()),
                tcp_position=_vector(T[:3, 3]),
                tcp_quaternion=(float(x), float(y), float(z), float(w)),
                normal=_vector(posture.normal[0]),
                seen_by=decisions.seen_by[chosen],
                contact_time=contact_time(decisions.cell),
                # JSON has no infinity: a check that cannot refuse is left out.
                margins={name: float(m) for name, m in margins.items() if np.isfinite(m)},
            )
        )
    return tuple(poses)


def _comparison(decisions: Decisions, other: Selection) -> ComparisonRecord:
    return ComparisonRecord(
        name=other.name,
        candidates=tuple(other.order.tolist()),
        spread=decisions.search_pool.spread(other.order),
    )


def _moves(route: Route) -> tuple[MoveRecord, ...]:
    place = {int(chosen): number for number, chosen in enumerate(route.order)}
    return tuple(
        MoveRecord(
            start=None if move.start is None else place[move.start],
            end=None if move.end is None else place[move.end],
            via=tuple(tuple(joints.tolist()) for joints in move.via),
            duration=move.duration,
        )
        for move in route.moves
    )


def _search(decisions: Decisions) -> SearchRecord:
    search, selection = decisions.cell.file.search, decisions.selection
    spread = decisions.spread
    covers = selection if isinstance(selection, CoverSelection) else None
    place = np.empty(len(selection), dtype=np.intp)
    place[decisions.route.order] = np.arange(len(selection))
    has_process = decisions.search_pool.candidates.process is not None
    return SearchRecord(
        name=selection.name,
        metric=search.metric,
        seed=search.seed,
        wanted=search.most,
        d_max=search.d_max,
        covering_radius=spread.covering_radius,
        lower_bound=covers.lower_bound if covers else None,
        covered=None if search.d_max is None else spread.covering_radius <= search.d_max,
        order=tuple(place.tolist()),
        spread=spread,
        process_unseen=decisions.search_pool.information.process_unseen if has_process else None,
    )


def _pool(pool: Pool) -> PoolRecord:
    refused = pool.refused
    units = (None, *pool.verdicts.units)
    advice = (REACH_ADVICE, *pool.verdicts.advice)
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


def _vector(values: FloatArray) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z
