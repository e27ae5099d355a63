"""Poses in free space from which a tracker determines the geometry of an arm best.

Postures are drawn from the whole range of the joints; those that a station sees and that keep the
cell's clearance are kept. A search technique chooses among them by the derivatives of the arm's
errors (`elastocal.geometry.problem`), as it chooses contact poses by their observation rows:
`i_optimal` makes the mean variance of predicted positions over all of the pool least (G. E. P. Box,
N. R. Draper, JASA 54, 1959), `ioops` the volume of the errors' confidence ellipsoid (D. Daney et
al., IJRR 24, 2005), `cover` spreads the marker in space.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from elastocal import __version__
from elastocal.arrays import FloatArray, IndexArray
from elastocal.blocks import Block
from elastocal.cell import Cell, fingerprint
from elastocal.errors import PlanningError, present
from elastocal.findings import Finding, Kind
from elastocal.geometry.arm import LOW_ORDERS, ORDERS, ArmErrors, waves
from elastocal.geometry.derivatives import Derivatives
from elastocal.geometry.determined import told_apart
from elastocal.geometry.joint_functions import beyond_low_orders
from elastocal.geometry.positions import Payload, Positions
from elastocal.geometry.problem import PRIOR_WIDTH, GeometryProblem, State, prior_weight
from elastocal.planning import (
    CellRecord,
    CollisionScene,
    Joints,
    MoveRecord,
    Postures,
    RobotRecord,
    Vector,
    cell_surface,
    collision_scene,
    move_records,
    robot_record,
)
from elastocal.planning.checks import SightCheck
from elastocal.planning.motion import Mover, Route, mover_for, plan_route, require_free_home
from elastocal.planning.search import Candidates, SearchTechnique, technique
from elastocal.progress import Progress, silent
from elastocal.records import record
from elastocal.results import brief_repr

_SCHEMA = "elastocal.position-plan/3"
_RUNG = "weight"
"""The errors that the poses are chosen for: places and zeros of the joints, and what they yield."""
_POOL, _BATCH, _MOST_DRAWN = 500, 1000, 60_000
"""Postures to choose from, and how many are drawn for them, at a time and at most."""
_CANDIDATES = "candidates"
_OF_PROCESS = 200
"""Postures of the pool at which predictions are to be good."""
_FEWEST = 2
"""Coordinates for each error of the arm, below which a plan says that they are few."""
_REPLACEMENTS = 10
_FINEST = 3e-5
"""Standard deviation of a coordinate that the prior is weighed against, in m."""
_ORDERS = (10, 20, 40)
"""Waves a turn up to which a plan says what its poses show of functions of the joints."""
_UNKNOWN = 1.0 / 3.0
"""Part of a function that may stay unknown."""
_SAMPLES = 200
"""Angles at which a joint's function is judged."""
_STEP = 100
"""Step of the number of poses that such functions are said to need."""


@brief_repr
@record()
class PositionPose:
    """A pose in free space, where the marker is to be measured."""

    id: int
    """Number from 0, in visiting order."""
    joints: Joints
    """In rad or m."""
    tcp_position: Vector
    """In base, in m."""
    station: str
    """Station that is to measure it."""


@record()
class PosesNeeded:
    """The error to expect of a number of poses."""

    poses: int
    amplification: float
    """Error of predicted positions over the pool, in standard deviations of a coordinate that the
    tracker measures: root mean square over the pool of the predicted distance."""


@record()
class FunctionsShown:
    """How well poses determine the function of a joint: errors of its gear and encoder."""

    joint: str
    orders: int
    """Up to so many waves a turn."""
    unknown: float
    """Part of such a function of likely size that these poses leave unknown."""
    poses: int | None
    """Drawn poses that leave less than a third; None: more than the pool has."""


@brief_repr
@record(_SCHEMA, reads=("elastocal.position-plan/1", "elastocal.position-plan/2"))
class PositionPlan:
    """Poses for `elastocal geometry`, in visiting order; also its file."""

    elastocal: str
    cell: CellRecord
    robot: RobotRecord
    technique: str
    poses: tuple[PositionPose, ...]
    moves: tuple[MoveRecord, ...]
    drawn: int
    """Postures that were drawn."""
    pool: int
    """Number of them that may be measured."""
    refused: dict[str, int]
    """Number refused by sight and collision."""
    errors: int
    """Errors of the arm that the poses determine."""
    fixed: dict[str, str]
    """Errors that they do not determine, with reasons."""
    expected: tuple[PosesNeeded, ...]
    """Expected accuracy with a quarter, half and all of the poses, in the order of the search."""
    findings: tuple[Finding, ...]
    functions: tuple[FunctionsShown, ...] = ()
    """How well they determine the function of each joint; empty in older files."""

    def show(self) -> Iterator[Block]:
        """Yield the poses to measure, and the expected accuracy."""
        from elastocal.geometry.show import show_position_plan

        return show_position_plan(self)

    @property
    def travel_time(self) -> float:
        """Estimated time of the moves, in s."""
        return sum(move.duration for move in self.moves)


@dataclass(frozen=True, eq=False)
class _FreePool:
    """Postures that may be measured."""

    q: FloatArray
    """Shape (posture, joint), in rad or m."""
    station: list[str]
    drawn: int
    refused: dict[str, int]

    def postures(self, cell: Cell, index: IndexArray) -> Postures:
        """Return some of them; a retreat moves against the tool's axis."""
        q = self.q[index]
        T = cell.robot.forward(q)
        return Postures(T, -T[:, :3, 2], q, q, np.arange(len(q)))


def plan_positions(
    cell: Cell, count: int, search: str = "i_optimal", seed: int = 0, progress: Progress = silent
) -> PositionPlan:
    """Return poses in free space for a geometric calibration.

    Parameters
    ----------
    cell : Cell
        With marker and stations.
    count : int
        Number of poses.
    search : str
        Name of the search technique.
    seed : int
        Seed of everything random.
    progress : Progress
        Called with stage, done and total.

    Raises
    ------
    PlanningError
        If the cell has no marker or station, or too few postures can be measured.
    SurfaceError, FileAccessError
        If the surface cannot be read.
    """
    wanted = technique(search)
    rng = np.random.default_rng(seed)
    surface = cell_surface(cell)
    scene = collision_scene(cell, surface)
    sight = SightCheck.of(cell, surface)
    if sight is None:
        raise PlanningError(
            f"cell {cell.name} has no marker or no tracker: positions need both (keys 'marker',"
            " 'trackers')"
        )
    mover = mover_for(cell, scene)
    require_free_home(cell.home, mover)
    pool = _free_pool(cell, scene, sight, max(_POOL, count), rng, progress)
    if len(pool.q) < count:
        refused = ", ".join(f"{name} {number}" for name, number in pool.refused.items())
        raise PlanningError(
            f"{len(pool.q)} of {pool.drawn} postures can be measured, {count} are wanted; refused"
            f" by {refused}; {sight.advice}"
        )
    knowledge = _Knowledge.of(cell, pool)
    order, route = _choose(cell, pool, knowledge, (wanted, count, rng), (mover, progress))
    fewer = sorted({max(1, count // 4), max(1, count // 2), count})
    return PositionPlan(
        elastocal=__version__,
        cell=CellRecord(name=cell.name, file=str(cell.path), fingerprint=fingerprint(cell)),
        robot=robot_record(cell),
        technique=wanted.name,
        poses=_poses(cell, pool, order[route.order]),
        moves=move_records(route),
        drawn=pool.drawn,
        pool=len(pool.q),
        refused=pool.refused,
        errors=knowledge.errors,
        fixed=knowledge.fixed,
        expected=tuple(PosesNeeded(n, knowledge.amplification(order[:n])) for n in fewer),
        findings=_findings(count, knowledge.errors),
        functions=tuple(knowledge.functions(order)),
    )


def _free_pool(
    cell: Cell,
    scene: CollisionScene,
    sight: SightCheck,
    wanted: int,
    rng: np.random.Generator,
    progress: Progress,
) -> _FreePool:
    """Return postures that a station sees and that keep clear of everything."""
    limits, margin = cell.robot.limits, cell.joint_margin
    whole_turn = np.where(cell.robot.revolute, np.pi, np.inf)
    low = np.maximum(limits.lower + margin, -whole_turn)
    high = np.minimum(limits.upper - margin, whole_turn)
    kept: list[FloatArray] = []
    stations: list[str] = []
    drawn, refused = 0, Counter({"sight": 0, "collision": 0})
    while len(stations) < wanted and drawn < _MOST_DRAWN:
        q = rng.uniform(low, high, (_BATCH, len(low)))
        drawn += len(q)
        postures = Postures(T := cell.robot.forward(q), T[:, :3, 2], q, q, np.arange(len(q)))
        seen_by = sight.seen_by(postures)
        seen = np.array([each is not None for each in seen_by])
        free = seen.copy()
        free[seen] = scene.keeps(q[seen], cell.file.limits.clearance)
        refused.update(sight=int((~seen).sum()), collision=int((seen & ~free).sum()))
        kept.append(q[free])
        stations += [seen_by[row] or "" for row in np.flatnonzero(free)]
        progress(_CANDIDATES, min(len(stations), wanted), wanted)
    return _FreePool(np.concatenate(kept), stations, drawn, dict(refused))


@dataclass(frozen=True, eq=False)
class _Knowledge:
    """Information about the arm in each posture of a pool."""

    marker: FloatArray
    """Marker in base, shape (posture, 3), in m."""
    problem: GeometryProblem
    derivatives: Derivatives
    columns: IndexArray
    """Unknowns that the pool determines."""
    fixed: dict[str, str]

    @classmethod
    def of(cls, cell: Cell, pool: _FreePool) -> "_Knowledge":
        robot, at_tcp = cell.robot, _marker(cell)
        T = robot.forward(pool.q)
        marker = T[:, :3, 3] + T[:, :3, :3] @ at_tcp
        free = Positions.unloaded(pool.q, Payload())
        station = np.array(pool.station)
        problem = GeometryProblem(robot, replace(free, markers=marker[:, None], station=station))
        stands = np.tile(np.eye(4), (len(problem.data.stations), 1, 1))
        nominal = State(stands, at_tcp[None], ArmErrors.none(pool.q.shape[1]))
        derivatives = problem.linearise(nominal)[1]
        columns, fixed = told_apart(derivatives, problem, _RUNG)
        return cls(marker, problem, derivatives, columns, {each.name: each.why for each in fixed})

    @property
    def errors(self) -> int:
        """Number of unknowns that are errors of the arm."""
        unknowns = self.problem.unknowns
        return sum(unknowns[i].rung != "registration" for i in self.columns.tolist())

    @property
    def size(self) -> FloatArray:
        """Likely size of every unknown, shape (unknown,)."""
        return np.array([unknown.size for unknown in self.problem.unknowns])

    @cached_property
    def rows(self) -> FloatArray:
        """Derivatives by unknowns that the pool determines, each in its likely size.

        Shape (posture, 3, unknown), in m.
        """
        return np.asarray(self.derivatives.dense[:, :, self.columns] * self.size[self.columns])

    def candidates(self, left: IndexArray) -> Candidates:
        """Return some postures for a search that is to predict well all over the pool."""
        spread = np.linspace(0, len(self.rows) - 1, min(_OF_PROCESS, len(self.rows)))
        everywhere = self.rows[spread.astype(np.intp)].reshape(-1, self.rows.shape[2])
        return Candidates(self.marker[left], self.rows[left], process=everywhere)

    def amplification(self, chosen: IndexArray) -> float:
        """Return the error of predictions of some poses; see `PosesNeeded`."""
        unknowns = self.rows.shape[2]
        A, all_rows = self.rows[chosen].reshape(-1, unknowns), self.rows.reshape(-1, unknowns)
        prior = np.diag(prior_weight(self.problem, _FINEST)[self.columns])
        variance = np.einsum("ru,uv,rv->r", all_rows, np.linalg.inv(A.T @ A + prior), all_rows)
        return float(np.sqrt(variance.reshape(-1, 3).sum(axis=1).mean()))

    def functions(self, chosen: IndexArray) -> Iterator[FunctionsShown]:
        """Yield what some poses show of the functions of each joint, and how many it takes."""
        joints = [joint for joint in self.problem.robot.chain.joints if joint.revolute]
        if not joints:
            return
        counts = range(_STEP, len(self.marker) + 1, _STEP)
        drawn = np.array([self._unknown(np.arange(n)) for n in counts])
        for j, (joint, here) in enumerate(zip(joints, self._unknown(chosen), strict=True)):
            for k, orders in enumerate(_ORDERS):
                enough = [n for n, each in zip(counts, drawn, strict=True) if each[j, k] < _UNKNOWN]
                least = min(enough, default=None)
                yield FunctionsShown(joint.name, orders, float(here[k]), least)

    def _unknown(self, chosen: IndexArray) -> FloatArray:
        """Return the part of each joint's function that poses leave unknown, (joint, orders)."""
        dense, size = self.problem.dense, self.size
        free = np.concatenate([self.columns, np.arange(dense, len(size))])
        none, one = np.zeros((len(self.marker), 3)), np.ones(len(self.marker))
        G = self.derivatives.normal(none, one, size, free, chosen)[0]
        prior = prior_weight(self.problem, _FINEST)[free]
        start = len(self.columns)
        spread = (np.linalg.inv(G + np.diag(prior)) * _FINEST**2)[start:, start:]
        count = len(spread) // self.derivatives.joints
        found = []
        for j, q in enumerate(self.derivatives.q.T):
            own = slice(j * count, (j + 1) * count)
            scaled = _waves_within(q) * size[dense:][own]
            for orders in _ORDERS:
                wave = scaled[:, : 2 * (orders - LOW_ORDERS)]
                left = spread[own, own][: wave.shape[1], : wave.shape[1]]
                known = PRIOR_WIDTH**2 * (wave**2).sum()
                found.append(np.sqrt(np.einsum("sk,kl,sl->", wave, left, wave) / known))
        return np.array(found).reshape(-1, len(_ORDERS))


def _waves_within(q: FloatArray) -> FloatArray:
    """Return the waves of a joint over the range of some angles, beyond low orders.

    Outside that range nothing is known, and nothing need be.
    """
    angle = np.linspace(q.min(), q.max(), _SAMPLES)
    return beyond_low_orders(angle, waves(angle[:, None], LOW_ORDERS + 1, ORDERS)[:, 0])


def _choose(
    cell: Cell,
    pool: _FreePool,
    knowledge: _Knowledge,
    search: tuple[SearchTechnique, int, np.random.Generator],
    motion: tuple[Mover, Progress],
) -> tuple[IndexArray, Route]:
    """Return the postures of the best poses with free paths, and the round through them."""
    (wanted, count, rng), (mover, progress) = search, motion
    left: IndexArray = np.arange(len(pool.q))
    for _ in range(_REPLACEMENTS):
        order = left[wanted.search(knowledge.candidates(left), count, rng).order]
        route = plan_route(cell.home, pool.postures(cell, order), mover, progress)
        if not len(route.unreachable):
            return order, route
        left = np.setdiff1d(left, order[route.unreachable])
    raise PlanningError(
        "no way without collision leads from HOME to some poses, and others in their place fared"
        " no better: move motion.home or the fixtures"
    )


def _marker(cell: Cell) -> FloatArray:
    """Return the marker in the tcp, shape (3,), in m."""
    marker = present(cell.file.marker, "marker")
    return marker.position_tcp


def _poses(cell: Cell, pool: _FreePool, visited: IndexArray) -> tuple[PositionPose, ...]:
    poses = []
    for number, posture in enumerate(visited.tolist()):
        q = pool.q[posture]
        x, y, z = cell.robot.forward(q)[:3, 3].tolist()
        poses.append(PositionPose(number, tuple(q.tolist()), (x, y, z), pool.station[posture]))
    return tuple(poses)


FEW_POSES = Kind(
    "positions.few-poses",
    "{poses} poses give {coordinates} coordinates for {errors} errors of the arm: plan"
    " {least} at least",
)


def _findings(count: int, errors: int) -> tuple[Finding, ...]:
    least = -(-_FEWEST * errors // 3)
    if count >= least:
        return ()
    return (FEW_POSES(poses=count, coordinates=3 * count, errors=errors, least=least),)
