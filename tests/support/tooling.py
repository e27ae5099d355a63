"""Small surfaces with known answers."""

from collections.abc import Callable

import numpy as np

from elastocal.planning.surface import Surface
from elastocal.planning.surface.mesh import weld
from elastocal.planning.surface.surface import build_surface


def grid(height: Callable, n: int = 41, size: float = 1.0) -> Surface:
    """A square patch over x and y, centred, with its outside up."""
    u = np.linspace(-size / 2, size / 2, n)
    x, y = np.meshgrid(u, u, indexing="ij")
    vertices = np.stack([x, y, height(x, y)], axis=-1).reshape(-1, 3)
    i = np.arange(n * n).reshape(n, n)
    a, b, c, d = i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]
    faces = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    return build_surface(weld(vertices, faces, "grid"))


def plane(n: int = 2, size: float = 1.0) -> Surface:
    return grid(lambda x, _: 0.0 * x, n, size)


def cap(radius: float = 1.5, n: int = 61) -> Surface:
    """A square patch of a sphere about the origin."""
    return grid(lambda x, y: np.sqrt(radius**2 - x**2 - y**2), n)


def soup(triangles: np.ndarray, name: str = "soup", **options: object) -> Surface:
    """A surface from loose triangles, shape (face, 3, 3)."""
    faces = np.arange(3 * len(triangles)).reshape(-1, 3)
    return build_surface(weld(triangles.reshape(-1, 3), faces, name), name=name, **options)
