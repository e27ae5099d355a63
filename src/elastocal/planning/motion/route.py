"""The order in which poses are visited, and the moves between them."""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray, IndexArray
from elastocal.errors import PlanningError
from elastocal.planning.motion.mover import Mover
from elastocal.planning.motion.tour import Cuts, shortest_tour
from elastocal.planning.motion.ways import HOME, Ways
from elastocal.planning.pool import Progress
from elastocal.planning.postures import Postures

STAGE = "visiting order"
"""Under which progress is told."""


@dataclass(frozen=True, eq=False)
class Move:
    """One move between HOME and approach poses, straight in joint space from via to via."""

    start: int | None
    """Pose it leaves; None: HOME."""
    end: int | None
    """Pose it leads to; None: HOME."""
    via: FloatArray
    """Joint positions in between, at each of which the robot stops, shape (via, joint)."""
    duration: float
    """Estimated, in s."""


@dataclass(frozen=True, eq=False)
class Route:
    """A round from HOME through the poses and back; arrays are read-only."""

    order: IndexArray
    """Poses in visiting order, shape (visited,)."""
    moves: tuple[Move, ...]
    """From HOME through all poses and back: one more than visited poses; none without poses."""
    unreachable: IndexArray
    """Poses that no free way leads to, in ascending order: they are not visited."""
    shortest: bool
    """Whether it is proved that no other order of the same poses takes less time, of the ways
    that were tried."""

    @property
    def duration(self) -> float:
        """Estimated time on the way, in s; without the times at the poses."""
        return sum(move.duration for move in self.moves)


def plan_route(
    home: ArrayLike,
    postures: Postures,
    mover: Mover,
    progress: Progress = lambda *_: None,
) -> Route:
    """Return the quickest round through the approach poses that is free of collision.

    A tour is found as if all straight moves were free; its moves are checked; a blocked one costs
    what the way around takes from then on; and so on until all moves of the tour are known. As no
    way around is quicker than the straight one, the last tour is the shortest of all. Which round
    is taken depends on nothing but the arguments.

    Parameters
    ----------
    home : array_like, shape (joint,)
        Joint positions of HOME in rad or m.
    postures : Postures
        The poses; the way leads through their approach postures.
    mover : Mover
        What moves the robot; see `mover_for`.
    progress : callable, optional
        Told how many moves of the present tour are known to be free, and how many it has.

    Raises
    ------
    RobotError
        If HOME is not one position for each joint.
    PlanningError
        If HOME is not free of collision.
    """
    home = mover.sweep.scene.robot.check_positions(home)
    refuse_blocked_home(home, mover)
    ways = Ways(mover, np.concatenate([home[None], postures.q_approach]), postures.normal)
    nodes = np.array([HOME, *sorted(ways.stems)], dtype=np.intp)
    cost, cuts = mover.axes.between(ways.q[nodes]), Cuts()
    while True:
        tour = shortest_tour(cost, cuts)
        order = nodes[tour.order]
        legs = list(itertools.pairwise([*order.tolist(), HOME])) if len(order) > 1 else []
        unknown = [leg for leg in legs if ways.known(*leg) is None]
        progress(STAGE, len(legs) - len(unknown), len(legs))
        if not unknown:
            break
        for a, b in unknown:
            i, j = np.searchsorted(nodes, (a, b))
            cost[i, j] = cost[j, i] = ways.find(a, b).duration
    unreachable = np.setdiff1d(np.arange(1, len(ways.q)), nodes) - 1
    visited = order[1:] - 1
    for array in (visited, unreachable):
        array.setflags(write=False)
    return Route(visited, tuple(_move(ways, *leg) for leg in legs), unreachable, tour.shortest)


def refuse_blocked_home(home: FloatArray, mover: Mover) -> None:
    """Refuse a HOME that is not free of collision, by the two bodies that are nearest.

    Parameters
    ----------
    home : ndarray, shape (joint,)
        In rad or m.
    mover : Mover
        With the scene and the clearance.

    Raises
    ------
    PlanningError
        If any two bodies that must stay apart are nearer than the clearance.
    """
    if not mover.sweep.free(home[None], home[None])[0]:
        scene, clearance = mover.sweep.scene, mover.sweep.clearance
        first, second = scene.nearest(home)
        distance = float(scene.distances(home[None]).min())
        raise PlanningError(
            f"HOME is not free of collision: {first} and {second} are {1e3 * distance:.3g} mm apart"
            f" (must be above {1e3 * clearance:.3g} mm): move motion.home"
        )


def _move(ways: Ways, start: int, end: int) -> Move:
    way = ways.find(start, end)
    return Move(_pose(start), _pose(end), way.via, way.duration)


def _pose(node: int) -> int | None:
    return None if node == HOME else node - 1
