"""Triangle meshes of what stands in a cell: the shapes that collisions are checked with.

Fine meshes of a maker's drawings are not needed to see how the robot stands; what is drawn here
is exactly what the collision check sees.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import coal
import numpy as np
import trimesh

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.cell import Cell
from elastocal.cell.description import TOOLING
from elastocal.planning import CollisionScene, collision_scene
from elastocal.planning.surface import Surface

_SECTIONS = 24
"""Sides of a drawn cylinder."""


@dataclass(frozen=True, eq=False)
class Solid:
    """Triangles; vertices in m."""

    vertices: FloatArray
    """Shape (vertex, 3)."""
    faces: IndexArray
    """Shape (face, 3)."""

    def placed(self, T: FloatArray) -> "Solid":
        """Return the solid moved by a transform, shape (4, 4)."""
        return Solid(self.vertices @ T[:3, :3].T + T[:3, 3], self.faces)

    def brightness(self, light: FloatArray) -> FloatArray:
        """Return how much light falls on each face, from 0 (turned away) to 1, shape (face,).

        Parameters
        ----------
        light : ndarray, shape (3,)
            Unit vector towards the light.
        """
        a, b, c = np.moveaxis(self.vertices[self.faces], 1, 0)
        normal = np.cross(b - a, c - a)
        length = np.linalg.norm(normal, axis=1)
        cosine = normal @ light / np.where(length > 0.0, length, 1.0)
        return np.asarray(0.5 + 0.5 * cosine)


@dataclass(frozen=True, eq=False)
class RobotSolids:
    """Links and tool of a robot; `at` places them."""

    scene: CollisionScene
    parts: tuple[Solid, ...]
    """Links, then tool, each in its own frame, as `CollisionScene.moving` orders them."""

    @property
    def on_tool(self) -> BoolArray:
        """Whether each face of the joined mesh is the tool's, shape (face,)."""
        links = len(self.parts) - len(self.scene.tool)
        sizes = [len(part.faces) for part in self.parts]
        return np.repeat(np.arange(len(self.parts)) >= links, sizes)

    def at(self, q: FloatArray) -> list[Solid]:
        """Return links and tool as one mesh in base, one a configuration.

        Parameters
        ----------
        q : ndarray, shape (pose, joint)
            Joint positions in rad or m, in the order of the robot's joints.
        """
        places = np.stack([body.T_frame_body for body in self.scene.moving(q)], axis=1)
        return [
            joined([part.placed(T) for part, T in zip(self.parts, row, strict=True)])
            for row in places
        ]


def robot_solids(cell: Cell, surface: Surface) -> RobotSolids:
    """Return the solids of a cell's robot and tool."""
    scene = collision_scene(cell, surface)
    nowhere = np.zeros((0, len(cell.robot.joint_names)))
    return RobotSolids(scene, tuple(solid_of(body.shape) for body in scene.moving(nowhere)))


def fixture_solids(cell: Cell, surface: Surface) -> dict[str, Solid]:
    """Return the fixtures of a cell in base, by name; not the tooling."""
    return {
        body.name: solid_of(body.shape).placed(body.T_frame_body)
        for body in collision_scene(cell, surface).obstacles
        if body.name != TOOLING
    }


def joined(solids: Sequence[Solid]) -> Solid:
    """Return several solids as one."""
    if not solids:
        return Solid(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.intp))
    starts = np.cumsum([0, *(len(solid.vertices) for solid in solids)])
    faces = [solid.faces + start for solid, start in zip(solids, starts, strict=False)]
    return Solid(np.concatenate([solid.vertices for solid in solids]), np.concatenate(faces))


def solid_of(shape: coal.CollisionGeometry) -> Solid:
    """Return the triangles of a collision shape; its bounding box when it is of a rare kind."""
    if isinstance(shape, coal.BVHModelBase):
        # A coal triangle is no sequence: it has no end.
        triangles = map(shape.tri_indices, range(shape.num_tris))
        faces = [(triangle[0], triangle[1], triangle[2]) for triangle in triangles]
        return Solid(np.array(shape.vertices()), np.array(faces, dtype=np.intp).reshape(-1, 3))
    mesh = _primitive(shape)
    return Solid(np.array(mesh.vertices), np.array(mesh.faces, dtype=np.intp))


def _primitive(shape: coal.CollisionGeometry) -> Any:
    """Return the trimesh of a shape that is not a mesh."""
    if isinstance(shape, coal.Cylinder):
        return trimesh.creation.cylinder(shape.radius, 2.0 * shape.halfLength, sections=_SECTIONS)
    if isinstance(shape, coal.Sphere):
        return trimesh.creation.icosphere(2, shape.radius)
    if isinstance(shape, coal.Capsule):
        return trimesh.creation.capsule(2.0 * shape.halfLength, shape.radius)
    if isinstance(shape, coal.Box):
        return trimesh.creation.box(2.0 * shape.halfSide)
    shape.computeLocalAABB()
    box = trimesh.creation.box(np.ptp([shape.aabb_local.min_, shape.aabb_local.max_], axis=0))
    return box.apply_translation(shape.aabb_center)
