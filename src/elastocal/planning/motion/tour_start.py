"""A good tour at little cost: nearest neighbour, then 2-opt (Croes 1958)."""

import numpy as np

from elastocal.arrays import FloatArray, IndexArray

_GAIN = 1e-12
"""Least gain of an exchange, as a part of the largest cost: less is rounding."""


def tour_length(cost: FloatArray, order: IndexArray) -> float:
    """Return the length of a closed tour.

    Parameters
    ----------
    cost : ndarray, shape (node, node)
        Cost of each edge, symmetric.
    order : ndarray of int, shape (node,)
        Nodes in visiting order; the last leads back to the first.
    """
    return float(cost[order, np.roll(order, -1)].sum())


def nearest_neighbour(cost: FloatArray) -> IndexArray:
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


def two_opt(cost: FloatArray, order: IndexArray) -> IndexArray:
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
