"""Triangle meshes, which ray casts ask where beams meet them; and collision geometry as solids."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import coal
import numpy as np
import trimesh

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.shapes.convex import Box, Capsule, Cylinder, Sphere
from elastocal.shapes.solid import Beams, OtherSolid, SightSolid, Solid

_closest_point: Callable[[FloatArray, FloatArray], FloatArray] = trimesh.triangles.closest_point
"""Return the point of each triangle nearest to its point; trimesh gives it no types."""


@dataclass(frozen=True, eq=False)
class Mesh(SightSolid):
    """A triangle mesh. Unless it is closed, with faces turned outward, nothing is under it."""

    mesh: trimesh.Trimesh

    @staticmethod
    def of(vertices: FloatArray, faces: IndexArray) -> "Mesh":
        """Return the mesh of vertices, shape (vertex, 3), in m, and faces, shape (face, 3)."""
        return Mesh(trimesh.Trimesh(vertices, faces, process=False))

    @cached_property
    def geometry(self) -> coal.CollisionGeometry:
        """The triangles for collision checks, in a hierarchy of bounding volumes."""
        points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
        for vertex in np.asarray(self.mesh.vertices, dtype=float):
            points.append(vertex)
        for a, b, c in np.asarray(self.mesh.faces):
            triangles.append(coal.Triangle(int(a), int(b), int(c)))
        geometry = coal.BVHModelOBBRSS()
        geometry.beginModel(len(triangles), len(points))
        geometry.addSubModel(points, triangles)
        geometry.endModel()
        return geometry

    def triangulated(self, sections: int = 32) -> trimesh.Trimesh:  # noqa: ARG002 - it is as it is
        """Return the triangles."""
        return self.mesh

    @cached_property
    def _welded(self) -> trimesh.Trimesh:
        """The mesh with equal vertices made one, so that a closed mesh is found closed."""
        return trimesh.Trimesh(self.mesh.vertices, self.mesh.faces, process=True)

    def depth(self, point: FloatArray) -> float:
        """Return the distance to the nearest triangle, in m; 0 outside."""
        if not (self._welded.is_volume and self._welded.contains(point[None])[0]):
            return 0.0
        triangles = self._welded.triangles
        nearest = _closest_point(triangles, np.tile(point, (len(triangles), 1)))
        return float(np.linalg.norm(nearest - point, axis=1).min())

    def crosses(self, beams: Beams, seat: float) -> BoolArray:
        """Return which beams meet a triangle beyond ``seat`` (in m) from their start."""
        start = beams.start + seat * beams.direction
        return self._meets(Beams(start, beams.direction, beams.length - seat), into=False)

    def crosses_again(self, beams: Beams) -> BoolArray:
        """Return which beams meet a triangle from its outer side."""
        return self._meets(beams, into=True)

    def _meets(self, beams: Beams, into: bool) -> BoolArray:
        met = np.zeros(len(beams), dtype=bool)
        if not len(beams):
            return met
        rays = self.mesh.ray
        where, beam, face = rays.intersects_location(beams.start, beams.direction, into)
        near = np.linalg.norm(where - beams.start[beam], axis=1) < beams.length[beam]
        if into:
            outward = self.mesh.face_normals[face]
            near &= np.sum(outward * beams.direction[beam], axis=1) < 0.0
        met[beam[near]] = True
        return met


def solid_of(geometry: coal.CollisionGeometry) -> Solid:
    """Return a collision geometry, such as a URDF's, as a solid."""
    if isinstance(geometry, coal.Box):
        return Box(*(2.0 * np.array(geometry.halfSide)).tolist())
    if isinstance(geometry, coal.Sphere):
        return Sphere(float(geometry.radius))
    if isinstance(geometry, coal.Cylinder):
        return Cylinder(float(geometry.radius), 2.0 * float(geometry.halfLength))
    if isinstance(geometry, coal.Capsule):
        return Capsule(float(geometry.radius), 2.0 * float(geometry.halfLength))
    if isinstance(geometry, coal.BVHModelBase):
        # A coal triangle is no sequence: it has no end.
        triangles = map(geometry.tri_indices, range(geometry.num_tris))
        faces = [(corners[0], corners[1], corners[2]) for corners in triangles]
        return Mesh.of(np.array(geometry.vertices()), np.array(faces, dtype=np.intp).reshape(-1, 3))
    return OtherSolid(geometry)
