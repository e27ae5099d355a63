"""Points spread over a surface: area-uniform, or as blue noise."""

import numpy as np
from numpy.random import Generator

from elastocal.planning.surface.blue_noise import eliminate
from elastocal.planning.surface.errors import SurfaceError
from elastocal.planning.surface.surface import Surface, SurfacePoints

_PROBE = 20_000
"""Points that are thrown at the surface to find out how much of it the region holds."""
_OVERSAMPLING = 5
"""Points to eliminate from, per point kept: Yuksel's recommendation."""


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
    """Return points that keep their distance from one another, in all other ways random.

    Weighted sample elimination over five times as many uniform points; see
    `elastocal.planning.surface.blue_noise`. Parameters and errors: see `sample_uniform`.
    """
    pool = sample_uniform(surface, _OVERSAMPLING * count, rng)
    area = surface.area if surface.region is None else surface.area * region_share(surface, rng)
    return pool.take(eliminate(pool.position, pool.normal, count, area))


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
