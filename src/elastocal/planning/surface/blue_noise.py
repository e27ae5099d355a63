"""Blue noise by weighted sample elimination, all local maxima of a round at once.

Source: C. Yuksel, "Sample elimination for generating Poisson disk sample sets", Computer Graphics
Forum 34(2), 2015. There a heap gives up the sample with the largest weight, one by one. Since a
removal only lowers weights, and only of neighbours, a sample that is heavier than all its
neighbours will be removed before any of them, at the weight it has now: whole rounds of such
samples can go together, and sorting the weights at removal gives the heap's order back. Both
remove the same samples.
"""

import math

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from elastocal.arrays import FloatArray, IndexArray

_ALPHA, _BETA, _GAMMA = 8.0, 0.65, 1.5
"""Yuksel's constants: steepness of the weight, and the floor that keeps it from clustering."""


def eliminate(position: FloatArray, normal: FloatArray, count: int, area: float) -> IndexArray:
    """Return which points to keep so that those kept lie far apart.

    The weight of a point is ``Σ (1 - max(d, 2 r_min) / 2 r_max)^8`` over its neighbours at
    distance d below 2 r_max, where ``r_max = sqrt(area / (2 √3 count))`` is the largest radius
    that disks in a hexagonal packing could have, and ``r_min = 0.65 r_max (1 - (count/n)^1.5)``.

    Parameters
    ----------
    position : ndarray, shape (point, 3)
        In m.
    normal : ndarray, shape (point, 3)
        Unit normals; points whose normals are more than 90° apart are no neighbours, so that
        the two sides of a thin plate do not see each other.
    count : int
        Number of points to keep.
    area : float
        Of the part of the surface that the points cover, in m².

    Returns
    -------
    ndarray of int, shape (count,)
        Ascending; all points when there are no more than ``count``.
    """
    total = len(position)
    if total <= count:
        return np.arange(total)
    weights = _pair_weights(position, normal, count, area)
    removal = _removal_weights(weights, total - count)
    # Equal weights go by number, so that the result does not hang on the sort.
    order = np.lexsort((np.arange(total), -removal))
    return np.sort(order[total - count :])


def _pair_weights(
    position: FloatArray, normal: FloatArray, count: int, area: float
) -> csr_array[np.float64]:
    """Return the symmetric matrix of what each pair adds to each other's weight."""
    total = len(position)
    r_max = math.sqrt(area / (2.0 * math.sqrt(3.0) * count))
    r_min = _BETA * r_max * (1.0 - (count / total) ** _GAMMA)
    pairs = cKDTree(position).query_pairs(2.0 * r_max, output_type="ndarray")
    pairs = pairs[np.einsum("pi,pi->p", normal[pairs[:, 0]], normal[pairs[:, 1]]) >= 0.0]
    distance = np.linalg.norm(position[pairs[:, 0]] - position[pairs[:, 1]], axis=1)
    shared = (1.0 - np.maximum(distance, 2.0 * r_min) / (2.0 * r_max)).clip(0.0) ** _ALPHA
    both = np.concatenate([pairs, pairs[:, ::-1]])
    return csr_array((np.tile(shared, 2), (both[:, 0], both[:, 1])), shape=(total, total))


def _removal_weights(weights: csr_array[np.float64], surplus: int) -> FloatArray:
    """Return each point's weight at its removal; -1 for those that outlive the last one."""
    total = weights.shape[0]
    row = np.repeat(np.arange(total), np.diff(weights.indptr))
    column, shared = weights.indices, weights.data
    weight: FloatArray = np.asarray(weights.sum(axis=1)).reshape(-1)
    removal = np.full(total, -1.0)
    alive = np.ones(total, dtype=bool)
    while True:
        gone = removal[~alive]
        if len(gone) >= surplus:
            last = np.partition(gone, len(gone) - surplus)[len(gone) - surplus]
            if not alive.any() or last > weight[alive].max():
                return removal
        edge = alive[row] & alive[column]
        row, column, shared = row[edge], column[edge], shared[edge]
        heavier = weight[column] - weight[row]
        beaten = (heavier > 0.0) | ((heavier == 0.0) & (column < row))
        first = alive.copy()
        first[row[beaten]] = False
        removal[first] = weight[first]
        alive &= ~first
        lost = first[column]
        weight = weight - np.bincount(row[lost], shared[lost], total)
