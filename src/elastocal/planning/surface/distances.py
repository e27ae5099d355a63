"""Distances on a surface: from a point to the border of its patch, and along the surface."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from elastocal.arrays import FloatArray, IndexArray
from elastocal.planning.surface.mesh import SurfaceError
from elastocal.planning.surface.surface import Surface, SurfacePoints
from elastocal.results import brief_repr

_PIECES = 5000
"""Border edges are cut so that no piece is longer than this part of the whole border."""
_NEAREST = 8
"""Pieces that are measured exactly, per point."""
_PER_DIAGONAL = 60
"""Steiner points on a line as long as the surface's diagonal, by default."""
_LEAST = 3
"""Steiner points on an edge, however short: without them paths zigzag and are up to 8 % too
long."""


def distance_to_boundary(surface: Surface, points: SurfacePoints) -> FloatArray:
    """Return the distance of points from the border of their patch of the surface.

    A patch ends at open edges and at creases: a contact disk must overhang neither. The distance is
    the straight one, never longer than along the surface, hence on the safe side.

    The border is cut into short pieces; of the eight whose middles are nearest, the distance is
    exact. Should a ninth be nearer, the error is below half a piece, 1e-4 of the border's length.

    Parameters
    ----------
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
    for patch in np.intersect1d(patch_of_point, patch_of_piece):
        chosen = patch_of_point == patch
        distance[chosen] = _nearest(points.position[chosen], pieces[patch_of_piece == patch])
    return distance


def _border_pieces(surface: Surface) -> tuple[FloatArray, IndexArray]:
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
    ends = np.stack([step, step + 1], axis=1) / cuts[which][:, None]
    pieces = start[which][:, None] + ends[:, :, None] * (end - start)[which][:, None]
    return pieces, surface.patch[face][which]


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


@brief_repr
@dataclass(frozen=True, eq=False)
class GeodesicDistance:
    """Lengths of paths along the surface between points on it; see `geodesic_distance`."""

    position: FloatArray
    """The points, shape (point, 3), in m."""
    face: IndexArray
    """Face that contains each point."""
    graph: csr_array[np.float64]
    """Lengths of the straight segments in m; the points come last."""

    def from_point(self, index: int) -> FloatArray:
        """Return the distance of every point from one of them.

        Parameters
        ----------
        index : int
            Number of the point.

        Returns
        -------
        ndarray, shape (point,)
            In m; infinite where there is no path.
        """
        first = self.graph.shape[0] - len(self.position)
        distance = dijkstra(self.graph, directed=False, indices=[first + index])[0, first:]
        # Within a face the straight segment is the shortest, and needs no graph edge.
        same = np.flatnonzero(self.face == self.face[index])
        distance[same] = np.linalg.norm(self.position[same] - self.position[index], axis=1)
        return distance


def geodesic_distance(
    surface: Surface, points: SurfacePoints, spacing: float | None = None
) -> GeodesicDistance:
    """Return the metric of paths along the surface.

    Paths are straight within faces and change direction at points set on the edges at most
    ``spacing`` apart; Dijkstra finds the shortest. They are real paths, so the distance is never
    too short. It is too long by at most 4 %, about 1 % in the median (measured on a plane, a sphere
    and a block, tests/planning/surface/test_geodesic.py).

    Source: M. Lanthier, A. Maheshwari, J.-R. Sack, "Approximating shortest paths on weighted
    polyhedral surfaces", Algorithmica 30, 2001 (fixed scheme of Steiner points).

    Parameters
    ----------
    points : SurfacePoints
        On that surface.
    spacing : float, optional
        In m; 1/60 of the diagonal of the surface's bounding box by default.

    Raises
    ------
    SurfaceError
        If the spacing is not positive.
    """
    mesh = surface.mesh
    if spacing is None:
        spacing = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0))) / _PER_DIAGONAL
    if not spacing > 0.0:
        raise SurfaceError(f"geodesic spacing {spacing!r} m: must be positive")
    nodes, at_face = _nodes(surface, spacing)
    position = np.concatenate([nodes, points.position])
    start, end = _links(at_face, points.face, len(nodes))
    length = np.linalg.norm(position[start] - position[end], axis=1)
    # A zero would mean no link, so a point on a node keeps a small distance to it.
    length = np.maximum(length, np.finfo(float).tiny)
    low, high = np.minimum(start, end), np.maximum(start, end)
    _, first = np.unique(low * len(position) + high, return_index=True)
    shape = (len(position), len(position))
    graph = coo_array((length[first], (low[first], high[first])), shape=shape).tocsr()
    return GeodesicDistance(points.position, points.face, graph)


def _nodes(surface: Surface, spacing: float) -> tuple[FloatArray, list[IndexArray]]:
    """Return vertices and Steiner points, and the nodes on the outline of each face."""
    mesh, edges = surface.mesh, surface.edges
    ends = mesh.vertices[edges.vertices]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    inner = np.maximum(_LEAST, np.ceil(length / spacing).astype(np.intp) - 1)
    first = len(mesh.vertices) + np.cumsum(inner) - inner
    which = np.repeat(np.arange(len(inner)), inner)
    place = np.arange(len(which)) - np.repeat(first - len(mesh.vertices), inner)
    share = (place + 1.0) / (inner[which] + 1.0)
    steiner = ends[which, 0] + share[:, None] * (ends[which, 1] - ends[which, 0])
    of_face = edges.of_half_edge.reshape(-1, 3)
    outline = [
        np.concatenate([corners, *(first[e] + np.arange(inner[e]) for e in its_edges)])
        for corners, its_edges in zip(mesh.faces, of_face, strict=True)
    ]
    return np.concatenate([mesh.vertices, steiner]), outline


def _links(
    outline: list[IndexArray], face: IndexArray, nodes: int
) -> tuple[IndexArray, IndexArray]:
    """Return the ends of all segments through a face: node to node, and node to point."""
    start, end = [], []
    for corner_nodes in outline:
        one, other = np.triu_indices(len(corner_nodes), 1)
        start.append(corner_nodes[one])
        end.append(corner_nodes[other])
    size = np.array([len(outline[f]) for f in face], dtype=np.intp)
    start.append(np.repeat(nodes + np.arange(len(face)), size))
    end.append(np.concatenate([outline[f] for f in face]) if len(face) else np.zeros(0, np.intp))
    return np.concatenate(start), np.concatenate(end)
