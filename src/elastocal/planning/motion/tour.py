"""The shortest closed tour through all nodes: the symmetric travelling salesman problem.

Integer program of Dantzig, Fulkerson and Johnson (1954), solved by HiGHS through SciPy: choose
edges ``x_e`` in {0, 1} so that

    sum over e of cost_e x_e  is least,  two chosen edges meet at each node,
    and  sum over e inside S of x_e <= |S| - 1  for each part S of the nodes.

The last are exponentially many; only those are added, in rounds, that the last solution breaks.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.errors import PlanningError
from elastocal.planning.postures import read_only
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
    """Sum of the costs, that of the way back to node 0 included."""
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
