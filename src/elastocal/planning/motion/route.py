"""The order in which poses are visited, and the free transfers between them.

Approach poses and HOME are the nodes of a roadmap. A transfer leads from one to another, straight
in joint space or through a few via poses; it is searched when a tour needs it.

The shortest closed tour through all nodes: the symmetric travelling salesman problem.

Integer program of Dantzig, Fulkerson and Johnson (1954), solved by HiGHS through SciPy: choose
edges ``x_e`` in {0, 1} so that

    sum over e of cost_e x_e  is least,  two chosen edges meet at each node,
    and  sum over e inside S of x_e <= |S| - 1  for each part S of the nodes.

The last are exponentially many; in each round only those are added that the last solution violates.
"""

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.errors import PlanningError, present
from elastocal.planning.motion.mover import Mover
from elastocal.planning.postures import Postures, read_only
from elastocal.progress import Progress, silent
from elastocal.results import brief_repr

_ALL_EDGES = 60
"""Up to as many nodes every edge may be chosen; beyond, those to the nearest neighbours and those
of the first tour."""
_NEIGHBOURS = 10
"""Nearest neighbours of each node that edges lead to, with many nodes."""
_MOST_NODES = 200
"""Beyond, the tour of nearest neighbour and 2-opt is taken."""
_BRANCHES = 5000
"""Most branches of one integer program: with a limit on time the order would depend on it."""
_ROUNDS = 200
_USED = 1e-6
"""An edge of the linear relaxation that is chosen less than this is not chosen."""
_GAIN = 1e-12
"""Least gain of an exchange, as a part of the largest cost: less is rounding."""
_Cuts = list[frozenset[int]]
"""Parts of the nodes that no tour may close on itself in."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Tour:
    """A closed tour."""

    order: IndexArray
    """Nodes in visiting order from node 0, shape (node,); of the two directions the one whose
    second node has a lower index than its last."""
    length: float
    """Sum of the costs, including the return to node 0."""
    shortest: bool
    """Whether it is proved that no tour is shorter."""


def shortest_tour(cost: FloatArray, cuts: _Cuts | None = None) -> Tour:
    """Return the shortest closed tour, or a good one when there are too many nodes.

    Parameters
    ----------
    cost : ndarray, shape (node, node)
        Cost of each edge, symmetric, 0 or above; its diagonal is not read.
    cuts : list of frozenset of int, optional
        Parts whose constraint is used from the start; those found are added. A second call with
        other costs and the same list is faster.

    Raises
    ------
    PlanningError
        If the matrix is not square, not symmetric, empty, or an entry is negative or not finite.
    """
    cost = _checked(cost)
    if len(cost) <= 3:
        return _tour(cost, np.arange(len(cost), dtype=np.intp), True)
    start = _two_opt(cost, _nearest_neighbour(cost))
    if len(cost) > _MOST_NODES:
        return _tour(cost, start, False)
    found = _solve(cost, _edges(cost, start), [] if cuts is None else cuts)
    if found is None:
        return _tour(cost, start, False)
    return _tour(cost, found, len(cost) <= _ALL_EDGES)


def _checked(cost: FloatArray) -> FloatArray:
    cost = np.array(cost, dtype=float)
    if cost.ndim != 2 or cost.shape[0] != cost.shape[1] or not len(cost):
        raise PlanningError(f"costs of shape {cost.shape}: must be (node, node), at least 1 node")
    np.fill_diagonal(cost, 0.0)
    if not np.all((cost >= 0.0) & (cost < np.inf)):
        raise PlanningError("a cost between two nodes is negative or not finite")
    if not np.array_equal(cost, cost.T):
        raise PlanningError("costs are not symmetric: there and back must cost the same")
    return cost


def _tour(cost: FloatArray, order: IndexArray, shortest: bool) -> Tour:
    order = np.roll(order, -int(np.flatnonzero(order == 0)[0]))
    if len(order) > 2 and order[1] > order[-1]:
        order = np.roll(order[::-1], 1)
    return Tour(read_only(order, np.intp), _tour_length(cost, order), shortest)


def _nearest_neighbour(cost: FloatArray) -> IndexArray:
    """Return the tour from node 0 that always goes to the nearest node left; ties: lowest index.

    Parameters
    ----------
    cost : ndarray, shape (node, node)
        Cost of each edge, symmetric.

    Returns
    -------
    ndarray of int, shape (node,)
    """
    order, left = [0], np.ones(len(cost), dtype=bool)
    left[0] = False
    while left.any():
        order.append(int(np.where(left, cost[order[-1]], np.inf).argmin()))
        left[order[-1]] = False
    return np.array(order, dtype=np.intp)


def _two_opt(cost: FloatArray, order: IndexArray) -> IndexArray:
    """Return a tour that no reversal of a part of it shortens.

    With ``a b ... c d`` in the tour, reversing ``b ... c`` gains
    ``cost[a, b] + cost[c, d] - cost[a, c] - cost[b, d]``; the largest gain is taken each time.

    Parameters
    ----------
    cost : ndarray, shape (node, node)
        Cost of each edge, symmetric.
    order : ndarray of int, shape (node,)
        The tour to improve.

    Returns
    -------
    ndarray of int, shape (node,)
        Starts at the same node.
    """
    order = order.copy()
    least = _GAIN * float(cost.max(initial=0.0))
    while True:
        after = np.roll(order, -1)
        step = cost[order, after]
        gain = step[:, None] + step - cost[np.ix_(order, order)] - cost[np.ix_(after, after)]
        gain = np.triu(gain, 2)
        first, last = divmod(int(gain.argmax()), len(order))
        if not gain[first, last] > least:
            return order
        order[first + 1 : last + 1] = order[first + 1 : last + 1][::-1]


def _tour_length(cost: FloatArray, order: IndexArray) -> float:
    """Return the length of a closed tour.

    Parameters
    ----------
    cost : ndarray, shape (node, node)
        Cost of each edge, symmetric.
    order : ndarray of int, shape (node,)
        Nodes in visiting order; the last leads back to the first.
    """
    return float(cost[order, np.roll(order, -1)].sum())


def _edges(cost: FloatArray, start: IndexArray) -> IndexArray:
    """Return the edges that may be chosen, lower node first, shape (edge, 2)."""
    count = len(cost)
    allowed = np.ones((count, count), dtype=bool)
    if count > _ALL_EDGES:
        near = np.argsort(cost + np.diag(np.full(count, np.inf)), axis=1, kind="stable")
        allowed[:] = False
        allowed[np.arange(count)[:, None], near[:, :_NEIGHBOURS]] = True
        allowed[start, np.roll(start, -1)] = True
    return np.argwhere(np.triu(allowed | allowed.T, 1)).astype(np.intp)


def _solve(cost: FloatArray, edges: IndexArray, cuts: _Cuts) -> IndexArray | None:
    """Return the order of the shortest tour along some edges; None when a limit was met.

    The linear relaxation finds most of the parts that need a constraint, at little cost.
    """
    for whole in (False, True):
        for _ in range(_ROUNDS):
            chosen = _choice(cost, edges, cuts, whole)
            if chosen is None:
                return None
            parts = _parts(edges[chosen], len(cost))
            if len(parts) == 1:
                break
            cuts.extend(part for part in parts if part not in cuts)
        else:
            return None
    return _order(edges[chosen], len(cost))


def _choice(cost: FloatArray, edges: IndexArray, cuts: _Cuts, whole: bool) -> BoolArray | None:
    """Return which edges the program uses, in whole numbers or as its linear relaxation."""
    inside, most = _inside(edges, cuts), np.array([len(part) - 1.0 for part in cuts])
    constraints = [LinearConstraint(_incidence(edges, len(cost)), 2.0, 2.0)]
    if cuts:
        constraints.append(LinearConstraint(inside, -np.inf, most))
    result = milp(
        cost[edges[:, 0], edges[:, 1]],
        integrality=np.full(len(edges), int(whole)),
        bounds=Bounds(0.0, 1.0),
        constraints=constraints,
        options={"node_limit": _BRANCHES, "mip_rel_gap": 0.0},
    )
    if result.status != 0:
        return None
    return np.asarray(result.x > (0.5 if whole else _USED))


def _incidence(edges: IndexArray, nodes: int) -> csr_array:
    """Return which edges meet at which node, shape (node, edge)."""
    edge = np.tile(np.arange(len(edges)), 2)
    return csr_array((np.ones(len(edge)), (edges.T.ravel(), edge)), shape=(nodes, len(edges)))


def _inside(edges: IndexArray, cuts: _Cuts) -> csr_array:
    """Return which edges lie inside which part, shape (part, edge)."""
    rows = [np.isin(edges, list(part)).all(axis=1) for part in cuts]
    return csr_array(np.array(rows, dtype=float).reshape(len(cuts), len(edges)))


def _parts(edges: IndexArray, nodes: int) -> _Cuts:
    """Return the nodes of each connected part of a graph."""
    graph = csr_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(nodes, nodes))
    count, label = connected_components(graph, directed=False)
    return [frozenset(np.flatnonzero(label == part).tolist()) for part in range(count)]


def _order(edges: IndexArray, nodes: int) -> IndexArray:
    """Return the nodes of a single cycle, one after the other."""
    neighbours: list[list[int]] = [[] for _ in range(nodes)]
    for a, b in edges.tolist():
        neighbours[a].append(b)
        neighbours[b].append(a)
    order = [0, neighbours[0][0]]
    while len(order) < nodes:
        a, b = neighbours[order[-1]]
        order.append(b if a == order[-2] else a)
    return np.array(order, dtype=np.intp)


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
    """Moves from HOME through all poses and back: one more than visited poses; none without
    poses."""
    unreachable: IndexArray
    """Poses without a free path, in ascending order: they are not visited."""
    shortest: bool
    """Whether it is proved that no other order of the same poses takes less time, of the transfers
    that were tried."""

    @property
    def duration(self) -> float:
        """Estimated time of the moves, in s; without the times at the poses."""
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
    """Transfers between nodes, computed when needed and kept.

    The *stem* of a pose is its free transfer to HOME with at most one via pose: none, the pose
    lifted off along its normal, a point beside the move, or another pose that leads straight to
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

        The straight transfer is tried, then, the quickest first: one end lifted, or both; the mean
        in joint space of both lifted; a point beside the move; and through HOME, which is always
        free.
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
        # Free because its stems are, even if rounding gives another result in the opposite
        # direction.
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

    A tour is found as if all straight moves were free; its moves are checked; a blocked one then
    costs the time of its detour; this is repeated until all moves of the tour are known. As no
    detour is quicker than the straight move, the last tour is the shortest of all. The result
    depends on the arguments alone.

    Parameters
    ----------
    home : array_like, shape (joint,)
        Joint positions of HOME in rad or m.
    postures : Postures
        The poses; the path leads through their approach postures.
    mover : Mover
        Durations and collision checks of moves; see `mover_for`.
    progress : callable, optional
        Called with the number of moves of the present tour known to be free, and their total.

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
