"""From points on the surface to postures of the robot that pass every check.

At each point the tool presses along the inward normal and may be turned freely about it. Every
turn has up to eight configurations of the arm. Those that pass the quick checks are ranked by
their smallest margin; the slow checks (collision, line of sight) are asked only of the best ones,
round by round, until a point has a posture or has run out of them.

Configurations are chosen branch by branch, the branch that serves most points first, so that
neighbours share one and the arm need not flip between them.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.errors import PlanningError
from elastocal.planning.checks import Check, Verdicts, verdicts
from elastocal.planning.postures import Postures
from elastocal.planning.surface import contact_frames
from elastocal.robot.inverse import InverseKinematics

UNREACHABLE = "reach"
"""Name under which points that no configuration reaches are counted."""

_ROUNDS = 6
"""Postures of a point that the slow checks are asked about, at most."""

Progress = Callable[[str, int, int], None]
"""Called with a stage, how many points are done and how many there are."""


@dataclass(frozen=True)
class Approach:
    """How the tool comes to the surface."""

    distance: float
    """Distance of the approach pose from the surface along the normal, in m."""
    spins: int = 8
    """Number of turns of the tool about its axis that are tried."""
    external: tuple[float, ...] = ()
    """Positions of the external axes, in rad or m."""


@dataclass(frozen=True, eq=False)
class Pool:
    """Candidates with a posture each, and why the others have none."""

    postures: Postures
    """One posture for each point that has one."""
    branch: IndexArray
    """Inverse kinematics branch of each posture, shape (posture,)."""
    verdicts: Verdicts
    """Margins of the postures under every check."""
    refused: dict[str, int]
    """How many points each check left without a posture, `UNREACHABLE` among them."""
    sampled: int
    """Number of points that were tried."""

    @property
    def bottleneck(self) -> str | None:
        """The check that left most points without a posture; None when none did."""
        worst = max(self.refused, key=lambda name: self.refused[name], default=None)
        return worst if worst is not None and self.refused[worst] else None


@dataclass(frozen=True, eq=False)
class _Options:
    """Every spin and branch at every point, flat."""

    postures: Postures
    branch: IndexArray

    @property
    def point(self) -> IndexArray:
        return self.postures.point


def make_pool(
    solver: InverseKinematics,
    points: FloatArray,
    normals: FloatArray,
    approach: Approach,
    quick: Sequence[Check],
    slow: Sequence[Check] = (),
    progress: Progress = lambda *_: None,
) -> Pool:
    """Return a posture for every point that has one which passes every check.

    Parameters
    ----------
    solver : InverseKinematics
        Of the robot with its tool.
    points, normals : ndarray, shape (point, 3)
        Contact points in base, in m, and outward unit normals.
    approach : Approach
        How the tool comes to the surface.
    quick, slow : sequence of Check
        Checks asked of every posture, and of the promising ones only.
    progress : callable, optional
        Told of each stage.

    Raises
    ------
    PlanningError
        If there is no point.
    """
    if not len(points):
        raise PlanningError("the surface has no candidate points: is its region empty?")
    options = _options(solver, points, normals, approach)
    progress("inverse kinematics", len(points), len(points))
    fast = verdicts(quick, options.postures)
    passed = fast.passed
    order = _preference(options, passed, fast.margin, len(points))
    asked = _ask_slow_checks(options, order, slow, len(points), progress)
    both = Verdicts(
        (*fast.names, *asked.verdicts.names),
        (*fast.units, *asked.verdicts.units),
        (*fast.advice, *asked.verdicts.advice),
        np.vstack([fast.margin[:, asked.chosen], asked.verdicts.margin]),
    )
    return Pool(
        options.postures.take(asked.chosen),
        options.branch[asked.chosen],
        both,
        _refused(options, fast, asked.chosen, slow, len(points)),
        len(points),
    )


def _options(
    solver: InverseKinematics, points: FloatArray, normals: FloatArray, approach: Approach
) -> _Options:
    """Return all configurations that reach contact and approach pose in one branch."""
    parts: list[tuple[FloatArray, FloatArray, FloatArray, FloatArray, IndexArray, IndexArray]] = []
    spins = 2.0 * np.pi * np.arange(approach.spins) / approach.spins
    for contact in np.moveaxis(contact_frames(points, normals, spins), 1, 0):
        off = contact.copy()
        off[:, :3, 3] += approach.distance * normals
        here, there = (solver.solve_many(frames, approach.external).q for frames in (contact, off))
        reached = np.isfinite(here).all(axis=2) & np.isfinite(there).all(axis=2)
        point, branch = np.nonzero(reached)
        parts.append((contact[point], normals[point], here[reached], there[reached], point, branch))
    frames, outward, q, q_approach, point, branch = (
        np.concatenate(column) for column in zip(*parts, strict=True)
    )
    return _Options(Postures(frames, outward, q, q_approach, point), branch)


def _preference(
    options: _Options, passed: BoolArray, margin: FloatArray, points: int
) -> list[IndexArray]:
    """Return each point's postures that pass the quick checks, the preferred first.

    Branches are ranked by the number of points they serve that no better branch serves; within
    a branch the posture with the largest smallest margin comes first.
    """
    quality = np.zeros(len(passed))
    if margin.size:
        typical = np.median(np.abs(margin), axis=1, keepdims=True)
        quality = (margin / np.where(typical > 0.0, typical, 1.0)).min(axis=0)
    rank_of = _branch_ranks(options, passed)
    rank = rank_of[options.branch] if len(rank_of) else options.branch
    index = np.flatnonzero(passed)
    order = index[np.lexsort((-quality[index], rank[index], options.point[index]))]
    starts = np.searchsorted(options.point[order], np.arange(points + 1))
    return [order[a:b] for a, b in pairwise(starts)]


def _branch_ranks(options: _Options, passed: BoolArray) -> IndexArray:
    """Return the rank of each branch by greedy set cover of the points."""
    if not np.any(passed):
        return np.zeros(0, dtype=np.intp)
    count = int(options.branch.max()) + 1
    serves = [set(options.point[passed & (options.branch == b)].tolist()) for b in range(count)]
    ranks, covered = np.zeros(count, dtype=np.intp), set[int]()
    left = list(range(count))
    for rank in range(count):
        best = max(left, key=lambda b: (len(serves[b] - covered), -b))
        ranks[best] = rank
        covered |= serves[best]
        left.remove(best)
    return ranks


@dataclass(frozen=True, eq=False)
class _Asked:
    """The postures that the slow checks let pass."""

    chosen: IndexArray
    verdicts: Verdicts


def _ask_slow_checks(
    options: _Options,
    order: list[IndexArray],
    slow: Sequence[Check],
    points: int,
    progress: Progress,
) -> _Asked:
    """Return the posture of each point that has one, asking the slow checks round by round."""
    chosen = np.full(points, -1, dtype=np.intp)
    margin = np.zeros((len(slow), points))
    waiting = np.array([p for p in range(points) if len(order[p])], dtype=np.intp)
    for attempt in range(_ROUNDS):
        waiting = waiting[[len(order[p]) > attempt for p in waiting]]
        if not len(waiting):
            break
        index = np.array([order[p][attempt] for p in waiting], dtype=np.intp)
        found = verdicts(slow, options.postures.take(index))
        good = found.passed
        chosen[waiting[good]] = index[good]
        margin[:, waiting[good]] = found.margin[:, good]
        waiting = waiting[~good]
        progress("collision and sight", int(np.count_nonzero(chosen >= 0)), points)
    has = chosen >= 0
    names = verdicts(slow, options.postures.take([]))
    return _Asked(chosen[has], Verdicts(names.names, names.units, names.advice, margin[:, has]))


def _refused(
    options: _Options, fast: Verdicts, chosen: IndexArray, slow: Sequence[Check], points: int
) -> dict[str, int]:
    """Count the points without a posture by the check that came nearest to letting them pass.

    A point's postures each fail some checks; the point is counted for the check that its best
    posture, the one with the fewest failures, fails. Unreached points count as `UNREACHABLE`.
    """
    has = np.zeros(points, dtype=bool)
    has[options.point[chosen]] = True
    reached = np.zeros(points, dtype=bool)
    reached[options.point] = True
    refused = {UNREACHABLE: int(np.count_nonzero(~reached))}
    fails = ~(fast.margin > 0.0)
    failures = fails.sum(axis=0) if len(fails) else np.zeros(len(options.point), dtype=int)
    counts = dict.fromkeys([*fast.names, *(check.name for check in slow)], 0)
    open_points = np.flatnonzero(reached & ~has)
    best = _best_of_points(options.point, failures, points)
    nearly = [p for p in open_points if failures[best[p]] == 0]
    for p in open_points:
        if failures[best[p]]:
            counts[fast.names[int(np.flatnonzero(fails[:, best[p]])[0])]] += 1
    if nearly and slow:
        late = verdicts(slow, options.postures.take(best[nearly]))
        for column in range(len(nearly)):
            failed = np.flatnonzero(~(late.margin[:, column] > 0.0))
            counts[late.names[int(failed[0])] if len(failed) else late.names[0]] += 1
    return refused | counts


def _best_of_points(point: IndexArray, failures: IndexArray, points: int) -> IndexArray:
    """Return the option with the fewest failures at each point; 0 where there is none."""
    order = np.lexsort((failures, point))
    best = np.zeros(points, dtype=np.intp)
    first = np.unique(point[order], return_index=True)
    best[first[0]] = order[first[1]]
    return best
