"""Poses of a study: one pool made once, verification poses set aside, the rest to choose from."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import Cell
from elastocal.codec.study import Condition
from elastocal.codec.variants import training_cases
from elastocal.errors import CodecError
from elastocal.planning.cell_checks import sight_check
from elastocal.planning.gathering import gather
from elastocal.planning.observation import elastic_model, pose_rows, process_rows
from elastocal.planning.postures import Postures
from elastocal.planning.search import Candidates, RandomChoice, technique
from elastocal.planning.tooling import cell_surface
from elastocal.sim.workcell.quick import Places


@dataclass(frozen=True, eq=False)
class StudyPool:
    """Valid poses of a cell; numbers of poses count in them."""

    q: FloatArray
    """Joints in contact, shape (pose, joint), in rad or m."""
    normal: FloatArray
    """Outward normals in base, shape (pose, 3)."""
    station: FloatArray
    """Tracker station that sees each pose, in base, shape (pose, 3), in m."""
    training: IndexArray
    """Poses that may be chosen, shape (n,)."""
    verification: IndexArray
    """Poses that may not, drawn evenly from the pool."""

    def __len__(self) -> int:
        return len(self.q)

    def places(self, poses: IndexArray) -> Places:
        """Return some poses as the simulator wants them."""
        return Places(self.q[poses], self.normal[poses])


@dataclass(frozen=True, eq=False)
class Chosen:
    """Calibration poses of a condition."""

    order: IndexArray | None
    """In the order of choice; None: every sample draws its own."""
    pool: IndexArray
    """What is drawn from."""
    count: int

    def of(self, rng: Generator) -> IndexArray:
        """Return the poses of a sample."""
        if self.order is not None:
            return self.order
        return rng.permutation(self.pool)[: self.count]


def study_pool(cell: Cell, verification: int, jobs: int | None) -> StudyPool:
    """Return the pool of a cell, as `elastocal plan` makes it.

    Raises
    ------
    CodecError
        If there are not more valid poses than verification poses.
    PlanningError, SurfaceError, FileAccessError
        If there is no pool.
    """
    rng = np.random.default_rng(cell.file.search.seed)
    surface = cell_surface(cell)
    for_points, for_verification = rng.spawn(2)
    postures = gather(cell, surface, for_points, jobs).pool.postures
    if not 1 <= verification < len(postures):
        raise CodecError(
            f"{verification} verification poses: must be from 1 to {len(postures) - 1}, fewer than"
            f" the {len(postures)} valid poses of the pool"
        )
    aside = np.sort(for_verification.choice(len(postures), verification, replace=False))
    left = np.setdiff1d(np.arange(len(postures)), aside)
    check = sight_check(cell, surface)
    assert check is not None  # a cell without tracker has been refused
    places = {each.name: each.position_base for each in cell.file.trackers}
    station = np.array([places[name] for name in check.seen_by(postures)])
    return StudyPool(postures.q, postures.normal, station, left, aside)


def choose(cell: Cell, pool: StudyPool, conditions: Sequence[Condition]) -> tuple[Chosen, ...]:
    """Return the calibration poses of every condition.

    What a technique knows is the same for every arm, so it chooses once, as a plan does. Only
    ``random`` chooses anew for every sample: one draw would say nothing about it.

    Raises
    ------
    CodecError
        If a condition wants more poses than there are.
    """
    for each in conditions:
        if not each.poses <= len(pool.training):
            raise CodecError(
                f"poses={each.poses}: the pool has {len(pool.training)} valid poses to choose from"
                f" beside {len(pool.verification)} verification poses"
            )
    known: dict[tuple[int, str, str], Chosen] = {}
    for each in conditions:
        key = (each.poses, each.search, each.load_cases)
        if key not in known:
            known[key] = _choice(cell, pool, each)
    return tuple(known[each.poses, each.search, each.load_cases] for each in conditions)


def _choice(cell: Cell, pool: StudyPool, condition: Condition) -> Chosen:
    wanted = technique(condition.search)
    if isinstance(wanted, RandomChoice):
        return Chosen(None, pool.training, condition.poses)
    candidates = _candidates(cell, pool, condition.load_cases)
    rng = np.random.default_rng(cell.file.search.seed)
    order = wanted.search(candidates, condition.poses, rng).order
    return Chosen(pool.training[order], pool.training, condition.poses)
