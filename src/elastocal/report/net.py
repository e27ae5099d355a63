"""Unfold the faces of a block like a paper net."""

from itertools import combinations

import numpy as np
from scipy.spatial import cKDTree

from elastocal.arrays import FloatArray, IndexArray
from elastocal.planning.surface import Surface
from elastocal.report.sheet import ONE_WAY, Sheet, axes_across

_TURNED_AWAY = np.cos(np.radians(135.0))
"""A face turned further than this from the middle one cannot hang on it."""
_GAP = 0.05
"""Between the parts of a net, as part of the middle one's size."""
_TOUCHING = 0.02
"""Parts whose boxes share more than this part of the smaller one overlap."""


def unfolded(surface: Surface, patch: IndexArray, normal: FloatArray) -> tuple[Sheet, ...] | None:
    """Return a net of the smooth patches that hold candidates; None if none is free of overlap.

    The patch that faces the way of most others stays in the middle; each other one is turned
    by the least rotation about its corner that is nearest to the middle one.

    Parameters
    ----------
    surface : Surface
        The tooling.
    patch : ndarray of int, shape (candidate,)
        The surface's smooth patch that each candidate lies on.
    normal : ndarray, shape (candidate, 3)
        Outward unit normals.
    """
    facing = {int(p): _mean(normal[patch == p]) for p in np.unique(patch)}
    if any(np.any(normal[patch == p] @ towards <= ONE_WAY) for p, towards in facing.items()):
        return None
    total = np.sum(list(facing.values()), axis=0)
    root = max(facing, key=lambda p: float(facing[p] @ total))
    if any(towards @ facing[root] < _TURNED_AWAY for towards in facing.values()):
        return None
    corners = {p: _corners(surface, p) for p in facing}
    A_root = axes_across(facing[root], corners[root].mean(axis=0))
    sheets = []
    for p, towards in facing.items():
        A, b = _hinged(A_root, facing[root], towards, corners[root], corners[p])
        sheets.append(Sheet(A, b, np.flatnonzero(surface.patch == p), np.flatnonzero(patch == p)))
    flat = [sheet.flat(points) for sheet, points in zip(sheets, corners.values(), strict=True)]
    return None if _overlap(flat) else tuple(sheets)


def _hinged(
    A_root: FloatArray,
    root: FloatArray,
    towards: FloatArray,
    root_corners: FloatArray,
    corners: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return the map of a patch turned into the plane of the middle one."""
    A = A_root @ _rotation(towards, root)
    distance, nearest = map(np.asarray, cKDTree(root_corners).query(corners))
    hinge = int(distance.argmin())
    outward = A_root @ towards
    length = float(np.linalg.norm(outward))
    gap = _GAP * float(np.linalg.norm(np.ptp(root_corners, axis=0)))
    apart = gap * outward / length if length > 1e-9 else np.zeros(2)
    return A, A_root @ root_corners[int(nearest[hinge])] - A @ corners[hinge] + apart


def _rotation(start: FloatArray, end: FloatArray) -> FloatArray:
    """Return the least rotation from one unit vector to another, not its opposite (Rodrigues)."""
    x, y, z = np.cross(start, end)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: FloatArray = np.eye(3) + K + K @ K / (1.0 + start @ end)
    return rotation


def _overlap(parts: list[FloatArray]) -> bool:
    """Return whether the boxes of flat parts, each of shape (point, 2), overlap."""
    boxes = [(part.min(axis=0), part.max(axis=0)) for part in parts]
    for (low_a, high_a), (low_b, high_b) in combinations(boxes, 2):
        shared = np.prod(np.clip(np.minimum(high_a, high_b) - np.maximum(low_a, low_b), 0.0, None))
        smaller = min(np.prod(high_a - low_a), np.prod(high_b - low_b))
        if shared > _TOUCHING * smaller:
            return True
    return False


def _corners(surface: Surface, patch: int) -> FloatArray:
    """Return the vertices of a patch, shape (vertex, 3)."""
    faces = surface.mesh.faces[surface.patch == patch]
    corners: FloatArray = surface.mesh.vertices[np.unique(faces)]
    return corners


def _mean(normals: FloatArray) -> FloatArray:
    total: FloatArray = normals.sum(axis=0)
    return total / (np.linalg.norm(total) or 1.0)
