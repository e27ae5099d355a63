"""From a cell to a plan: surface, pool, search, visiting order (paper 2.2, 3.1)."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from elastocal.arrays import IndexArray
from elastocal.cell import Cell
from elastocal.errors import PlanningError
from elastocal.planning._plan_record import Decisions, plan_record, pool_data
from elastocal.planning.cell_setup import (
    cell_surface,
    collision_scene,
    sight_check,
    surface_findings,
    torque_check,
)
from elastocal.planning.motion import (
    Mover,
    Route,
    clear_retreats,
    mover_for,
    plan_route,
    require_free_home,
)
from elastocal.planning.plan_result import PlanResult, SpreadRecord
from elastocal.planning.pool_file import PoolData
from elastocal.planning.pool_sampling import SampledPool, sample_pool
from elastocal.planning.postures import Postures
from elastocal.planning.search import Cover, Selection, technique
from elastocal.planning.search_pool import SearchPool
from elastocal.planning.surface import Finding, Surface
from elastocal.progress import Progress, silent

_SURFACE, _SEARCH = "surface", "search"
"""Stages under which progress is reported, beside `CANDIDATES` and `VISITING`."""
_REPLACEMENTS = 10
"""Times that poses which no way leads to are replaced by others."""


@dataclass(frozen=True, eq=False)
class PlanAndPool:
    """A plan, the pool beside it, and the surface that it lies on."""

    plan: PlanResult
    pool: PoolData
    surface: Surface


def make_plan(
    cell: Cell, compare: str | None = None, jobs: int | None = None, progress: Progress = silent
) -> PlanAndPool:
    """Return the calibration poses of a cell, checked and in visiting order.

    Everything random is drawn from ``search.seed`` of the cell file: the same cell gives the same
    plan.

    Parameters
    ----------
    cell : Cell
        The cell.
    compare : str, optional
        Search technique that is to choose as many poses from the same pool, for comparison.
    jobs : int, optional
        Number of processes; all cores by default.
    progress : callable, optional
        Hears the stage (``surface``, ``candidates``, ``search``, ``visiting order``), what is done
        of it and how much there is.

    Raises
    ------
    PlanningError
        If no plan can be made: the message says what refused most points and what to move.
    SurfaceError, FileAccessError
        If the surface cannot be read, or its region is empty.
    """
    other = None if compare is None else technique(compare)
    require_possible_search(cell, compare)
    for_findings, for_points, for_search = np.random.default_rng(cell.file.search.seed).spawn(3)
    progress(_SURFACE, 0, 1)
    surface = cell_surface(cell)
    findings = surface_findings(cell, surface, for_findings)
    mover = mover_for(cell, collision_scene(cell, surface))
    require_free_home(cell.home, mover)
    progress(_SURFACE, 1, 1)
    sampled = sample_pool(cell, surface, for_points, jobs, progress)
    _require_enough(cell, sampled, findings)
    progress(_SEARCH, 0, 1)
    search_pool = SearchPool.of(cell, surface, sampled)
    selection, route = _choose(cell, search_pool, sampled, mover, for_search, progress)
    spread = search_pool.spread(selection.order)
    progress(_SEARCH, 1, 1)
    everyone = np.arange(len(search_pool.candidates))
    comparison = (
        None if other is None else search_pool.take(other, everyone, len(selection), for_search)
    )
    chosen = sampled.pool.postures.take(selection.order)
    decisions = Decisions(
        cell,
        sampled,
        search_pool,
        selection,
        spread,
        comparison,
        route,
        _stations(cell, surface, chosen),
        (*(finding.message for finding in findings), *_notes(cell, sampled, selection, spread)),
    )
    return PlanAndPool(plan_record(decisions), pool_data(decisions), surface)


def require_possible_search(cell: Cell, compare: str | None = None) -> None:
    """Require a search that can be made, as far as no pool is needed to tell.

    Parameters
    ----------
    cell : Cell
        The cell.
    compare : str, optional
        Search technique to lay beside the cell's own.

    Raises
    ------
    PlanningError
        If a technique is unknown, or needs a process that the cell does not name.
    """
    wanted = technique(cell.file.search.technique)
    for name in (wanted.name, compare):
        if name in ("i_optimal", "exchange-i") and cell.process is None:
            raise PlanningError(
                f"search technique {name!r} needs the production's poses and forces:"
                " name their file in process.file of the cell file"
            )


def _require_enough(cell: Cell, sampled: SampledPool, findings: tuple[Finding, ...]) -> None:
    """Require a pool that can give the poses wanted, or say what to move."""
    pool, wanted = sampled.pool, cell.file.search.poses or 1
    found = len(pool.postures)
    if found >= wanted:
        return
    refused = ", ".join(f"{name} {count}" for name, count in pool.refused.items() if count)
    odd = [f.message for f in findings if f.kind in ("tiny", "inverted")]
    why = "; ".join([*odd, pool.advice])
    short = f", and {wanted} poses are wanted (search.poses)" if wanted > 1 else ""
    raise PlanningError(
        f"{found} of {pool.sampled} points on the surface can be pressed on{short};"
        f" refused by {refused}: {why}"
    )


def _choose(
    cell: Cell,
    search_pool: SearchPool,
    sampled: SampledPool,
    mover: Mover,
    rng: Generator,
    progress: Progress,
) -> tuple[Selection, Route]:
    """Return poses that free ways lead to from HOME, and on to the surface; replace others."""
    left: IndexArray = np.arange(len(search_pool.candidates))
    for _ in range(_REPLACEMENTS):
        selection = search_pool.choose(cell, left, rng)
        postures = sampled.pool.postures.take(selection.order)
        route = plan_route(cell.home, postures, mover, progress)
        blocked = np.union1d(
            route.unreachable, np.flatnonzero(~clear_retreats(cell, mover, postures))
        )
        if not len(blocked):
            return selection, route
        left = np.setdiff1d(left, selection.order[blocked])
    raise PlanningError(
        f"no way without collision leads from HOME to {len(blocked)} of"
        f" {len(selection)} poses, and others in their place fared no better: move motion.home or"
        " the fixtures, or lengthen engagement.approach_distance"
    )


def _stations(cell: Cell, surface: Surface, chosen: Postures) -> tuple[str | None, ...]:
    """Return the tracker station of each pose."""
    check = sight_check(cell, surface)
    return (None,) * len(chosen) if check is None else tuple(check.seen_by(chosen))


def _notes(
    cell: Cell, sampled: SampledPool, selection: Selection, spread: SpreadRecord
) -> tuple[str, ...]:
    """Return what a user should know of how the poses were found, a line each."""
    search, pool = cell.file.search, sampled.pool
    notes: list[str] = []
    if len(pool.postures) < search.pool:
        notes.append(
            f"only {len(pool.postures)} of {search.pool} candidates were found among"
            f" {pool.sampled} points; most of the others were refused by {pool.bottleneck}:"
            f" {pool.advice}"
        )
    radius = spread.covering_radius
    if search.d_max is not None and not radius <= search.d_max:
        notes.append(
            f"d_max of {1e3 * search.d_max:.4g} mm was not reached: the worst-covered candidate is"
            f" {1e3 * radius:.4g} mm from the nearest of {len(selection)} poses"
        )
    if search.d_max is not None and not isinstance(technique(search.technique), Cover):
        notes.append(
            f"{selection.name} knows no d_max: it chose as many poses as cover needs for it"
        )
    notes.extend(f"assumed, {text}" for text in _assumptions(cell))
    judged = torque_check(cell).judged
    unknown = [name for name in cell.robot.joint_names if name not in judged]
    if unknown:
        notes.append(f"torques of {', '.join(unknown)} are not known and not judged")
    return tuple(notes)


def _assumptions(cell: Cell) -> list[str]:
    """Return what the robot's description assumes and the cell file does not replace."""
    given = set()
    if cell.file.limits.torque.values:
        given.add("effort")
    if cell.file.motion.speed:
        given.add("velocity")
    return [f"{a.field}: {a.reason}" for a in cell.robot.assumptions if a.field not in given]
