"""Points spread over a surface: area-uniform, or as blue noise."""

import math
from collections.abc import Iterator

import numpy as np
from numpy.random import Generator
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from elastocal.arrays import FloatArray, IndexArray
from elastocal.planning.surface.mesh import SurfaceError
from elastocal.planning.surface.surface import Surface, SurfacePoints

_PROBE = 20_000
"""Points that are thrown at the surface to find out how much of it the region holds."""
_OVERSAMPLING = 5
"""Points to eliminate from, per point kept: Yuksel's recommendation."""
_LARGEST = 250_000
"""Most points that are eliminated from at once: some 400 MB. More are cut into tiles."""
_ALPHA, _BETA, _GAMMA = 8.0, 0.65, 1.5
"""Yuksel's constants: steepness of the weight, and the floor that keeps it from clustering."""


def sample_uniform(surface: Surface, count: int, rng: Generator) -> SurfacePoints:
    """Return independent points, each square metre of the region being as likely.

    Source of the weights within a triangle: R. Osada et al., "Shape distributions", ACM
    Transactions on Graphics 21(4), 2002, Eq. 1.

    Parameters
    ----------
    surface : Surface
        The surface, with its region.
    count : int
        Number of points, at least 1.
    rng : Generator
        Seeded source of randomness.

    Raises
    ------
    SurfaceError
        If the count is below 1, or the region holds no part of the surface.
    """
    if not count >= 1:
        raise SurfaceError(f"{count} points asked of {surface.name}: must be at least 1")
    if surface.region is None:
        return _throw(surface, count, rng)
    share = region_share(surface, rng)
    found: list[SurfacePoints] = []
    missing = count
    while missing > 0:
        points = _throw(surface, int(1.1 * missing / share) + 16, rng)
        found.append(points.take(surface.in_region(points)))
        missing -= len(found[-1])
    return SurfacePoints.joined(found).take(np.arange(count))


def sample_blue_noise(surface: Surface, count: int, rng: Generator) -> SurfacePoints:
    """Return random points that keep a distance from one another.

    Weighted sample elimination over five times as many uniform points; see `_eliminate`. Beyond
    50 000 points in tiles, so that memory is bounded: points on either side of a seam may be
    nearer to each other. Parameters and errors: see `sample_uniform`.
    """
    pool = sample_uniform(surface, _OVERSAMPLING * count, rng)
    area = surface.area if surface.region is None else surface.area * region_share(surface, rng)
    position, normal, kept = pool.position, pool.normal, []
    for tile, share in _tiles(position, np.arange(len(position)), count):
        part = area * len(tile) / len(position)
        kept.append(tile[_eliminate(position[tile], normal[tile], share, part)])
    return pool.take(np.sort(np.concatenate(kept)))


def _tiles(position: FloatArray, index: IndexArray, count: int) -> Iterator[tuple[IndexArray, int]]:
    """Yield the points of each tile, ascending, and how many of them are to be kept.

    What has too many points is halved across its longest side.
    """
    if len(index) <= _LARGEST:
        yield index, count
        return
    inside = position[index]
    order = np.argsort(inside[:, np.ptp(inside, axis=0).argmax()], kind="stable")
    half = len(index) // 2
    kept = count * half // len(index)
    for part, share in ((order[:half], kept), (order[half:], count - kept)):
        yield from _tiles(position, np.sort(index[part]), share)


def region_share(surface: Surface, rng: Generator) -> float:
    """Return the share of the area that the region holds, from 20 000 points.

    Raises
    ------
    SurfaceError
        If none of them is in the region.
    """
    if surface.region is None:
        return 1.0
    share = float(surface.in_region(_throw(surface, _PROBE, rng)).mean())
    if not share > 0.0:
        low, high = _extent(surface)
        raise SurfaceError(
            f"the region holds none of {_PROBE} points spread over {surface.name}, which extends"
            f" from ({low}) m to ({high}) m in its own frame"
        )
    return share


def _throw(surface: Surface, count: int, rng: Generator) -> SurfacePoints:
    """Return uniform points, whatever the region."""
    ends = np.cumsum(surface.face_areas)
    draws = rng.uniform(size=(count, 3))
    face = np.searchsorted(ends, draws[:, 0] * ends[-1], side="right")
    face = np.minimum(face, len(ends) - 1)
    root = np.sqrt(draws[:, 1])
    weights = np.stack([1.0 - root, root * (1.0 - draws[:, 2]), root * draws[:, 2]], axis=1)
    return surface.points(face, weights)


def _extent(surface: Surface) -> tuple[str, str]:
    R, p = surface.T_base_surface[:3, :3], surface.T_base_surface[:3, 3]
    own = (surface.mesh.vertices - p) @ R
    low, high = (", ".join(f"{v:.4g}" for v in end(axis=0)) for end in (own.min, own.max))
    return low, high


def _eliminate(position: FloatArray, normal: FloatArray, count: int, area: float) -> IndexArray:
    """Return which points to keep so that those kept lie far apart (blue noise).

    Source: C. Yuksel, "Sample elimination for generating Poisson disk sample sets", Computer
    Graphics Forum 34(2), 2015. There a heap gives up the sample with the largest weight, one by
    one. Since a removal only lowers weights, and only of neighbours, a sample that is heavier than
    all its neighbours will be removed before any of them, at the weight it has now: whole rounds
    of such samples can go together, and sorting the weights at removal gives the heap's order
    back. Both remove the same samples.

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
        Area of the part of the surface that the points cover, in m².

    Returns
    -------
    ndarray of int, shape (count,)
        Ascending; all points if there are at most ``count``.
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
