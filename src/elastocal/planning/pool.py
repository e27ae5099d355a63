"""From points on the surface to postures of the robot that pass every check.

At each point the tool presses along the inward normal and may have any rotation about it. Each
rotation has up to eight configurations of the arm, one for each branch of the inverse kinematics.
Branches are tried one after another, the one that serves most points first, so that neighbours
share a configuration and the arm need not flip between them; likewise the positions of the external
axes.

Checks run in the order of their cost. Those of the point alone (edge, flatness) precede all
postures; quick checks are made for every posture of a branch; the slow one (collision) only for the
best, round by round, until a point has a posture or its branch has no more.

Points are sampled until the requested number of candidates is valid. They are processed in parts,
on all cores. The parts do not depend on the number of cores, so neither do the candidates. `CHECKS`
and `POINT_CHECKS` list the checks.

A calibration holds where it was made (paper 3.1, 4.1: the "spectrum of action in production"). So
the pool of a cell that names its process is searched there: at the positions of the external axes
in production, with the tool rotated as at the nearest row; and of all postures at a point the one
whose farthest joint is nearest to a posture of production is taken.
"""

import math
import pickle
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from itertools import pairwise
from typing import Self

import numpy as np
from numpy.random import Generator
from scipy.spatial import cKDTree

from elastocal import plugins
from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.cell import Cell
from elastocal.errors import PlanningError
from elastocal.identification import posture_reach
from elastocal.parallel import process_count, process_pool
from elastocal.planning import checks as exported
from elastocal.planning.checks import (
    Checks,
    CollisionCheck,
    EdgeCheck,
    Margins,
    PointCheck,
    PostureCheck,
    check_margins,
)
from elastocal.planning.postures import Postures
from elastocal.planning.surface import (
    Surface,
    SurfacePoints,
    arm_reach,
    contact_frames,
    first_joint_positions,
    sample_blue_noise,
    sample_uniform,
)
from elastocal.progress import Progress, silent
from elastocal.results import brief_repr
from elastocal.robot.inverse import InverseKinematics, inverse_for
from elastocal.wording import phrase, sentences

_APART = (0.2, float(np.radians(10.0)))
"""Distance between places of the external axes that are tried, in m and rad."""
_MOST_PLACES = 12
"""Places that are tried, those where most rows are."""


@brief_repr
@dataclass(frozen=True, eq=False)
class ProductionPlace:
    """A place of the external axes at which production runs."""

    external: tuple[float, ...]
    """In rad or m."""
    position: FloatArray
    """Tool centre points of its rows in base, shape (row, 3), in m."""
    forward: FloatArray
    """x axis of the tool in its rows, in base, shape (row, 3)."""

    def spins(self, points: FloatArray, normals: FloatArray, count: int) -> FloatArray:
        """Return turns of the tool to try at points, production's first, (point, spin), in rad.

        Parameters
        ----------
        points, normals : ndarray, shape (point, 3)
            Contact points in base, in m, and outward unit normals.
        count : int
            How many.
        """
        _, row = cKDTree(self.position).query(points)
        T = contact_frames(points, normals, np.zeros(1))[:, 0]
        x, y = (np.einsum("pi,pi->p", T[:, :3, k], self.forward[row]) for k in (0, 1))
        own: FloatArray = np.arctan2(y, x)[:, None]
        return own + 2.0 * np.pi * np.arange(count) / count


@brief_repr
@dataclass(frozen=True, eq=False)
class NearProduction:
    """The postures of production, to measure how near others are."""

    places: tuple[ProductionPlace, ...]
    reach: FloatArray
    """Distance that counts as 1 in each joint, shape (joint,), in rad or m; infinite: none does."""
    revolute: tuple[bool, ...]
    q: FloatArray
    """Postures of production, shape (row, joint), in rad or m."""

    @classmethod
    def of(cls, cell: Cell) -> Self | None:
        """Return the postures of a cell's production; None when it names none."""
        process, robot = cell.process, cell.robot
        if process is None:
            return None
        T = robot.forward(process.joint_position)
        external = process.joint_position[:, : robot.external_axes]
        apart = np.where(robot.revolute[: robot.external_axes], _APART[1], _APART[0])
        cells = np.round(external / apart).astype(int)
        _, which, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
        places = []
        for number in np.argsort(-counts, kind="stable")[:_MOST_PLACES]:
            rows = np.flatnonzero(which.reshape(-1) == number)
            # Position of one row, since the mean of several may be one where production never is.
            stand = external[rows[len(rows) // 2]]
            places.append(ProductionPlace(tuple(stand.tolist()), T[rows, :3, 3], T[rows, :3, 0]))
        return cls(tuple(places), posture_reach(robot), robot.revolute, process.joint_position)

    def distance(self, q: FloatArray) -> FloatArray:
        """Return the distance of postures from the nearest of production, shape (posture,).

        It is the largest distance of a joint relative to `reach`: up to 1, the posture covers a
        row.
        """
        judged = np.isfinite(self.reach)
        scale = self.reach[judged]
        # Angles are periodic: the tree is given the period of each coordinate.
        turn = np.where(np.array(self.revolute)[judged], 2.0 * np.pi / scale, 0.0)

        def scaled(joints: FloatArray) -> FloatArray:
            parts = joints[:, judged] / scale
            turned = np.mod(parts, np.where(turn > 0.0, turn, np.inf))
            return np.where(turn > 0.0, np.minimum(turned, np.nextafter(turn, 0.0)), parts)

        tree = cKDTree(scaled(self.q), boxsize=turn)
        found, _ = tree.query(scaled(q), p=np.inf)
        return np.asarray(found, dtype=float)


UNREACHABLE = "reach"
"""Name under which points that no configuration reaches are counted."""
REACH_ADVICE = phrase(
    "bring the tooling within the robot's reach, turn it towards the robot, or let the external"
    " axes be searched"
)
"""Advice to a user when most points are out of reach."""

_NEAREST = 24
"""Largest number of postures of a point that are tried, those nearest to production."""
_ROUNDS = 6
"""Largest number of postures of a point and branch for the slow checks."""


@brief_repr
@dataclass(frozen=True)
class BasePlacement:
    """A position of the external axes, and the branches to try there, the best first."""

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
    """Number in `refusals` of the check that left each sampled point without a posture, or -1 where
    it has one, shape (point,)."""
    reasons: Mapping[str, str] = field(default_factory=dict)
    """What is in the way, by the name in `refusals`, where more is known than its advice."""

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
        """Number of points that each check left without a posture, `UNREACHABLE` included.

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
        """Checks that left points without a posture, the commonest first."""
        refused = self.refused
        ranked = sorted(refused, key=lambda name: -refused[name])
        return tuple(name for name in ranked if refused[name])

    @property
    def advice(self) -> str:
        """Advice on the two commonest refusals, each with its name; empty when there is none.

        Two are given because the commonest is often harmless (the edge), and because a point that
        several checks refuse counts for one of them only.
        """
        texts = dict(zip(self.refusals, (REACH_ADVICE, *self.margins.advice), strict=True))
        named = [
            (name, *([self.reasons[name]] if name in self.reasons else []), texts[name])
            for name in self.commonest_refusals[:2]
        ]
        return sentences([sentences(each, ": ") for each in named], "; ")

    def first(self, count: int) -> "Pool":
        """Return the pool without the postures beyond the first ``count`` ones.

        Points that lose their posture are removed with the points after them, so that the numbers
        still give the share of refused points.
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
    """Postures found so far, and points still without one, during the making of a pool."""

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
        """Give every open point the best of its options that passes all checks.

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

    The inverse kinematics gives one posture for each branch: where joint 4 or 6 may also be a whole
    turn away within its limits, only the position nearest to zero is tried. A pose whose cables
    need the other turn is not found.
    """

    inverse: InverseKinematics
    """Inverse kinematics of the robot with its tool."""
    checks: Checks
    """Checks of a posture."""
    approach: float
    """Distance of the approach pose from the surface along the normal, in m."""
    spins: int = 8
    """Number of turns of the tool about its axis that are tried."""
    production: NearProduction | None = None
    """Production postures: those near to them are preferred. None: those with large margins."""

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
            here = self.inverse.solve_many(contact, external).q
            there = self.inverse.beside(off, here, external)
            # NaN where there is no solution. Half a turn: axes 4 and 6 may be given a turn apart.
            reached = np.abs(there - here).max(axis=2) < np.pi
            point, branch = np.nonzero(reached)
            q, q_approach = here[reached], there[reached]
            parts.append(Postures(contact[point], normals[point], q, q_approach, point))
            branches.append(branch)
        return Options(Postures.joined(parts), np.concatenate(branches))


def join_pools(pools: Sequence[Pool]) -> Pool:
    """Return one pool from several for consecutive parts of the points."""
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


CANDIDATES = "candidates"
"""Stage under which progress is reported."""
_PART = 800
"""Points that are tried at once: bounds memory, and is what progress counts in."""
_PROBES = 32
"""Points by which base placements are ranked."""
_PARALLEL_FROM = 8000
"""Candidates from which on other processes are started: it takes them seconds to get ready."""
_POINTS_PER_CANDIDATE = 20
"""Points that are tried for each candidate wanted, at most."""
_MOST_IN_VAIN = 1000
"""Points without a single candidate after which no more are tried."""
_OVERSAMPLING = 1.03
"""Points that are sampled for each that should turn out to be missing."""
_LOOKED_AT = 24
"""Refused points by which it is said what is in the way."""
_LEAST_GAIN = 0.02
"""Share of the points that a further base placement must serve alone."""
_EXPORTED = tuple(getattr(exported, name) for name in dir(exported))

CHECKS = plugins.Registry[type[PostureCheck]](
    "check",
    {each.name: each for each in _EXPORTED if PostureCheck in getattr(each, "__mro__", ())[1:]},
    PlanningError,
)
"""Every check of postures that `elastocal.planning.checks` exports, and those of other packages."""
POINT_CHECKS: tuple[type[PointCheck], ...] = tuple(
    sorted(
        (each for each in _EXPORTED if PointCheck in getattr(each, "__mro__", ())[1:]),
        key=lambda each: each.order,
    )
)
"""Every check that a sampled point decides alone, in order."""


def point_checks(cell: Cell, surface: Surface, points: SurfacePoints) -> tuple[PointCheck, ...]:
    """Return the checks that sampled points decide alone.

    Parameters
    ----------
    cell, surface : Cell, Surface
        Who presses, and on what.
    points : SurfacePoints
        The sampled points that postures refer to.
    """
    return tuple(kind.of(cell, surface, points) for kind in POINT_CHECKS)


def robot_checks(cell: Cell, surface: Surface) -> Checks:
    """Return the checks that postures decide, in their order.

    Those are elastocal's that the cell has numbers for, and those of other packages that the cell
    file names.
    """
    kinds = {name: CHECKS[name] for name in (*CHECKS.own, *(cell.file.limits.checks or ()))}
    found = (
        plugins.used("check", name, partial(kind.of, cell, surface))
        for name, kind in sorted(kinds.items(), key=lambda each: each[1].order)
    )
    made = [check for check in found if check is not None]
    quick = tuple(check for check in made if not check.slow)
    return Checks((), quick, tuple(check for check in made if check.slow))


@brief_repr
@dataclass(frozen=True, eq=False)
class SampledPool:
    """A pool with the points that it was made of."""

    points: SurfacePoints
    """Every point that was tried; ``pool.postures.point`` counts in them."""
    pool: Pool


def sample_pool(
    cell: Cell,
    surface: Surface,
    rng: Generator,
    jobs: int | None = None,
    progress: Progress = silent,
) -> SampledPool:
    """Return as many valid candidates as the cell file asks for, or as there are.

    Parameters
    ----------
    cell, surface : Cell, Surface
        Who presses, and on what.
    rng : Generator
        Seeded source of randomness.
    jobs : int, optional
        Number of processes; all cores by default. Small pools are made by one. The result does
        not depend on it.
    progress : callable, optional
        Hears how many candidates are valid, and how many are wanted.

    Raises
    ------
    PlanningError
        If ``jobs`` is below 1.
    SurfaceError
        If the region holds no part of the surface.
    """
    wanted = cell.file.search.pool
    tried: list[SurfacePoints] = []
    pools: list[Pool] = []
    progress(CANDIDATES, 0, wanted)
    with _workers(cell, surface, _processes(jobs, wanted)) as make_in_processes:
        builder = PoolBuilder.of(cell, surface)
        placements = builder.rank(sample_uniform(surface, _PROBES, rng))
        while (missing := wanted - _valid(pools)) > 0 and not _hopeless(pools, wanted):
            tried.append(_sample(cell, surface, missing, pools, rng))
            parts = _parts(tried[-1])
            if make_in_processes and len(parts) > 1:
                made = make_in_processes(placements, parts)
            else:
                made = (builder.pool(placements, part) for part in parts)
            for pool in made:
                pools.append(pool)
                progress(CANDIDATES, min(_valid(pools), wanted), wanted)
    pool = join_pools(pools).first(wanted)
    points = SurfacePoints.joined(tried).take(np.arange(pool.sampled))
    if len(pool.postures) < wanted:
        pool = replace(pool, reasons=builder.reasons(placements, points, pool))
    return SampledPool(points, pool)


def _valid(pools: Sequence[Pool]) -> int:
    return sum(len(pool.postures) for pool in pools)


def _hopeless(pools: Sequence[Pool], wanted: int) -> bool:
    """Return whether points have been tried, and more of them would not help."""
    sampled = sum(pool.sampled for pool in pools)
    in_vain = _valid(pools) == 0 and sampled >= _MOST_IN_VAIN
    return in_vain or sampled >= _POINTS_PER_CANDIDATE * wanted


def _sample(
    cell: Cell, surface: Surface, missing: int, pools: Sequence[Pool], rng: Generator
) -> SurfacePoints:
    """Return points of which about ``missing`` should become candidates, in no order."""
    if pools:
        share = max(
            _valid(pools) / sum(pool.sampled for pool in pools), 1.0 / _POINTS_PER_CANDIDATE
        )
    else:
        probe = sample_uniform(surface, 1000, rng)
        edge = EdgeCheck.of(cell, surface, probe)
        share = max(float(np.mean(edge.at_points > 0.0)), 1.0 / _POINTS_PER_CANDIDATE)
    count = math.ceil(missing / share * _OVERSAMPLING) + 4
    if cell.file.search.sampling == "uniform":
        return sample_uniform(surface, count, rng)
    points = sample_blue_noise(surface, count, rng)
    return points.take(rng.permutation(len(points)))


def _parts(points: SurfacePoints) -> list[SurfacePoints]:
    starts = range(0, len(points), _PART)
    return [points.take(np.arange(at, min(at + _PART, len(points)))) for at in starts]


@dataclass(frozen=True, eq=False)
class PoolBuilder:
    """Solver and checks of one cell; each process has its own."""

    cell: Cell
    surface: Surface
    solver: PostureSolver
    """Solver with the checks of the robot; those of points are made with the points."""

    @staticmethod
    def of(cell: Cell, surface: Surface) -> "PoolBuilder":
        """Return the builder of a cell's pool."""
        checks, approach = robot_checks(cell, surface), cell.file.engagement.approach_distance
        production = NearProduction.of(cell)
        solver = PostureSolver(inverse_for(cell.robot), checks, approach, production=production)
        return PoolBuilder(cell, surface, solver)

    def rank(self, probes: SurfacePoints) -> tuple[BasePlacement, ...]:
        """Return positions of the external axes, the best first, judged by some tens of points.

        If production is known, its positions are used without judgement.
        """
        if self.solver.production is not None:
            return tuple(BasePlacement(place.external) for place in self.solver.production.places)
        coarse = replace(self.solver, spins=self.solver.spins // 2)
        external = self.cell.external_positions
        return rank_base_placements(coarse, probes.position, probes.normal, external)

    def pool(self, placements: tuple[BasePlacement, ...], points: SurfacePoints) -> Pool:
        """Return the pool of some points."""
        of_points = point_checks(self.cell, self.surface, points)
        solver = replace(self.solver, checks=replace(self.solver.checks, point=of_points))
        return solver.pool(points.position, points.normal, placements)

    def reasons(
        self, placements: Sequence[BasePlacement], points: SurfacePoints, pool: Pool
    ) -> dict[str, str]:
        """Return how far refused points are out of reach, and what collides at them."""
        found = {}
        place = {name: pool.refused_by == n for n, name in enumerate(pool.refusals)}
        if place[UNREACHABLE].any():
            found[UNREACHABLE] = self._beyond_reach(points.position[place[UNREACHABLE]])
        for check in self.solver.checks.slow:
            refused = np.flatnonzero(place[check.name])[:_LOOKED_AT]
            postures = self._first_postures(placements, points.take(refused))
            if isinstance(check, CollisionCheck) and len(postures):
                found[check.name] = check.nearest(postures)
        return found

    def _beyond_reach(self, positions: FloatArray) -> str:
        first = first_joint_positions(self.cell.robot, self.cell.external_positions)
        away = np.linalg.norm(positions[:, None] - first, axis=2).min(axis=1)
        reach = arm_reach(self.cell.robot)
        figures = {"far": f"{away.max():.3g}", "reach": f"{reach:.3g}"}
        if away.max() > reach:
            return phrase(
                "up to {far} m from the first joint, and arm and tool stretched out are {reach} m",
                **figures,
            )
        return phrase(
            "at most {far} m from the first joint, of {reach} m that arm and tool stretched out"
            " have: the way in which the tool must point, or limits of joints, keep it off",
            **figures,
        )

    def _first_postures(
        self, placements: Sequence[BasePlacement], points: SurfacePoints
    ) -> Postures:
        """Return a posture for each of some points, one that passes the quick checks if any."""
        options = self.solver.options(points.position, points.normal, placements[0].external)
        passed = check_margins(self.solver.checks.quick, options.postures).passed
        order = np.lexsort((~passed, options.point))
        _, first = np.unique(options.point[order], return_index=True)
        return options.postures.take(order[first])


_PoolsOfParts = Callable[[tuple[BasePlacement, ...], Sequence[SurfacePoints]], Iterator[Pool]]


def _processes(jobs: int | None, wanted: int) -> int:
    """Return the number of processes for some candidates; few do not need a second one."""
    try:
        processes = process_count(jobs)
    except ValueError as error:
        raise PlanningError(str(error)) from error
    return processes if wanted >= _PARALLEL_FROM else 1


@contextmanager
def _workers(cell: Cell, surface: Surface, processes: int) -> Iterator[_PoolsOfParts | None]:
    """Yield what makes the pools of parts in processes, in their order; None with but one."""
    if processes == 1:
        yield None
        return
    # Coal's shapes cannot be sent to a process: each unpacks the cell and makes its own of it.
    packed = pickle.dumps((cell, surface))
    with process_pool(processes, partial(_builder, packed)) as workers:
        yield lambda placements, parts: workers.map(partial(_make_part, packed, placements), parts)


def _make_part(packed: bytes, placements: tuple[BasePlacement, ...], points: SurfacePoints) -> Pool:
    return _builder(packed).pool(placements, points)


@lru_cache(maxsize=1)
def _builder(packed: bytes) -> PoolBuilder:
    return PoolBuilder.of(*pickle.loads(packed))


@dataclass(frozen=True, eq=False)
class _Survey:
    """The use of one base placement for a few points."""

    placement: BasePlacement
    served: BoolArray
    """Points with a posture, shape (point,); after the quick checks only, until asked."""
    checks_passed: float
    """Mean over the points of the most checks that a posture passes; it separates placements that
    serve no point, so that the refusals at the best of them are reported."""
    quality: float
    """Mean over the points of the best posture's smallest margin, in units of its median."""
    asked: bool = False
    """Whether the slow checks have been asked."""

    def rank(self, left: BoolArray) -> tuple[int, float, float]:
        """Return the ranks, most important first, for points that no better placement serves."""
        return int(np.count_nonzero(self.served & left)), self.checks_passed, self.quality


def rank_base_placements(
    solver: PostureSolver, points: FloatArray, normals: FloatArray, external: FloatArray
) -> tuple[BasePlacement, ...]:
    """Return as few positions of the external axes as serve the surface, the best first.

    Greedy set cover over a few points: the placement that serves most points that no better one
    serves, as long as that is 2 % of them; among equals the one with the larger margins. Each
    comes with its branches of the inverse kinematics, ranked in the same way.

    Parameters
    ----------
    solver : PostureSolver
        Its checks of points are not asked.
    points, normals : ndarray, shape (point, 3)
        Some tens of contact points in base, in m, and outward unit normals.
    external : ndarray, shape (combination, external axis)
        Positions to choose from, in rad or m.

    Returns
    -------
    tuple of BasePlacement
        At least one, even when none serves any point.
    """
    solver = replace(solver, checks=replace(solver.checks, point=()))
    places = [tuple(map(float, position)) for position in external]
    surveys = [_survey(solver, points, normals, place) for place in places]
    chosen: list[BasePlacement] = []
    left = np.ones(len(points), dtype=bool)
    while surveys:
        best = max(surveys, key=lambda one: one.rank(left))
        if chosen and np.count_nonzero(best.served & left) < max(1.0, _LEAST_GAIN * len(points)):
            break
        surveys.remove(best)
        if not best.asked:
            pool = solver.pool(points, normals, (best.placement,))
            surveys.append(replace(best, served=pool.refused_by < 0, asked=True))
            continue
        chosen.append(best.placement)
        left &= ~best.served
    return tuple(chosen)


def _survey(
    solver: PostureSolver, points: FloatArray, normals: FloatArray, external: tuple[float, ...]
) -> _Survey:
    options = solver.options(points, normals, external)
    found = check_margins(solver.checks.quick, options.postures)
    served = np.zeros((solver.inverse.branches, len(points)), dtype=bool)
    served[options.branch[found.passed], options.point[found.passed]] = True
    best, nearest = np.zeros(len(points)), np.full(len(points), -1.0)
    np.maximum.at(nearest, options.point, (found.margin > 0.0).sum(axis=0))
    np.maximum.at(best, options.point, np.where(found.passed, found.quality, 0.0))
    placement = BasePlacement(external, tuple(_branch_order(served).tolist()))
    serves = np.asarray(served.any(axis=0))
    return _Survey(placement, serves, float(nearest.mean()), float(best.mean()))


def _branch_order(served: BoolArray) -> IndexArray:
    """Return the branches by greedy set cover of the points, shape (branch,)."""
    order: list[int] = []
    open_points = np.ones(served.shape[1], dtype=bool)
    while len(order) < len(served):
        gain = (served & open_points).sum(axis=1).astype(float)
        gain[order] = -1.0
        # Branches that add no point are ranked by how many they serve.
        best = int(np.lexsort((np.arange(len(gain)), -served.sum(axis=1), -gain))[0])
        order.append(best)
        open_points &= ~served[best]
    return np.array(order, dtype=np.intp)
