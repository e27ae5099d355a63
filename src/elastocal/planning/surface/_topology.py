"""How the faces of a mesh hang together: open edges, creases, patches, smooth normals."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components

from elastocal.arrays import BoolArray, FloatArray, IndexArray


@dataclass(frozen=True, eq=False)
class Edges:
    """The edges of a mesh. Half-edge ``3 f + k`` runs from corner k of face f to the next one."""

    of_half_edge: IndexArray
    """Edge number of each half-edge, shape (3 face,)."""
    vertices: IndexArray
    """The two ends of each edge, lower number first, shape (edge, 2)."""
    count: IndexArray
    """Number of faces at each edge, shape (edge,)."""
    pairs: IndexArray
    """Half-edges of the edges that exactly two faces share, shape (pair, 2)."""
    opposed: BoolArray
    """Whether the two half-edges of a pair run against each other, as they should."""


def edges_of(faces: IndexArray) -> Edges:
    """Return the edges of a mesh.

    Parameters
    ----------
    faces : ndarray of int, shape (face, 3)
        Vertex numbers.
    """
    directed = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    vertices, of_half_edge, count = np.unique(
        np.sort(directed, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    of_half_edge = of_half_edge.reshape(-1)
    order = np.argsort(of_half_edge, kind="stable")
    first = np.cumsum(count) - count
    shared = first[count == 2]
    pairs = np.stack([order[shared], order[shared + 1]], axis=1)
    opposed = directed[pairs[:, 0], 0] != directed[pairs[:, 1], 0]
    return Edges(of_half_edge, vertices, count, pairs, opposed)


def wound_alike(faces: IndexArray) -> tuple[IndexArray, int]:
    """Return the faces with one sense of winding a connected part, and how many were turned.

    The sense that most faces of a part have is kept. A part that has no consistent winding (a
    Möbius strip) keeps some edges where it changes.

    Parameters
    ----------
    faces : ndarray of int, shape (face, 3)
        Vertex numbers.
    """
    edges = edges_of(faces)
    if edges.opposed.all():
        return faces, 0
    neighbours = np.sort(edges.pairs // 3, axis=1)
    clashing = {(int(a), int(b)) for a, b in neighbours[~edges.opposed]}
    graph = _graph(neighbours, len(faces))
    parts, part = connected_components(graph, directed=False)
    turned = np.zeros(len(faces), dtype=bool)
    for mixed in np.unique(part[neighbours[~edges.opposed, 0]]):
        order, before = breadth_first_order(graph, int(np.argmax(part == mixed)), directed=False)
        for face in order[1:].tolist():
            parent = int(before[face])
            turned[face] = turned[parent] ^ ((min(face, parent), max(face, parent)) in clashing)
    most = np.bincount(part, turned, parts) > 0.5 * np.bincount(part, minlength=parts)
    turned ^= most[part]
    faces = np.where(turned[:, None], faces[:, ::-1], faces)
    return faces, int(turned.sum())


def smooth_pairs(edges: Edges, face_normals: FloatArray, crease_angle: float) -> IndexArray:
    """Return the half-edge pairs over which the surface is smooth, shape (pair, 2).

    Parameters
    ----------
    edges : Edges
        Of the mesh.
    face_normals : ndarray, shape (face, 3)
        Unit normals.
    crease_angle : float
        Largest angle between the normals of two faces of one smooth patch, in rad.
    """
    normal = face_normals[edges.pairs // 3]
    # An arc cosine would lose the small angles; the chord of two unit vectors does not.
    chord = np.linalg.norm(normal[:, 0] - normal[:, 1], axis=1)
    angle = 2.0 * np.arcsin(np.minimum(1.0, 0.5 * chord))
    smooth: IndexArray = edges.pairs[edges.opposed & (angle <= crease_angle)]
    return smooth


def patches(smooth: IndexArray, faces: int) -> IndexArray:
    """Return the smooth patch that each face belongs to, shape (face,).

    Parameters
    ----------
    smooth : ndarray of int, shape (pair, 2)
        See `smooth_pairs`.
    faces : int
        Number of faces.
    """
    _, patch = connected_components(_graph(smooth // 3, faces), directed=False)
    return np.array(patch, dtype=np.intp)


def smoothing_groups(smooth: IndexArray, faces: int) -> IndexArray:
    """Return for each corner the group of corners that share a normal, shape (3 face,).

    Corners at one vertex are of one group when their faces are joined by smooth edges there.
    """
    following = smooth + np.where(smooth % 3 == 2, -2, 1)
    links = np.concatenate(
        [
            np.stack([smooth[:, 0], following[:, 1]], axis=1),
            np.stack([following[:, 0], smooth[:, 1]], axis=1),
        ]
    )
    _, groups = connected_components(_graph(links, 3 * faces), directed=False)
    return np.array(groups, dtype=np.intp)


def _graph(links: IndexArray, nodes: int) -> csr_array[np.float64]:
    there = np.ones(len(links))
    return coo_array((there, (links[:, 0], links[:, 1])), shape=(nodes, nodes)).tocsr()


def face_normals_and_areas(
    vertices: FloatArray, faces: IndexArray
) -> tuple[FloatArray, FloatArray]:
    """Return unit normals, shape (face, 3), and areas in m², shape (face,)."""
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    return normal / length[:, None], 0.5 * length


def corner_normals(
    vertices: FloatArray, faces: IndexArray, face_normals: FloatArray, groups: IndexArray
) -> FloatArray:
    """Return the angle-weighted mean normal at every corner of every face.

    ``n = Σ α_i n_i / |Σ α_i n_i|`` over the faces i of the corner's smoothing group, α_i their
    angles at the vertex; independent of how a flat part is cut into triangles.

    Source: G. Thürmer, C. A. Wüthrich, "Computing vertex normals from polygonal facets",
    Journal of Graphics Tools 3(1), 1998.

    Parameters
    ----------
    vertices : ndarray, shape (vertex, 3)
        In m.
    faces : ndarray of int, shape (face, 3)
        Vertex numbers.
    face_normals : ndarray, shape (face, 3)
        Unit normals.
    groups : ndarray of int, shape (3 face,)
        Smoothing group of each corner.

    Returns
    -------
    ndarray, shape (face, 3, 3)
        Unit normal of each corner (second axis) of each face.
    """
    corners = vertices[faces]
    along = np.roll(corners, -1, axis=1) - corners
    back = np.roll(corners, 1, axis=1) - corners
    sine = np.linalg.norm(np.cross(along, back), axis=2)
    angle = np.arctan2(sine, np.einsum("fki,fki->fk", along, back)).reshape(-1)
    weighted = angle[:, None] * np.repeat(face_normals, 3, axis=0)
    count = int(groups.max()) + 1
    total = np.stack([np.bincount(groups, weighted[:, i], count) for i in range(3)], axis=1)
    normal = total[groups].reshape(-1, 3, 3)
    result: FloatArray = normal / np.linalg.norm(normal, axis=2, keepdims=True)
    return result
