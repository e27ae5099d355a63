"""Distance to the border of the smooth patch that a point lies on (engagement, paper 2.2)."""

import numpy as np
from scipy.spatial import cKDTree

from elastocal.arrays import FloatArray
from elastocal.planning.surface.surface import Surface, SurfacePoints

_PIECES = 5000
"""Border edges are cut so that no piece is longer than this part of the whole border."""
_NEAREST = 8
"""Pieces that are measured exactly, per point."""


def distance_to_boundary(surface: Surface, points: SurfacePoints) -> FloatArray:
    """Return how far points are from where their patch of the surface ends.

    A patch ends at open edges and at creases: a contact disk may hang over neither. The distance
    is the straight one, never longer than the way along the surface, so it errs on the safe side.

    The border is cut into short pieces; of the eight whose middles are nearest, the distance is
    exact. Should a ninth be nearer, the error is below half a piece, 1e-4 of the border's length.

    Parameters
    ----------
    surface : Surface
        The surface.
    points : SurfacePoints
        On that surface.

    Returns
    -------
    ndarray, shape (point,)
        In m; infinite on a patch without border, such as a whole sphere.
    """
    pieces, patch_of_piece = _border_pieces(surface)
    distance = np.full(len(points), np.inf)
    patch_of_point = surface.patch[points.face]
    by_point, by_piece = np.argsort(patch_of_point), np.argsort(patch_of_piece)
    patches = np.unique(patch_of_point)
    point_ends = _ranges(patch_of_point[by_point], patches)
    piece_ends = _ranges(patch_of_piece[by_piece], patches)
    for (p0, p1), (s0, s1) in zip(point_ends, piece_ends, strict=True):
        if s1 > s0:
            chosen = by_point[p0:p1]
            distance[chosen] = _nearest(points.position[chosen], pieces[by_piece[s0:s1]])
    return distance


def _border_pieces(surface: Surface) -> tuple[FloatArray, np.ndarray]:
    """Return segments, shape (piece, 2, 3), and the patch of each."""
    half = surface.border_half_edges
    face, corner = half // 3, half % 3
    mesh = surface.mesh
    start = mesh.vertices[mesh.faces[face, corner]]
    end = mesh.vertices[mesh.faces[face, (corner + 1) % 3]]
    length = np.linalg.norm(end - start, axis=1)
    cuts = np.ceil(length * (_PIECES / length.sum() if len(half) else 0.0)).astype(np.intp)
    which = np.repeat(np.arange(len(half)), cuts)
    step = np.arange(len(which)) - np.repeat(np.cumsum(cuts) - cuts, cuts)
    low, high = step / cuts[which], (step + 1) / cuts[which]
    along = (end - start)[which]
    pieces = np.stack(
        [start[which] + low[:, None] * along, start[which] + high[:, None] * along], axis=1
    )
    return pieces, surface.patch[face][which]


def _ranges(ordered: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return begin and end of each value in an ascending array, shape (value, 2)."""
    return np.stack(
        [np.searchsorted(ordered, values), np.searchsorted(ordered, values, side="right")], axis=1
    )


def _nearest(position: FloatArray, pieces: FloatArray) -> FloatArray:
    count = min(_NEAREST, len(pieces))
    _, found = cKDTree(pieces.mean(axis=1)).query(position, k=count)
    near = pieces[found.reshape(len(position), count)]
    along = near[:, :, 1] - near[:, :, 0]
    to_point = position[:, None] - near[:, :, 0]
    share = np.einsum("pki,pki->pk", to_point, along) / np.einsum("pki,pki->pk", along, along)
    foot = near[:, :, 0] + share.clip(0.0, 1.0)[:, :, None] * along
    distance: FloatArray = np.linalg.norm(position[:, None] - foot, axis=2).min(axis=1)
    return distance
