"""A small plan on a dome, with its pool: a catalogue arm, on a rail or standing still."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.planning import PlanResult, PoolData, PoseRecord, SpreadRecord
from elastocal.planning.plan_result import (
    CellRecord,
    CheckRecord,
    ComparisonRecord,
    ContactRecord,
    MoveRecord,
    PoolRecord,
    RobotRecord,
    SearchRecord,
)
from elastocal.planning.search import Candidates, covering_radius, nearest_neighbour, technique
from elastocal.planning.surface import contact_frames
from elastocal.robot import Rail, Robot, catalogue, on_rail, with_tool
from elastocal.robot.inverse import inverse_for
from elastocal.sim.arm.measurement import SphericalCap

MODEL = "KR 120 R2700 extra HA"
RAIL_AT = 0.3125
"""Position of the rail, in m."""
APPROACH = 0.1
NEAR = 0.003
OVERRIDE = 0.2
CONTACT_SPEED = 0.02
LOAD_CASES = {
    "normal": (0.0, 0.0, -1100.0),
    "north": (280.0, 0.0, -1100.0),
    "south": (-280.0, 0.0, -1100.0),
    "east": (0.0, -280.0, -1100.0),
    "west": (0.0, 280.0, -1100.0),
}
UNREACHABLE = "reach"
CHECKS = ("joint_limits", "wrist")
LEAST_A5 = 0.6
T_FLANGE_TCP = np.array(
    [[1.0, 0.0, 0.0, 0.15], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.35], [0.0, 0.0, 0.0, 1.0]]
)
CAP = SphericalCap(apex=(1.6, RAIL_AT, 0.75))
_ON_DOME, _TOO_FAR, _POSES = 60, 4, 6


@cache
def robot(rail: bool = True) -> Robot:
    """Return a catalogue arm with a tool; the rail runs along y of its base."""
    urdf = with_tool(catalogue.urdf(MODEL), "flange", "tcp", T_FLANGE_TCP)
    if rail:
        urdf = on_rail(urdf, Rail("rail", (0.0, 1.0, 0.0), -1.0, 1.0))
    return Robot.from_urdf(urdf, "tcp")


@cache
def _sampled() -> tuple[np.ndarray, np.ndarray]:
    """Return points and normals; the last few are out of reach."""
    points, normals = CAP.spread(_ON_DOME, 0.0)
    far = points[:_TOO_FAR] + np.array([9.0, 0.0, 0.0])
    return np.vstack([points, far]), np.vstack([normals, normals[:_TOO_FAR]])


@dataclass(frozen=True, eq=False)
class _Found:
    """Postures of the points that have one, and what refused each point."""

    T_base_tcp: np.ndarray
    q: np.ndarray
    q_approach: np.ndarray
    branch: np.ndarray
    point: np.ndarray
    margin: np.ndarray
    refused_by: np.ndarray

    @property
    def contact(self) -> np.ndarray:
        return self.T_base_tcp[:, :3, 3]


@cache
def _found(rail: bool) -> _Found:
    """Return the posture of each point with the largest of its margins, without a free spin."""
    solver, external = inverse_for(robot(rail)), (RAIL_AT,) if rail else ()
    points, normals = _sampled()
    T = contact_frames(points, normals, np.zeros(1))[:, 0]
    off = T.copy()
    off[:, :3, 3] += APPROACH * normals
    here, there = (solver.solve_many(frames, external).q for frames in (T, off))
    margin = np.fmin(_margin(rail, here), _margin(rail, there))
    worst = np.where(np.isfinite(margin), margin, -np.inf).min(axis=0)
    branch = worst.argmax(axis=1)
    passed = worst.max(axis=1) > 0.0
    point = np.flatnonzero(passed)
    refused_by = np.full(len(points), CHECKS.index("wrist") + 1)
    refused_by[~np.isfinite(here[..., 0]).any(axis=1)] = 0
    refused_by[passed] = -1
    pick = (point, branch[point])
    return _Found(T[point], here[pick], there[pick], pick[1], point, margin[:, *pick], refused_by)


def _margin(rail: bool, q: np.ndarray) -> np.ndarray:
    """Return the margin of each check, shape (check, point, branch), in rad."""
    limits = robot(rail).limits.margin(q).min(axis=-1)
    return np.stack([limits - 0.05, np.abs(q[..., -2]) - LEAST_A5])


def _chosen(found: _Found, name: str = "cover") -> np.ndarray:
    """Return the numbers of the chosen candidates in search order."""
    order: np.ndarray = technique(name).search(Candidates(found.contact), _POSES).order
    return order


def _in_visiting_order(found: _Found) -> np.ndarray:
    """Return the chosen candidates from left to right."""
    chosen = _chosen(found)
    return chosen[np.argsort(found.contact[chosen, 1])]


@cache
def pool(rail: bool = True) -> PoolData:
    """Return the pool that `plan` was chosen from."""
    found = _found(rail)
    pose_id = np.full(len(found.q), -1)
    visited = _in_visiting_order(found)
    pose_id[visited] = np.arange(len(visited))
    return PoolData(
        contact=found.contact,
        normal=-found.T_base_tcp[:, :3, 2],
        T_base_tcp=found.T_base_tcp,
        q=found.q,
        q_approach=found.q_approach,
        joint_names=robot(rail).joint_names,
        branch=found.branch,
        margin=found.margin,
        check_names=CHECKS,
        check_units=("rad", "rad"),
        boundary_distance=CAP.width / 2 - np.linalg.norm(found.contact - CAP.apex, axis=1),
        pose_id=pose_id,
        point=found.point,
        sampled=_sampled()[0],
        refused_by=found.refused_by,
        refusal_names=(UNREACHABLE, *CHECKS),
    )


@cache
def plan(rail: bool = True) -> PlanResult:
    """Return a plan of six poses; one of its moves has a via point."""
    found, data = _found(rail), pool(rail)
    visited, chosen = _in_visiting_order(found), _chosen(found)
    arm = robot(rail)
    spread = _spread(data, chosen)
    return PlanResult(
        elastocal="0.1.0",
        cell=CellRecord(name="dome", file="cell.yaml", fingerprint="0" * 64),
        robot=RobotRecord(
            name=arm.name,
            urdf=arm.urdf,
            base=arm.base,
            tcp=arm.tip,
            joints=arm.joint_names,
            home=_home(rail),
        ),
        contact=ContactRecord(
            approach_distance=APPROACH,
            near_contact=NEAR,
            axis_override=OVERRIDE,
            contact_speed=CONTACT_SPEED,
            load_cases=LOAD_CASES,
        ),
        poses=tuple(_pose(data, number, int(c)) for number, c in enumerate(visited)),
        moves=_moves(data, visited, rail),
        search=SearchRecord(
            name="cover",
            metric="euclidean",
            seed=0,
            wanted=_POSES,
            d_max=None,
            covering_radius=spread.covering_radius,
            lower_bound=spread.covering_radius / 2,
            covered=None,
            order=tuple(int(data.pose_id[c]) for c in chosen),
            spread=spread,
        ),
        comparison=_comparison(data),
        pool=PoolRecord(
            file="pool.nc",
            sampled=len(data.sampled),
            valid=len(data),
            checks=_checks(data),
            bottleneck="wrist",
        ),
        findings=("the mesh is open: its edge counts as a boundary",),
    )


def _home(rail: bool) -> tuple[float, ...]:
    arm = (0.0, -1.75, 1.9, 0.0, 1.0, 0.0)
    return (0.0, *arm) if rail else arm


def _pose(data: PoolData, number: int, candidate: int) -> PoseRecord:
    T = data.T_base_tcp[candidate]
    margins = data.margin[:, candidate].tolist()
    return PoseRecord(
        id=number,
        candidate=candidate,
        joints=tuple(data.q[candidate].tolist()),
        approach_joints=tuple(data.q_approach[candidate].tolist()),
        tcp_position=tuple(T[:3, 3].tolist()),
        tcp_quaternion=tuple(Rotation.from_matrix(T[:3, :3]).as_quat().tolist()),
        normal=tuple(data.normal[candidate].tolist()),
        seen_by="station_1" if number % 2 else "station_2",
        contact_time=60.0 + number,
        margins=dict(zip(data.check_names, margins, strict=True)),
    )


def _moves(data: PoolData, visited: np.ndarray, rail: bool) -> tuple[MoveRecord, ...]:
    stops = [None, *range(len(visited)), None]
    halfway = 0.5 * (data.q_approach[visited[1]] + _home(rail))
    via = {1: (tuple(halfway.tolist()),)}
    return tuple(
        MoveRecord(start=stops[i], end=stops[i + 1], via=via.get(i, ()), duration=4.0 + i)
        for i in range(len(stops) - 1)
    )


def _spread(data: PoolData, chosen: np.ndarray) -> SpreadRecord:
    candidates = Candidates(data.contact)
    return SpreadRecord(
        covering_radius=covering_radius(candidates, chosen),
        boundary_distance=float(data.boundary_distance[chosen].mean()),
        nearest_neighbour=float(nearest_neighbour(candidates, chosen).mean()),
        o1=1e-4,
    )


def _comparison(data: PoolData) -> ComparisonRecord:
    """Return the candidates nearest to the rim, as a criterion would like them."""
    edge = np.argsort(data.boundary_distance)[:_POSES]
    return ComparisonRecord(
        name="ioops", candidates=tuple(edge.tolist()), spread=_spread(data, edge)
    )


def _checks(data: PoolData) -> tuple[CheckRecord, ...]:
    return tuple(
        CheckRecord(
            name=name,
            unit=unit,
            refused=int(np.count_nonzero(data.refused_by == number)),
            advice="move the tooling",
        )
        for number, (name, unit) in enumerate(
            zip(data.refusal_names, (None, *data.check_units), strict=True)
        )
    )


@cache
def plan_for(model: str, rail: bool = False, shift: tuple[float, float, float] = (0, 0, 0)):
    """Return the plan with another robot of the catalogue, its poses moved to within its reach."""
    urdf = with_tool(catalogue.urdf(model), "flange", "tcp", T_FLANGE_TCP)
    if rail:
        urdf = on_rail(urdf, Rail("rail", (0.0, 1.0, 0.0), -1.0, 1.0))
    arm, external = Robot.from_urdf(urdf, "tcp"), (RAIL_AT,) if rail else ()
    solver, old = inverse_for(arm), plan(rail)
    poses = []
    for pose in old.poses:
        T = pose.T_base_tcp
        T[:3, 3] += shift
        off = T.copy()
        off[:3, 3] += APPROACH * np.array(pose.normal)
        here, there = solver.solve_many(np.array([T, off]), external).q
        slot = int(np.nanargmin(np.abs(here - there).max(axis=-1)))
        new = {"joints": here[slot], "approach_joints": there[slot], "tcp_position": T[:3, 3]}
        poses.append(replace(pose, **{key: tuple(q.tolist()) for key, q in new.items()}))
    middle = (0.5 * (np.array(poses[0].approach_joints) + poses[1].approach_joints)).tolist()
    moves = tuple(replace(m, via=(tuple(middle),) if m.via else ()) for m in old.moves)
    record = replace(
        old.robot,
        name=arm.name,
        urdf=urdf,
        base=arm.base,
        joints=arm.joint_names,
        home=poses[0].approach_joints,
    )
    return replace(old, robot=record, poses=tuple(poses), moves=moves)
