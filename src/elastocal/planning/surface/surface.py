"""The tooling surface S of the paper (2.2): triangles in base, their normals and their borders.

Faces are connected over edges; a smooth patch of the surface ends where an edge is open, shared by
more than two faces, or a crease.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Protocol

import numpy as np
import trimesh
from numpy.typing import ArrayLike
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.planning.postures import Rows, read_only
from elastocal.planning.surface.mesh import SurfaceError, TriangleMesh, read_mesh
from elastocal.results import brief_repr

CREASE_ANGLE = math.radians(30.0)
"""Angle between the normals of adjacent faces above which they meet in a crease, by default.

A tessellated dome has a few degrees between its faces, a machined edge 45° and more.
"""


class Region(Protocol):
    """A part of space; `elastocal.cell` has boxes and polygons.

    Its border is no border of the surface: a contact disk may reach over it.
    """

    def contains(self, points_surface: FloatArray) -> BoolArray:
        """Return whether points lie in the region.

        Parameters
        ----------
        points_surface : ndarray, shape (point, 3)
            In the frame of the surface's mesh, in m.

        Returns
        -------
        ndarray of bool, shape (point,)
        """


@brief_repr
@dataclass(frozen=True, eq=False)
class SurfacePoints(Rows):
    """Points on a surface."""

    position: FloatArray
    """In base, shape (point, 3), in m."""
    normal: FloatArray
    """Unit outward normals in base, shape (point, 3): the z axis of the tcp turned round."""
    face: IndexArray
    """Shape (point,)."""
    barycentric: FloatArray
    """Weights of the face's corners, shape (point, 3)."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Edges:
    """Edges of a mesh. Half-edge ``3 f + k`` runs from corner k of face f to the next one."""

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


@brief_repr
@dataclass(frozen=True, eq=False)
class Surface:
    """A tooling surface in base. Make one with `load_surface` or `build_surface`."""

    name: str
    mesh: TriangleMesh
    """Mesh in base, in m; faces of consistent winding."""
    crease_angle: float
    """In rad."""
    T_base_surface: FloatArray
    """Frame of the mesh file in base, shape (4, 4)."""
    region: Region | None = None
    """Where points may be sampled; everywhere by default."""
    turned: int = 0
    """Faces that were wound against their neighbours and have been turned."""

    @cached_property
    def _doubled_areas(self) -> FloatArray:
        """Normals of the faces, as long as twice their areas, shape (face, 3), in m²."""
        a, b, c = np.moveaxis(self.mesh.vertices[self.mesh.faces], 1, 0)
        return np.asarray(np.cross(b - a, c - a))

    @cached_property
    def face_normals(self) -> FloatArray:
        """Unit outward normals of the faces, shape (face, 3)."""
        normal = self._doubled_areas
        return np.asarray(normal / np.linalg.norm(normal, axis=1)[:, None])

    @cached_property
    def face_areas(self) -> FloatArray:
        """Shape (face,), in m²."""
        return np.asarray(0.5 * np.linalg.norm(self._doubled_areas, axis=1))

    @property
    def area(self) -> float:
        """Area of all faces, in m², whatever the region."""
        return float(self.face_areas.sum())

    @cached_property
    def edges(self) -> Edges:
        """The edges of the mesh."""
        return _edges_of(self.mesh.faces)

    @cached_property
    def _smooth(self) -> IndexArray:
        """The half-edge pairs over which the surface is smooth, shape (pair, 2)."""
        normal = self.face_normals[self.edges.pairs // 3]
        # An arc cosine would lose the small angles; the chord of two unit vectors does not.
        chord = np.linalg.norm(normal[:, 0] - normal[:, 1], axis=1)
        angle = 2.0 * np.arcsin(np.minimum(1.0, 0.5 * chord))
        return np.asarray(self.edges.pairs[self.edges.opposed & (angle <= self.crease_angle)])

    @cached_property
    def patch(self) -> IndexArray:
        """Smooth patch of each face: parts of the surface between open edges and creases."""
        _, patch = _parts(self._smooth // 3, len(self.mesh.faces))
        return patch

    @cached_property
    def corner_normals(self) -> FloatArray:
        """Smooth normals at the corners of the faces, shape (face, 3, 3); not over creases.

        The angle-weighted mean ``n = Σ α_i n_i / |Σ α_i n_i|`` over the faces i at the corner that
        smooth edges join, α_i their angles at the vertex; independent of the triangulation of a
        flat part.

        Source: G. Thürmer, C. A. Wüthrich, "Computing vertex normals from polygonal facets",
        Journal of Graphics Tools 3(1), 1998.
        """
        corners, smooth = self.mesh.vertices[self.mesh.faces], self._smooth
        # Corners at one vertex are in one group if smooth edges join their faces there.
        following = smooth + np.where(smooth % 3 == 2, -2, 1)
        links = np.stack([smooth.T, following[:, ::-1].T], axis=2).reshape(-1, 2)
        count, groups = _parts(links, 3 * len(corners))
        along = np.roll(corners, -1, axis=1) - corners
        back = np.roll(corners, 1, axis=1) - corners
        sine = np.linalg.norm(np.cross(along, back), axis=2)
        angle = np.arctan2(sine, np.einsum("fki,fki->fk", along, back)).reshape(-1)
        weighted = angle[:, None] * np.repeat(self.face_normals, 3, axis=0)
        total = np.stack([np.bincount(groups, weighted[:, i], count) for i in range(3)], axis=1)
        normal = total[groups].reshape(-1, 3, 3)
        return np.asarray(normal / np.linalg.norm(normal, axis=2, keepdims=True))

    @cached_property
    def border_half_edges(self) -> IndexArray:
        """Half-edges at which a patch ends: open edges, creases, non-manifold edges."""
        border = np.ones(3 * len(self.mesh.faces), dtype=bool)
        border[self._smooth.reshape(-1)] = False
        return np.flatnonzero(border)

    @property
    def open_edges(self) -> int:
        """Edges with one face only."""
        return int(np.sum(self.edges.count == 1))

    @property
    def non_manifold_edges(self) -> int:
        """Edges with three faces or more, or where the winding changes (a Möbius strip)."""
        return int(np.sum(self.edges.count > 2) + np.sum(~self.edges.opposed))

    @property
    def orientable(self) -> bool:
        """Whether the mesh has two sides; a Möbius strip has but one."""
        return bool(self.edges.opposed.all())

    @property
    def closed(self) -> bool:
        """Whether the mesh bounds a solid."""
        return self.open_edges == 0 and self.non_manifold_edges == 0

    @cached_property
    def signed_volume(self) -> float:
        """Volume in m³ that the faces enclose; negative if a closed mesh is inside out."""
        corners = self.mesh.vertices[self.mesh.faces] - self.mesh.vertices.mean(axis=0)
        return float(np.linalg.det(corners).sum() / 6.0)

    @cached_property
    def rays(self) -> trimesh.Trimesh:
        """The mesh as trimesh sees it, to cast rays at (with Embree where it is installed)."""
        return trimesh.Trimesh(self.mesh.vertices, self.mesh.faces, process=False)

    def points(self, face: IndexArray, barycentric: FloatArray) -> SurfacePoints:
        """Return points given by face and barycentric weights.

        Parameters
        ----------
        face : ndarray of int, shape (point,)
            Faces.
        barycentric : ndarray, shape (point, 3)
            Weights of the corners; each row adds up to 1.
        """
        corners = self.mesh.vertices[self.mesh.faces[face]]
        position = np.einsum("pk,pki->pi", barycentric, corners)
        return SurfacePoints(position, self.normals_at(face, barycentric), face, barycentric)

    def normals_at(self, face: IndexArray, barycentric: FloatArray) -> FloatArray:
        """Return smooth unit normals, interpolated between the corners, shape (point, 3)."""
        normal = np.einsum("pk,pki->pi", barycentric, self.corner_normals[face])
        result: FloatArray = normal / np.linalg.norm(normal, axis=1, keepdims=True)
        return result

    def in_region(self, points: SurfacePoints) -> np.ndarray:
        """Return whether points lie in the region, shape (point,)."""
        if self.region is None:
            return np.ones(len(points), dtype=bool)
        R, p = self.T_base_surface[:3, :3], self.T_base_surface[:3, 3]
        return self.region.contains((points.position - p) @ R)


def load_surface(
    path: Path,
    unit: float,
    T_base_surface: ArrayLike,
    region: Region | None = None,
    crease_angle: float = CREASE_ANGLE,
) -> Surface:
    """Return the surface of a mesh file.

    Parameters
    ----------
    path : Path
        STL, OBJ or PLY.
    unit : float
        Length of one unit of the file, in m.
    T_base_surface : array_like, shape (4, 4)
        Frame of the file in base; translation in m.
    region : Region, optional
        Where points may be sampled.
    crease_angle : float
        In rad; see `CREASE_ANGLE`.

    Raises
    ------
    SurfaceError, FileAccessError
        See `elastocal.planning.surface.mesh.read_mesh`.
    """
    mesh = read_mesh(path, unit)
    return build_surface(mesh, T_base_surface, region, crease_angle, str(path))


def build_surface(
    mesh: TriangleMesh,
    T_base_surface: ArrayLike = np.eye(4),  # noqa: B008 - read, never written
    region: Region | None = None,
    crease_angle: float = CREASE_ANGLE,
    name: str = "surface",
) -> Surface:
    """Return the surface of triangles in their own frame; see `load_surface`.

    Raises
    ------
    SurfaceError
        If the crease angle is not between 0 and π.
    """
    if not 0.0 < crease_angle < math.pi:
        raise SurfaceError(f"crease angle {crease_angle!r} rad: must be above 0 and below π")
    T = read_only(T_base_surface)
    faces, turned = _wound_alike(mesh.faces)
    vertices = read_only(mesh.vertices @ T[:3, :3].T + T[:3, 3])
    placed = replace(mesh, vertices=vertices, faces=read_only(faces, np.intp))
    return Surface(name, placed, crease_angle, T, region, turned)


def flipped(surface: Surface) -> Surface:
    """Return the surface with its outside in: every normal turned round."""
    mesh = replace(surface.mesh, faces=surface.mesh.faces[:, ::-1])
    return replace(surface, mesh=mesh)


def _edges_of(faces: IndexArray) -> Edges:
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


def _wound_alike(faces: IndexArray) -> tuple[IndexArray, int]:
    """Return the faces with one winding for each connected part, and the number of reversed ones.

    The winding of most faces of a part is kept. A part that has no consistent winding (a Möbius
    strip) keeps some edges where it changes.

    Parameters
    ----------
    faces : ndarray of int, shape (face, 3)
        Vertex numbers.
    """
    edges = _edges_of(faces)
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


def _parts(links: IndexArray, nodes: int) -> tuple[int, IndexArray]:
    """Return the number of connected parts of a graph, and the part of each node."""
    count, part = connected_components(_graph(links, nodes), directed=False)
    return int(count), np.array(part, dtype=np.intp)


def _graph(links: IndexArray, nodes: int) -> csr_array[np.float64]:
    there = np.ones(len(links))
    return coo_array((there, (links[:, 0], links[:, 1])), shape=(nodes, nodes)).tocsr()
