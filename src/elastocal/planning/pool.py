"""From points on the surface to postures of the robot that pass every check.

At each point the tool presses along the inward normal and may be turned freely about it. Every
turn has up to eight configurations of the arm, one a branch of the inverse kinematics. Branches
are asked one after the other, the one that serves most points first, so that neighbours share a
configuration and the arm need not flip between them; so are the positions of the external axes.

Checks are asked cheapest first. What a point alone decides (edge, flatness) is asked before any
robot is; the quick checks of every posture of a branch; the slow one (collision) only of the best,
round by round, until a point has a posture or its branch has run out of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.errors import PlanningError
from elastocal.planning.checks import Checks, Margins, check_margins
from elastocal.planning.near_production import NearProduction
from elastocal.planning.postures import Postures
from elastocal.planning.surface import contact_frames
from elastocal.results import brief_repr
from elastocal.robot.inverse import InverseKinematics
from elastocal.wording import phrase, sentences

UNREACHABLE = "reach"
"""Name under which points that no configuration reaches are counted."""
REACH_ADVICE = phrase(
    "bring the tooling within the robot's reach, turn it towards the robot, or let the external"
    " axes be searched"
)
"""Advice to a user when most points are out of reach."""

_NEAREST = 24
"""Postures of a point that are asked, at most, those nearest to production."""
_ROUNDS = 6
"""Postures of a point and branch that the slow checks are asked about, at most."""


@brief_repr
@dataclass(frozen=True)
class BasePlacement:
    """A position of the external axes, and the branches that are asked there, the best first."""

    external: tuple[float, ...] = ()
    """Positions of the external axes, in rad or m."""
    branches: tuple[int, ...] | None = None
    """Branches of the inverse kinematics; in their own order when not given."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Pool:
    """Candidates with a posture each, and why the other points have none."""

    postures: Postures
    """One posture for each point that has one; ``postures.point`` says which."""
    branch: IndexArray
    """Inverse kinematics branch of each posture, shape (posture,)."""
    margins: Margins
    """Margins of the postures under every check."""
    refused_by: IndexArray
    """For each sampled point the number in `refusals` of what left it without a posture, or -1
    where it has one, shape (point,)."""

    @property
    def sampled(self) -> int:
        """Number of points that were tried."""
        return len(self.refused_by)

    @property
    def refusals(self) -> tuple[str, ...]:
        """Names of all that may refuse a point: the reach of the robot, then every check."""
        return (UNREACHABLE, *self.margins.names)

    @property
    def refused(self) -> dict[str, int]:
        """How many points each check left without a posture, `UNREACHABLE` among them.

        A point is counted once, for the first check that its best posture fails: the one that
        fails fewest.
        """
        counts = np.bincount(self.refused_by + 1, minlength=len(self.refusals) + 1)[1:]
        return {name: int(count) for name, count in zip(self.refusals, counts, strict=True)}

    @property
    def bottleneck(self) -> str | None:
        """The check that left most points without a posture; None when none did."""
        refused = self.refused
        worst = max(refused, key=lambda name: refused[name])
        return worst if refused[worst] else None

    @property
    def commonest_refusals(self) -> tuple[str, ...]:
        """What left points without a posture, the commonest first."""
        refused = self.refused
        ranked = sorted(refused, key=lambda name: -refused[name])
        return tuple(name for name in ranked if refused[name])

    @property
    def advice(self) -> str:
        """Advice on the two commonest refusals, each with its name; empty when there is none.

        Two, as the commonest is often one that no-one minds (the edge), and as a point that
        several checks refuse counts for one of them alone.
        """
        texts = dict(zip(self.refusals, (REACH_ADVICE, *self.margins.advice), strict=True))
        return sentences(
            [sentences((name, texts[name]), ": ") for name in self.commonest_refusals[:2]], "; "
        )

    def first(self, count: int) -> "Pool":
        """Return the pool without the postures beyond the first ``count`` ones.

        The points that lose their posture leave the pool with the points behind them, so that
        the numbers still tell what share of the points was refused.
        """
        if len(self.postures) <= count:
            return self
        end = int(self.postures.point[count])
        return Pool(
            self.postures.take(np.arange(count)),
            self.branch[:count],
            self.margins.take(np.arange(count)),
            self.refused_by[:end],
        )


@brief_repr
@dataclass(frozen=True, eq=False)
class Options:
    """Every turn of the tool and branch of the arm that reaches its point, flat."""

    postures: Postures
    branch: IndexArray
    """Shape (option,)."""

    @property
    def point(self) -> IndexArray:
        """Point of each option, shape (option,)."""
        return self.postures.point

    def of(self, branch: int, is_waiting: BoolArray) -> "Options":
        """Return the options of a branch at points that still wait for one."""
        return self.take((self.branch == branch) & is_waiting[self.point])

    def take(self, index: BoolArray | IndexArray) -> "Options":
        """Return some of the options."""
        return Options(self.postures.take(index), self.branch[index])


class _PoolSearch:
    """The postures found so far, and the points that wait for one, while a pool is made."""

    def __init__(self, checks: Checks, points: int) -> None:
        self.checks = checks
        self.parts: list[tuple[Options, FloatArray]] = []
        self.is_waiting = np.ones(points, dtype=bool)
        self.failures = np.full(points, np.inf)
        self.refused_by = np.zeros(points, dtype=np.intp)

    @property
    def waiting(self) -> IndexArray:
        return np.flatnonzero(self.is_waiting)

    def refuse_points(self) -> None:
        """Refuse what no posture can mend."""
        for number, check in enumerate(self.checks.point, start=1):
            bad = self.is_waiting & ~(check.at_points > 0.0)
            self.refused_by[bad] = number
            self.is_waiting[bad] = False

    def ask(self, options: Options, distance: FloatArray | None = None) -> None:
        """Give every waiting point the best of its options that passes all checks.

        The best has the largest margins, or the least ``distance``, shape (option,), where given.
        """
        postures = options.postures
        quick = check_margins(self.checks.quick, postures)
        before = 1 + len(self.checks.point)
        self.refuse(postures, quick.margin, before, 1.0)
        passed = np.flatnonzero(quick.passed)
        rank = -quick.quality if distance is None else distance
        order = np.lexsort((rank[passed], postures.point[passed]))
        for index in _rounds(postures.point, passed[order]):
            asked = index[self.is_waiting[postures.point[index]]]
            if not len(asked):
                return
            slow = check_margins(self.checks.slow, postures.take(asked))
            # One slow check failed is nearer to a posture than one quick check.
            weight = 0.5 / (1 + len(self.checks.slow))
            self.refuse(postures.take(asked), slow.margin, before + len(self.checks.quick), weight)
            good = asked[slow.passed]
            margin = np.vstack([quick.margin[:, good], slow.margin[:, slow.passed]])
            self.accept(options.take(good), margin)

    def refuse(self, postures: Postures, margin: FloatArray, first: int, weight: float) -> None:
        """Remember, for each point, the check that its least bad posture fails."""
        if not len(margin):
            return
        fails = ~(margin > 0.0)
        failures = weight * fails.sum(axis=0)
        bad = np.flatnonzero(fails.any(axis=0))
        bad = bad[np.argsort(-failures[bad], kind="stable")]
        better = bad[failures[bad] < self.failures[postures.point[bad]]]
        # Of several postures of a point the last written counts: the one with fewest failures.
        self.failures[postures.point[better]] = failures[better]
        self.refused_by[postures.point[better]] = first + fails[:, better].argmax(axis=0)

    def accept(self, options: Options, margin: FloatArray) -> None:
        """Keep postures with their margins under the quick and the slow checks."""
        of_points = [check.margin(options.postures) for check in self.checks.point]
        self.parts.append((options, np.vstack([*of_points, margin])))
        self.is_waiting[options.point] = False
        self.refused_by[options.point] = -1

    def pool(self, joints: int) -> Pool:
        none = Postures.none(joints)
        postures = Postures.joined([none, *(part.postures for part, _ in self.parts)])
        nowhere = np.zeros(0, dtype=np.intp)
        branch = np.concatenate([nowhere, *(part.branch for part, _ in self.parts)])
        empty = check_margins(self.checks.all, none)
        margin = np.hstack([empty.margin, *(margin for _, margin in self.parts)])
        order = np.argsort(postures.point)
        found = replace(empty, margin=margin[:, order])
        return Pool(postures.take(order), branch[order], found, self.refused_by)


@dataclass(frozen=True, eq=False)
class PostureSolver:
    """Finds the postures that press on points of the surface and pass every check.

    Of each branch the inverse kinematics gives one posture: where joint 4 or 6 may stand a whole
    turn away as well, within its limits, only the position nearest to zero is tried. A pose whose
    cables would want the other turn is not found.
    """

    inverse: InverseKinematics
    """Of the robot with its tool."""
    checks: Checks
    """What a posture has to pass."""
    approach: float
    """Distance of the approach pose from the surface along the normal, in m."""
    spins: int = 8
    """Number of turns of the tool about its axis that are tried."""
    production: NearProduction | None = None
    """Where production runs: postures near to it come first. None: those with large margins."""

    def pool(
        self,
        points: FloatArray,
        normals: FloatArray,
        placements: Sequence[BasePlacement] = (BasePlacement(),),
    ) -> Pool:
        """Return a posture for every point that has one which passes every check.

        Parameters
        ----------
        points, normals : ndarray, shape (point, 3)
            Contact points in base, in m, and outward unit normals. The checks of points refer to
            these.
        placements : sequence of BasePlacement
            Where the external axes may carry the arm, in the order in which they are tried.

        Raises
        ------
        PlanningError
            If there is no point.
        """
        if not len(points):
            raise PlanningError("the surface has no candidate points: is its region empty?")
        found = _PoolSearch(self.checks, len(points))
        found.refuse_points()
        if self.production is not None:
            self._ask_nearest(found, points, normals, self.production)
            placements = ()
        for placement in placements:
            waiting = found.waiting
            if not len(waiting):
                break
            options = self.options(points[waiting], normals[waiting], placement.external)
            options = Options(options.postures.at(waiting[options.point]), options.branch)
            order = placement.branches
            for branch in range(self.inverse.branches) if order is None else order:
                found.ask(options.of(branch, found.is_waiting))
        return found.pool(len(self.inverse.robot.joint_names))

    def _ask_nearest(
        self,
        found: _PoolSearch,
        points: FloatArray,
        normals: FloatArray,
        production: NearProduction,
    ) -> None:
        """Ask the postures of every point that are nearest to those of production."""
        waiting = found.waiting
        if not len(waiting):
            return
        parts = [
            self.options(points[waiting], normals[waiting], place.external, spin)
            for place in production.places
            for spin in [place.spins(points[waiting], normals[waiting], self.spins)]
        ]
        postures = Postures.joined([part.postures for part in parts])
        options = Options(
            postures.at(waiting[postures.point]), np.concatenate([each.branch for each in parts])
        )
        distance = production.distance(options.postures.q)
        order = np.lexsort((distance, options.point))
        first = np.searchsorted(options.point[order], options.point[order])
        kept = order[np.arange(len(order)) - first < _NEAREST]
        found.ask(options.take(kept), distance[kept])

    def options(
        self,
        points: FloatArray,
        normals: FloatArray,
        external: tuple[float, ...],
        spins: FloatArray | None = None,
    ) -> Options:
        """Return all configurations that reach contact and approach pose in one branch.

        Parameters
        ----------
        points, normals : ndarray, shape (point, 3)
            As for `pool`.
        external : tuple of float
            Positions of the external axes, in rad or m.
        spins : ndarray, shape (point, spin), optional
            Turns of the tool that are tried at each point, in rad; by default even ones.
        """
        parts: list[Postures] = []
        branches: list[IndexArray] = []
        if spins is None:
            spins = 2.0 * np.pi * np.arange(self.spins) / self.spins
        for contact in np.moveaxis(contact_frames(points, normals, spins), 1, 0):
            off = contact.copy()
            off[:, :3, 3] += self.approach * normals
            here, there = (self.inverse.solve_many(T, external).q for T in (contact, off))
            # NaN where there is no solution. Half a turn: axes 4 and 6 may be given a turn apart.
            reached = np.abs(there - here).max(axis=2) < np.pi
            point, branch = np.nonzero(reached)
            q, q_approach = here[reached], there[reached]
            parts.append(Postures(contact[point], normals[point], q, q_approach, point))
            branches.append(branch)
        return Options(Postures.joined(parts), np.concatenate(branches))


def join_pools(pools: Sequence[Pool]) -> Pool:
    """Return one pool of several that were made of consecutive parts of the points."""
    starts = np.cumsum([0, *(pool.sampled for pool in pools)])
    postures = [
        pool.postures.at(pool.postures.point + start)
        for pool, start in zip(pools, starts[:-1], strict=True)
    ]
    return Pool(
        Postures.joined(postures),
        np.concatenate([pool.branch for pool in pools]),
        Margins.joined([pool.margins for pool in pools]),
        np.concatenate([pool.refused_by for pool in pools]),
    )


def _rounds(point: IndexArray, ordered: IndexArray) -> list[IndexArray]:
    """Return the first choice of every point, then the second, and so on."""
    where = point[ordered]
    starts = np.flatnonzero(np.diff(where, prepend=-1))
    place = np.arange(len(ordered))
    for a, b in pairwise([*starts, len(ordered)]):
        place[a:b] -= a
    return [ordered[place == turn] for turn in range(min(_ROUNDS, int(place.max(initial=-1)) + 1))]
