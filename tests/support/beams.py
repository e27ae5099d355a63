"""Beams and exact distances along them, as a second way to find what hides a marker."""

import coal
import numpy as np

from elastocal.shapes import Beams

_POINT = coal.Sphere(1e-12)


def random_beams(count: int, rng: np.random.Generator, spread: float) -> Beams:
    """Return beams about 2 m long that pass within about ``spread`` (m) of the origin."""
    start = rng.normal(size=(count, 3))
    start /= np.linalg.norm(start, axis=1, keepdims=True)
    towards = spread * rng.uniform(-1.0, 1.0, (count, 3)) - start
    direction = towards / np.linalg.norm(towards, axis=1, keepdims=True)
    return Beams(start, direction, rng.uniform(1.0, 2.5, count))


def signed_distance(
    shape: coal.CollisionGeometry, point: np.ndarray, T: np.ndarray | None = None
) -> float:
    """Return the distance of a point from a shape placed at T, in m; negative inside."""
    place = np.eye(4) if T is None else T
    return coal.distance(
        _POINT,
        coal.Transform3s(np.eye(3), np.asarray(point)),
        shape,
        coal.Transform3s(place[:3, :3], place[:3, 3]),
        coal.DistanceRequest(),
        coal.DistanceResult(),
    )


def distance_along(
    shape: coal.CollisionGeometry,
    beams: Beams,
    seat: float,
    step: float,
    T: np.ndarray | None = None,
) -> np.ndarray:
    """Return the smallest distance of points ``step`` apart on each beam, shape (beam,), in m.

    Where a point is far, the points that it proves to be outside are left out.
    """
    nearest = np.full(len(beams), np.inf)
    for beam in range(len(beams)):
        along = seat
        while along <= beams.length[beam]:
            point = beams.start[beam] + along * beams.direction[beam]
            distance = signed_distance(shape, point, None if T is None else T[beam])
            nearest[beam] = min(nearest[beam], distance)
            along += max(step, distance)
    return nearest
