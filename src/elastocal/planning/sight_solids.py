"""Collision shapes as solids that stop beams; triangle meshes are asked by ray casts."""

from collections.abc import Callable
from dataclasses import dataclass

import coal
import numpy as np
import trimesh

from elastocal.arrays import BoolArray, FloatArray
from elastocal.errors import RobotError
from elastocal.planning.sight_lines import Beams, Box, Capsule, Cylinder, Solid, Sphere

_closest_point: Callable[[FloatArray, FloatArray], FloatArray] = trimesh.triangles.closest_point
"""Of each triangle to its point; trimesh gives it no types."""


@dataclass(frozen=True, eq=False)
class Triangles:
    """A triangle mesh. Unless it is closed, with faces turned outward, nothing is under it."""

    mesh: trimesh.Trimesh

    def depth(self, point: FloatArray) -> float:
        """Return the distance to the nearest triangle, in m; 0 outside."""
        if not (self.mesh.is_volume and self.mesh.contains(point[None])[0]):
            return 0.0
        triangles = self.mesh.triangles
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


def solid_of(name: str, shape: coal.CollisionGeometry) -> Solid:
    """Return a collision shape as a solid.

    Parameters
    ----------
    name : str
        What to call it in an error.
    shape : coal.CollisionGeometry
        A box, cylinder, sphere, capsule or triangle mesh.

    Raises
    ------
    RobotError
        If it is something else.
    """
    if isinstance(shape, coal.Box):
        return Box(np.array(shape.halfSide))
    if isinstance(shape, coal.Sphere):
        return Sphere(float(shape.radius))
    if isinstance(shape, coal.Cylinder):
        return Cylinder(float(shape.radius), float(shape.halfLength))
    if isinstance(shape, coal.Capsule):
        return Capsule(float(shape.radius), float(shape.halfLength))
    if isinstance(shape, coal.BVHModelBase):
        return Triangles(_mesh_of(shape))
    raise RobotError(
        f"collision shape {name!r} is a {type(shape).__name__}: the line of sight knows Box, "
        "Capsule, Cylinder, Sphere and triangle meshes"
    )


def _mesh_of(shape: coal.BVHModelBase) -> trimesh.Trimesh:
    """Return the triangles with equal vertices made one, so that a closed mesh is found closed."""
    triangles = [shape.tri_indices(number) for number in range(shape.num_tris)]
    faces = [[corners[0], corners[1], corners[2]] for corners in triangles]
    return trimesh.Trimesh(np.array(shape.vertices()), faces, process=True)
