"""The order in which poses are visited, and the free transfers between them.

Approach poses and HOME are the nodes of a roadmap. A transfer leads from one to another, straight
in joint space or by way of a few via poses; it is looked for when a tour needs it.
"""

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray, IndexArray
from elastocal.errors import PlanningError, present
from elastocal.planning.motion.mover import Mover
from elastocal.planning.motion.tour import _Cuts, shortest_tour
from elastocal.planning.postures import Postures, read_only
from elastocal.progress import Progress, silent
from elastocal.results import brief_repr

VISITING = "visiting order"
"""Stage under which progress is reported."""
_HOME_NODE = 0
"""Number of HOME among the nodes; pose ``i`` is node ``i + 1``."""


@brief_repr
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


@brief_repr
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
    """Whether it is proved that no other order of the same poses takes less time, of the transfers
    that were tried."""

    @property
    def duration(self) -> float:
        """Estimated time on the way, in s; without the times at the poses."""
        return sum(move.duration for move in self.moves)


@dataclass(frozen=True, eq=False)
class _Transfer:
    """A free motion between two nodes, with a stop at each via pose."""

    via: FloatArray
    """Joint positions in between, shape (via, joint), in rad or m; read-only."""
    duration: float
    """In s."""

    def back(self) -> "_Transfer":
        """Return the same transfer in the other direction."""
        return _Transfer(self.via[::-1], self.duration)


@dataclass(eq=False)
class _Roadmap:
    """The transfers between nodes, found when they are asked for and remembered.

    The *stem* of a pose is its free transfer to HOME with at most one via pose: none, the pose
    lifted off along its normal, a point about the way, or another pose that leads straight to
    HOME. A pose without a stem cannot be visited. Two poses with stems always have a transfer:
    through HOME, with at most three via poses.
    """

    mover: Mover
    q: FloatArray
    """Joint positions of the nodes, shape (node, joint): HOME, then the approach poses."""
    normal: FloatArray
    """Outward unit normal of the surface at each pose, shape (pose, 3)."""
    stems: dict[int, _Transfer] = field(default_factory=dict, init=False)
    _known: dict[tuple[int, int], _Transfer] = field(default_factory=dict, init=False)
    _lifts: dict[int, FloatArray] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        home = np.broadcast_to(self.q[_HOME_NODE], self.q[1:].shape)
        straight = 1 + np.flatnonzero(self.mover.sweep.free(self.q[1:], home))
        for pose in straight.tolist():
            self.stems[pose] = self._transfer(pose, _HOME_NODE, self._none())
        for pose in sorted(set(range(1, len(self.q))) - set(self.stems)):
            stem = self._first_free(pose, _HOME_NODE, self._single_vias(pose, _HOME_NODE))
            stem = stem or self._first_free(pose, _HOME_NODE, [self.q[[gate]] for gate in straight])
            if stem:
                self.stems[pose] = stem

    def known(self, start: int, end: int) -> _Transfer | None:
        """Return the transfer between two nodes if it has been asked for before."""
        found = self._known.get((min(start, end), max(start, end)))
        return found.back() if found is not None and start > end else found

    def find(self, start: int, end: int) -> _Transfer:
        """Return the quickest free transfer of those tried between two nodes with stems.

        Tried are straight, then, the quickest first: one end lifted, or both; the mean in joint
        space of both lifted; a point about the way; and through HOME, which is free in any case.
        """
        first, last = min(start, end), max(start, end)
        if (first, last) not in self._known:
            self._known[first, last] = self._find(first, last)
        return present(self.known(start, end), "transfer")

    def _find(self, first: int, last: int) -> _Transfer:
        straight = self._first_free(first, last, [self._none()])
        if straight is not None:
            return straight
        through_home = self._through_home(first, last)
        vias = [*self._single_vias(first, last), *self._double_vias(first, last), through_home]
        # Known to be free from its stems, even if rounding should tell otherwise on the way back.
        return self._first_free(first, last, vias) or self._transfer(first, last, through_home)

    def _none(self) -> FloatArray:
        return self.q[:0]

    def _lift(self, node: int) -> FloatArray:
        """Return the lifted postures of a node, the least lifted first; none of HOME."""
        if node == _HOME_NODE:
            return self._none()
        if node not in self._lifts:
            self._lifts[node] = self.mover.lifted(self.q[node], self.normal[node - 1])
        return self._lifts[node]

    def _single_vias(self, first: int, last: int) -> Iterator[FloatArray]:
        here, there = self._lift(first), self._lift(last)
        means = [0.5 * (a + b) for a, b in zip(here, there, strict=False)]
        about = self.mover.detours(self.q[first], self.q[last])
        return (via[None] for via in (*here, *there, *means, *about))

    def _double_vias(self, first: int, last: int) -> Iterator[FloatArray]:
        return map(np.array, zip(self._lift(first), self._lift(last), strict=False))

    def _through_home(self, first: int, last: int) -> FloatArray:
        """Return the via poses through HOME; those of the stem if HOME is an end."""
        if first == _HOME_NODE:
            return self.stems[last].via[::-1]
        return np.concatenate(
            [self.stems[first].via, self.q[[_HOME_NODE]], self.stems[last].via[::-1]]
        )

    def _transfer(self, start: int, end: int, via: FloatArray) -> _Transfer:
        duration = self.mover.axes.along(self._chain(start, end, via))
        return _Transfer(read_only(via), duration)

    def _chain(self, start: int, end: int, via: FloatArray) -> FloatArray:
        return np.concatenate([self.q[[start]], via, self.q[[end]]])

    def _first_free(self, start: int, end: int, vias: Iterable[FloatArray]) -> _Transfer | None:
        """Return the quickest of some transfers that is free; ties: the one given first."""
        transfers = [self._transfer(start, end, via) for via in vias]
        for transfer in sorted(transfers, key=lambda one: one.duration):
            if self.mover.sweep.along(self._chain(start, end, transfer.via)):
                return transfer
        return None


def plan_route(
    home: ArrayLike, postures: Postures, mover: Mover, progress: Progress = silent
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
        Hears how many moves of the present tour are known to be free, and how many it has.

    Raises
    ------
    RobotError
        If HOME is not one position for each joint.
    PlanningError
        If HOME is not free of collision.
    """
    home = mover.sweep.scene.robot.check_positions(home)
    require_free_home(home, mover)
    roadmap = _Roadmap(mover, np.concatenate([home[None], postures.q_approach]), postures.normal)
    nodes = np.array([_HOME_NODE, *sorted(roadmap.stems)], dtype=np.intp)
    cost, cuts = mover.axes.between(roadmap.q[nodes]), _Cuts()
    while True:
        tour = shortest_tour(cost, cuts)
        order = nodes[tour.order]
        legs = list(itertools.pairwise([*order.tolist(), _HOME_NODE])) if len(order) > 1 else []
        unknown = [leg for leg in legs if roadmap.known(*leg) is None]
        progress(VISITING, len(legs) - len(unknown), len(legs))
        if not unknown:
            break
        for a, b in unknown:
            i, j = np.searchsorted(nodes, (a, b))
            cost[i, j] = cost[j, i] = roadmap.find(a, b).duration
    visited = read_only(order[1:] - 1, np.intp)
    unreachable = read_only(np.setdiff1d(np.arange(1, len(roadmap.q)), nodes) - 1, np.intp)
    return Route(visited, tuple(_move(roadmap, *leg) for leg in legs), unreachable, tour.shortest)


def _move(roadmap: _Roadmap, start: int, end: int) -> Move:
    transfer = roadmap.find(start, end)
    return Move(_pose(start), _pose(end), transfer.via, transfer.duration)


def _pose(node: int) -> int | None:
    return None if node == _HOME_NODE else node - 1


def require_free_home(home: FloatArray, mover: Mover) -> None:
    """Require a HOME that is free of collision, or name the two bodies that are nearest.

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
