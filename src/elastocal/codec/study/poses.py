"""Poses of a study: one pool made once, verification poses set aside, the rest to choose from."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import Cell
from elastocal.codec.study.conditions import Condition
from elastocal.codec.variants import training_cases
from elastocal.errors import CodecError, present
from elastocal.planning import SearchPool, cell_surface, sample_pool
from elastocal.planning.checks import SightCheck
from elastocal.planning.search import Candidates, RandomChoice, technique
from elastocal.results import brief_repr


@brief_repr
@dataclass(frozen=True, eq=False)
class StudyPool:
    """Valid poses of a cell; numbers of poses count in them. Can be sent to another process."""

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


@dataclass(frozen=True, eq=False)
class StudyPoses:
    """The pool, and what a search may know of it."""

    pool: StudyPool
    candidates: Candidates
    """Candidates of ``pool.training``."""


@brief_repr
@dataclass(frozen=True, eq=False)
class PoseChoice:
    """Calibration poses of a condition."""

    order: IndexArray | None
    """Poses in the order of choice; None: every sample draws its own."""
    pool: IndexArray
    """Poses that samples draw from."""
    count: int

    def of(self, rng: Generator) -> IndexArray:
        """Return the poses of a sample."""
        if self.order is not None:
            return self.order
        return rng.permutation(self.pool)[: self.count]


def study_poses(cell: Cell, verification: int, jobs: int | None) -> StudyPoses:
    """Return the pool of a cell, made as `elastocal plan` makes it.

    Parameters
    ----------
    cell : Cell
        With tracker and marker; poses are drawn from its ``search.seed``.
    verification : int
        Number of verification poses.
    jobs : int, optional
        Processes.

    Raises
    ------
    CodecError
        If there are not more valid poses than verification poses.
    PlanningError, SurfaceError, FileAccessError
        If there is no pool.
    """
    for_points, for_verification = np.random.default_rng(cell.file.search.seed).spawn(2)
    surface = cell_surface(cell)
    gathered = sample_pool(cell, surface, for_points, jobs)
    postures = gathered.pool.postures
    if not 1 <= verification < len(postures):
        raise CodecError(
            f"{verification} verification poses: must be at least 1, and fewer than the"
            f" {len(postures)} valid poses of the pool"
        )
    aside = np.sort(for_verification.choice(len(postures), verification, replace=False))
    left = np.setdiff1d(np.arange(len(postures)), aside)
    check = present(SightCheck.of(cell, surface), "tracker of the cell")
    places = {each.name: each.position_base for each in cell.file.trackers}
    station = np.array([places[str(name)] for name in check.seen_by(postures)])
    pool = StudyPool(postures.q, postures.normal, station, left, aside)
    return StudyPoses(pool, SearchPool.of(cell, surface, gathered).candidates.take(left))


def choose_poses(
    cell: Cell, poses: StudyPoses, conditions: Sequence[Condition]
) -> tuple[PoseChoice, ...]:
    """Return the calibration poses of every condition.

    A technique has the same information for every arm, so it chooses once, as a plan does. Only
    ``random`` chooses again for every sample, since one draw would not characterise it.

    Raises
    ------
    CodecError
        If a condition wants more poses than there are.
    """
    known: dict[tuple[int, str, str], PoseChoice] = {}
    for each in conditions:
        if not each.poses <= len(poses.candidates):
            raise CodecError(
                f"poses={each.poses}: the pool has {len(poses.candidates)} valid poses to choose"
                f" from, beside {len(poses.pool.verification)} verification poses"
            )
        key = (each.poses, each.search, each.load_cases)
        known[key] = known.get(key) or _choice(cell, poses, each)
    return tuple(known[each.poses, each.search, each.load_cases] for each in conditions)


def _choice(cell: Cell, poses: StudyPoses, condition: Condition) -> PoseChoice:
    wanted, training = technique(condition.search), poses.pool.training
    if isinstance(wanted, RandomChoice):
        return PoseChoice(None, training, condition.poses)
    candidates = _under(cell, poses.candidates, condition.load_cases)
    rng = np.random.default_rng(cell.file.search.seed)
    order = wanted.search(candidates, condition.poses, rng).order
    return PoseChoice(training[order], training, condition.poses)


def _under(cell: Cell, candidates: Candidates, load_cases: str) -> Candidates:
    """Return candidates that are observed under some load cases."""
    rows, known = candidates.observation, cell.file.load_cases.cases
    rows = present(rows, "observation of the candidates")
    # Without a process the whole pool under all loads represents it.
    process = rows.reshape(-1, rows.shape[2]) if candidates.process is None else candidates.process
    loads = [known.index(case) for case in training_cases(load_cases, known)]
    observed = rows.reshape(len(rows), len(known), 3, -1)[:, loads].reshape(
        len(rows), -1, rows.shape[2]
    )
    return Candidates(candidates.contact, observed, candidates.distance, process)
