"""Poses to add to measured ones: the best next for production, and what each of them leaves.

With the information ``S`` of the measured poses, the next pose is the one whose rows ``B`` leave
the least mean variance of the predictions on production, ``tr(P (S + B^T B)^-1)``, and so on from
there (V. V. Fedorov, *Theory of Optimal Experiments*, 1972, who adds one point after the other). A
measured pose that is far from all others gets a neighbour first: left out, it is predicted by
extrapolation, which no number of poses elsewhere changes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import Cell
from elastocal.errors import PlanningError, present
from elastocal.identification import posture_reach
from elastocal.planning.pool import NearProduction, SampledPool
from elastocal.planning.pool_file import PoolData
from elastocal.planning.postures import Postures
from elastocal.planning.search import (
    CRITERIA,
    Candidates,
    Information,
    Selection,
    best_addition,
    build_information,
)
from elastocal.planning.search_pool import SearchPool, judging_model, pose_rows, process_rows
from elastocal.planning.variant import PlanVariant
from elastocal.results import brief_repr
from elastocal.robot import Robot

SHARE = "share"
"""Trace of a selection: the share of the variance that its first 1, 2, … poses leave."""
_SEARCH = "i_optimal"
_SAME = 0.05
"""Distance in which a candidate counts as a measured pose, relative to the reach of coverage."""
_NEIGHBOUR = 0.25
"""The least distance of a neighbour: one nearer would repeat the pose, not predict it."""
_LEAST_NEAR, _MOST = 20, 400
"""Candidates near production below which all are looked at, and the most that are, evenly taken."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Additions:
    """Candidates to add to measured poses, the best first."""

    order: IndexArray
    """Numbers in the pool, shape (n,)."""
    share: FloatArray
    """Share of the variance of the predictions on production that the first 1, 2, … leave, (n,)."""


@brief_repr
@dataclass(frozen=True, eq=False)
class AddedTo(PlanVariant):
    """Measured poses to which a plan adds."""

    joint_position: FloatArray
    """In contact, shape (pose, joint), in rad or m."""
    beside: FloatArray
    """Those that each get a neighbour, shape (pose, joint)."""
    complete = False

    def choose(
        self,
        cell: Cell,
        search_pool: SearchPool,  # noqa: ARG002 - of the plain plan
        sampled: SampledPool,
        left: IndexArray,
        rng: Generator,  # noqa: ARG002 - nothing is drawn
    ) -> Selection:
        """Return as many poses as the cell file asks for; see `best_additions`."""
        count = present(cell.file.search.poses, "search.poses")
        measured, beside = self.joint_position, self.beside
        found = best_additions(cell, sampled.pool.postures, measured, count, left, beside)
        return Selection(found.order, _SEARCH, {SHARE: found.share})


def postures_of(pool: PoolData) -> Postures:
    """Return the postures of a pool that was read."""
    return Postures(pool.T_base_tcp, pool.normal, pool.q, pool.q_approach, pool.point)


def best_additions(
    cell: Cell,
    postures: Postures,
    measured: FloatArray,
    count: int,
    left: IndexArray | None = None,
    beside: FloatArray | None = None,
) -> Additions:
    """Return the poses that add most to measured ones.

    Parameters
    ----------
    cell : Cell
        For load cases and production; without it the pool stands for it.
    postures : Postures
        The pool.
    measured : ndarray, shape (pose, joint)
        Measured postures in contact, in rad or m.
    count : int
        Number of poses to add.
    left : ndarray of int, shape (candidate,), optional
        Candidates that may be chosen; by default all.
    beside : ndarray, shape (pose, joint), optional
        Measured postures that each get the nearest candidate first.

    Raises
    ------
    PlanningError
        If the pool has fewer candidates that are no measured poses.
    """
    robot = cell.robot
    free = np.flatnonzero(_apart(robot, postures.q, measured).min(axis=1) > _SAME)
    free = free if left is None else np.intersect1d(free, left)
    if not 1 <= count <= len(free):
        raise PlanningError(
            f"{count} more poses are wanted, and the pool has {len(free)} that are not measured yet"
        )
    first: list[int] = []
    for lonely in measured[:0] if beside is None else beside:
        apart = _apart(robot, postures.q[free], lonely[None])[:, 0]
        first.append(int(free[np.where(apart < _NEIGHBOUR, np.inf, apart).argmin()]))
    first = list(dict.fromkeys(first))[:count]
    near = np.setdiff1d(_near_production(cell, postures.q, free, count), first)
    some = np.concatenate([np.array(first, dtype=np.intp), near])
    information = _information(cell, postures, some, measured)
    criterion = CRITERIA["i"].of(information)
    before = np.arange(len(some), len(information))
    chosen, values = before, [criterion.value(information.matrix(before))]
    for number in range(count):
        best = number if number < len(first) else best_addition(information, criterion, chosen)
        chosen = np.append(chosen, best)
        values.append(criterion.value(information.matrix(chosen)))
    return Additions(some[chosen[len(before) :]], np.array(values[1:]) / values[0])


def _information(
    cell: Cell, postures: Postures, some: IndexArray, measured: FloatArray
) -> Information:
    """Return the information of some candidates, then of the measured postures."""
    T = cell.robot.forward(measured)
    before = Postures(T, -T[:, :3, 2], measured, measured, np.arange(len(measured)))
    both = Postures.joined((postures.take(some), before))
    _, model = judging_model(cell, postures)
    rows, process = pose_rows(cell, model, both), process_rows(cell, model)
    if process is None:
        process = rows[: len(some)].reshape(-1, rows.shape[2])
    return build_information(Candidates(both.contact, rows, process=process))


def _near_production(cell: Cell, q: FloatArray, free: IndexArray, count: int) -> IndexArray:
    """Return candidates near production, or of all where it is unknown or few are near it."""
    production, near = NearProduction.of(cell), free
    if production is not None:
        near = free[production.distance(q[free]) <= 1.0]
        near = near if len(near) >= max(_LEAST_NEAR, count) else free
    most = max(_MOST, count)
    return near[np.unique(np.linspace(0, len(near) - 1, most).astype(np.intp))]


def _apart(robot: Robot, q: FloatArray, others: FloatArray) -> FloatArray:
    """Return the largest distance over the joints, relative to the reach, shape (pose, other)."""
    gap = q[:, None] - others
    turns = np.array(robot.revolute)
    gap[..., turns] -= np.round(gap[..., turns] / (2.0 * np.pi)) * 2.0 * np.pi
    return np.asarray(np.max(np.abs(gap) / posture_reach(robot), axis=2))
