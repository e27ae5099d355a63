"""Normals: of the faces, and smooth ones at their corners that stop at creases."""

import numpy as np

from elastocal.arrays import FloatArray, IndexArray


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
