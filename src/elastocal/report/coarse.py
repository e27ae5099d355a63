"""Meshes that are too fine to be drawn, made coarser: by clusters of vertices.

Source: J. Rossignac, P. Borrel, "Multi-resolution 3D approximations for rendering complex scenes",
in Modeling in Computer Graphics, Springer, 1993. Vertices in one cell of a grid become their
mean; faces and edges that lose a corner go.
"""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.report.solids import Solid

MOST_OF_TOOLING = 60_000
"""Faces of the tooling that an interactive page draws; its file would grow by 40 bytes a face."""
MOST_OF_FIXTURE = 20_000
"""Faces of one fixture."""
MOST_OF_LINK = 3_000
"""Faces of one part of the robot, whose vertices the page holds for every posture."""
_COARSER = 1.25
"""By how much the cells grow until there are few enough faces."""


@dataclass(frozen=True, eq=False)
class Coarse:
    """A mesh as it is drawn."""

    solid: Solid
    cluster: IndexArray
    """Vertex of the drawn solid that each vertex of the whole one went into, shape (vertex,)."""
    whole: int
    """Faces of the whole mesh."""

    def edges(self, ends: IndexArray) -> IndexArray:
        """Return which edges of the whole mesh are left, each once, shape (edge, 2).

        Parameters
        ----------
        ends : ndarray of int, shape (edge, 2)
            Vertex numbers of the whole mesh.
        """
        drawn = np.sort(self.cluster[ends], axis=1)
        return np.unique(drawn[drawn[:, 0] < drawn[:, 1]], axis=0)

    def note(self, what: str) -> str:
        """Return what to tell of it; nothing when it is drawn whole."""
        drawn = len(self.solid.faces)
        if drawn == self.whole:
            return ""
        return f"{what} is drawn with {drawn} faces in place of {self.whole}."


def coarse(solid: Solid, most: int) -> Coarse:
    """Return a solid with no more than a number of faces.

    Parameters
    ----------
    solid : Solid
        Its vertices are welded.
    most : int
        Faces, at least 56. A solid that has no more stays as it is.
    """
    count = len(solid.faces)
    if count <= most:
        return Coarse(solid, np.arange(len(solid.vertices)), count)
    a, b = solid.vertices[solid.faces[:, 0]], solid.vertices[solid.faces[:, 1]]
    size = float(np.ptp(solid.vertices, axis=0).max())
    middling = float(np.median(np.linalg.norm(b - a, axis=1)))
    cell = max(middling, 1e-6 * size) * np.sqrt(count / most)
    # Two cells along each side make eight vertices, and those no more than 56 triangles.
    coarsest = 0.51 * size
    while True:
        cell = min(cell, coarsest)
        cluster, vertices = _clusters(solid.vertices, cell)
        faces = _left(cluster[solid.faces])
        if len(faces) <= most or cell == coarsest:
            return Coarse(Solid(vertices, faces), cluster, count)
        cell *= _COARSER


def _clusters(vertices: FloatArray, cell: float) -> tuple[IndexArray, FloatArray]:
    """Return the cluster of each vertex, and the mean of each cluster."""
    place = np.floor((vertices - vertices.min(axis=0)) / cell).astype(np.int64)
    _, cluster, count = np.unique(place, axis=0, return_inverse=True, return_counts=True)
    cluster = cluster.reshape(-1)
    sums = [np.bincount(cluster, vertices[:, axis]) for axis in range(3)]
    return cluster, np.stack(sums, axis=1) / count[:, None]


def _left(faces: IndexArray) -> IndexArray:
    """Return the faces with three different corners, each once."""
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    return faces[np.sort(first)]
