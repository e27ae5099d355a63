"""The pool of a cell: points are sampled until as many candidates are valid as were asked for.

Points are tried in parts, on all cores. Which part a point is in does not depend on the number of
cores, so neither do the candidates. `CHECKS` and `POINT_CHECKS` list what each must pass.
"""

import math
import pickle
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np
from numpy.random import Generator

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.cell import Cell
from elastocal.errors import PlanningError
from elastocal.parallel import process_count, process_pool
from elastocal.planning import checks as exported
from elastocal.planning.checks import Checks, EdgeCheck, PointCheck, PostureCheck, check_margins
from elastocal.planning.near_production import NearProduction
from elastocal.planning.pool import BasePlacement, Pool, PostureSolver, join_pools
from elastocal.planning.surface import Surface, SurfacePoints, sample_blue_noise, sample_uniform
from elastocal.progress import Progress, silent
from elastocal.results import brief_repr
from elastocal.robot.inverse import inverse_for

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
_LEAST_GAIN = 0.02
"""Share of the points that a further base placement must serve alone."""
_EXPORTED = tuple(getattr(exported, name) for name in dir(exported))

CHECKS: tuple[type[PostureCheck], ...] = tuple(
    sorted(
        (each for each in _EXPORTED if PostureCheck in getattr(each, "__mro__", ())[1:]),
        key=lambda each: each.order,
    )
)
"""Every check of postures that `elastocal.planning.checks` exports, in order."""
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
    """Return the checks that postures decide, of all `CHECKS` that the cell has numbers for."""
    made = [check for kind in CHECKS if (check := kind.of(cell, surface)) is not None]
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
    return SampledPool(SurfacePoints.joined(tried).take(np.arange(pool.sampled)), pool)


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
    """With the checks of the robot; those of points are made with the points."""

    @staticmethod
    def of(cell: Cell, surface: Surface) -> "PoolBuilder":
        """Return the builder of a cell's pool."""
        checks, approach = robot_checks(cell, surface), cell.file.engagement.approach_distance
        production = NearProduction.of(cell)
        solver = PostureSolver(inverse_for(cell.robot), checks, approach, production=production)
        return PoolBuilder(cell, surface, solver)

    def rank(self, probes: SurfacePoints) -> tuple[BasePlacement, ...]:
        """Return where the external axes should carry the arm, judged by some tens of points.

        Where production runs is known they stand as there, and nothing is judged.
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


_PoolsOfParts = Callable[[tuple[BasePlacement, ...], Sequence[SurfacePoints]], Iterator[Pool]]


def _processes(jobs: int | None, wanted: int) -> int:
    """Return the number of processes for some candidates; few are not worth a second one."""
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
    """Mean over the points of the most checks that a posture passes; tells placements that serve
    no point apart, so that what refuses the points at the best of them is what a user hears."""
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
