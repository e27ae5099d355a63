"""The tooling surface S of the paper (2.2): triangles in base, their normals and their borders."""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Protocol

import numpy as np
import trimesh
from numpy.typing import ArrayLike

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.planning.postures import Rows
from elastocal.planning.surface import _topology as topology
from elastocal.planning.surface._topology import corner_normals, face_normals_and_areas
from elastocal.planning.surface.mesh import SurfaceError, TriangleMesh, read_mesh
from elastocal.results import brief_repr

CREASE_ANGLE = math.radians(30.0)
"""Normals of neighbouring faces further apart than this meet in a crease, by default.

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
class Surface:
    """A tooling surface in base. Make one with `load_surface` or `build_surface`."""

    name: str
    mesh: TriangleMesh
    """In base, in m; faces wound alike."""
    crease_angle: float
    """In rad."""
    T_base_surface: FloatArray
    """Frame of the mesh file in base, shape (4, 4)."""
    region: Region | None = None
    """Where points may be sampled; everywhere by default."""
    turned: int = 0
    """Faces that were wound against their neighbours and have been turned."""

    @cached_property
    def _normals_and_areas(self) -> tuple[FloatArray, FloatArray]:
        return face_normals_and_areas(self.mesh.vertices, self.mesh.faces)

    @property
    def face_normals(self) -> FloatArray:
        """Unit outward normals of the faces, shape (face, 3)."""
        return self._normals_and_areas[0]

    @property
    def face_areas(self) -> FloatArray:
        """Shape (face,), in m²."""
        return self._normals_and_areas[1]

    @property
    def area(self) -> float:
        """Area of all faces, in m², whatever the region."""
        return float(self.face_areas.sum())

    @cached_property
    def edges(self) -> topology.Edges:
        """The edges of the mesh."""
        return topology.edges_of(self.mesh.faces)

    @cached_property
    def _smooth(self) -> IndexArray:
        return topology.smooth_pairs(self.edges, self.face_normals, self.crease_angle)

    @cached_property
    def patch(self) -> IndexArray:
        """Smooth patch of each face: parts of the surface between open edges and creases."""
        return topology.patches(self._smooth, len(self.mesh.faces))

    @cached_property
    def corner_normals(self) -> FloatArray:
        """Smooth normals at the corners of the faces, shape (face, 3, 3); not over creases."""
        groups = topology.smoothing_groups(self._smooth, len(self.mesh.faces))
        mesh = self.mesh
        return corner_normals(mesh.vertices, mesh.faces, self.face_normals, groups)

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
        """Volume in m³ that the faces bound; negative when a closed mesh is inside out."""
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
    T = np.array(T_base_surface, dtype=float)
    faces, turned = topology.wound_alike(mesh.faces)
    vertices = mesh.vertices @ T[:3, :3].T + T[:3, 3]
    for array in (T, vertices, faces):
        array.setflags(write=False)
    placed = replace(mesh, vertices=vertices, faces=faces)
    return Surface(name, placed, crease_angle, T, region, turned)


def flipped(surface: Surface) -> Surface:
    """Return the surface with its outside in: every normal turned round."""
    mesh = replace(surface.mesh, faces=surface.mesh.faces[:, ::-1])
    return replace(surface, mesh=mesh)
