"""The pool of a cell: points are sampled until as many candidates are valid as were asked for.

Points are tried in parts, on all cores. Which part a point is in does not depend on the number of
cores, so neither do the candidates.
"""

import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from elastocal.cell import Cell
from elastocal.errors import PlanningError
from elastocal.planning.cell_checks import point_checks
from elastocal.planning.pool import Pool, Progress, Stand, joined
from elastocal.planning.surface import (
    Surface,
    SurfacePoints,
    sample_blue_noise,
    sample_uniform,
)
from elastocal.planning.workshop import Workers, Workshop, started

STAGE = "candidates"
"""Name of the stage that progress is told of."""
_PART = 800
"""Points that are tried at once: bounds memory, and is what progress counts in."""
_PROBES = 32
"""Points by which the stands are ranked."""
_WORTH_HELP = 8000
"""Candidates from which on other processes are started: it takes them seconds to get ready."""
_HARDEST = 20
"""Points that are tried for each candidate wanted, at most."""
_ENOUGH = 1000
"""Points without a single candidate after which no more are tried."""
_SPARE = 1.03
"""Points that are sampled for each that should turn out to be missing."""


@dataclass(frozen=True, eq=False)
class Gathered:
    """A pool with the points that it was made of."""

    points: SurfacePoints
    """Every point that was tried; ``pool.postures.point`` counts in them."""
    pool: Pool
    stands: tuple[Stand, ...]
    """Where the external axes stand, the first choice first."""


def gather(
    cell: Cell,
    surface: Surface,
    rng: Generator,
    jobs: int | None = None,
    progress: Progress = lambda *_: None,
) -> Gathered:
    """Return as many valid candidates as the cell file asks for, or as there are.

    Parameters
    ----------
    cell : Cell
        The cell.
    surface : Surface
        What the robot presses on.
    rng : Generator
        Seeded source of randomness.
    jobs : int, optional
        Number of processes; all cores by default. Small pools are made by one. The result does
        not depend on it.
    progress : callable, optional
        Told how many candidates are valid, and how many are wanted.

    Raises
    ------
    PlanningError
        If ``jobs`` is below 1.
    SurfaceError
        If the region holds no part of the surface.
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    jobs = (cores or 1) if jobs is None else jobs
    if not jobs >= 1:
        raise PlanningError(f"{jobs} jobs: must be at least 1")
    wanted = cell.file.search.pool
    tried: list[SurfacePoints] = []
    pools: list[Pool] = []
    progress(STAGE, 0, wanted)
    with started(cell, surface, jobs if wanted >= _WORTH_HELP else 1) as workers:
        workshop = Workshop.of(cell, surface)
        stands = workshop.rank(sample_uniform(surface, _PROBES, rng))
        while (missing := wanted - _valid(pools)) > 0 and not _hopeless(pools, wanted):
            tried.append(_sample(cell, surface, missing, pools, rng))
            for pool in _made(workshop, workers, stands, _parts(tried[-1])):
                pools.append(pool)
                progress(STAGE, min(_valid(pools), wanted), wanted)
    pool = joined(pools).first(wanted)
    return Gathered(SurfacePoints.joined(tried).take(np.arange(pool.sampled)), pool, stands)


def _made(
    workshop: Workshop,
    workers: Workers | None,
    stands: tuple[Stand, ...],
    parts: Sequence[SurfacePoints],
) -> Iterator[Pool]:
    """Return the pools of the parts, in their order."""
    if workers is None or len(parts) == 1:
        return (workshop.pool(stands, part) for part in parts)
    return workers.pools(stands, parts)


def _valid(pools: Sequence[Pool]) -> int:
    return sum(len(pool.postures) for pool in pools)


def _hopeless(pools: Sequence[Pool], wanted: int) -> bool:
    """Return whether points have been tried, and more of them would not help."""
    sampled = sum(pool.sampled for pool in pools)
    return sampled >= _HARDEST * wanted or (_valid(pools) == 0 and sampled >= _ENOUGH)


def _sample(
    cell: Cell, surface: Surface, missing: int, pools: Sequence[Pool], rng: Generator
) -> SurfacePoints:
    """Return points of which about ``missing`` should become candidates, in no order."""
    if pools:
        share = max(_valid(pools) / sum(pool.sampled for pool in pools), 1.0 / _HARDEST)
    else:
        probe = sample_uniform(surface, 1000, rng)
        edge = point_checks(cell, surface, probe)[0]
        share = max(float(np.mean(edge.at_points > 0.0)), 1.0 / _HARDEST)
    count = math.ceil(missing / share * _SPARE) + 4
    if cell.file.search.sampling == "uniform":
        return sample_uniform(surface, count, rng)
    points = sample_blue_noise(surface, count, rng)
    return points.take(rng.permutation(len(points)))


def _parts(points: SurfacePoints) -> list[SurfacePoints]:
    starts = range(0, len(points), _PART)
    return [points.take(np.arange(at, min(at + _PART, len(points)))) for at in starts]
