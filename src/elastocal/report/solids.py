"""Triangle meshes of what stands in a cell: the shapes that collisions are checked with.

Fine meshes of a maker's drawings are not needed to see how the robot stands; what is drawn here
is exactly what the collision check sees.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import trimesh

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import Cell
from elastocal.planning.cell_checks import TOOLING, collision_scene
from elastocal.planning.surface import Surface
from elastocal.robot import Robot

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

    robot: Robot
    links: tuple[Solid, ...]
    """Each in its own geometry frame, as the URDF orders them."""
    tool: tuple[Solid, ...]
    """In the tcp frame."""

    @property
    def on_tool(self) -> np.ndarray:
        """Whether each face of the joined mesh is the tool's, shape (face,)."""
        parts = [(part, False) for part in self.links] + [(part, True) for part in self.tool]
        return np.repeat([tool for _, tool in parts], [len(part.faces) for part, _ in parts])

    def at(self, q: Sequence[FloatArray] | FloatArray) -> list[Solid]:
        """Return links and tool as one mesh in base, one a configuration.

        Parameters
        ----------
        q : array_like, shape (pose, joint)
            Joint positions in rad or m, in the order of the robot's joints.
        """
        configurations = np.asarray(q, dtype=float)
        tcp = self.robot.forward(configurations)
        return [
            joined(
                [link.placed(T) for link, T in zip(self.links, places, strict=True)]
                + [part.placed(T_base_tcp) for part in self.tool]
            )
            for places, T_base_tcp in zip(
                _link_places(self.robot, configurations), tcp, strict=True
            )
        ]


def robot_solids(cell: Cell, surface: Surface) -> RobotSolids:
    """Return the solids of a cell's robot and tool."""
    _, geometry = _geometry(cell.robot)
    links = tuple(solid_of(body.geometry) for body in geometry.geometryObjects)
    parts = collision_scene(cell, surface).tool
    tool = tuple(solid_of(part.shape).placed(part.T_frame_body) for part in parts)
    return RobotSolids(cell.robot, links, tool)


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
        faces = [tuple(shape.tri_indices(i)) for i in range(shape.num_tris)]
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


def _geometry(robot: Robot) -> tuple[pin.Model, pin.GeometryModel]:
    model = pin.buildModelFromXML(robot.urdf)
    return model, pin.buildGeomFromUrdfString(model, robot.urdf, pin.GeometryType.COLLISION)


def _link_places(robot: Robot, q: FloatArray) -> FloatArray:
    """Return where the robot's shapes are in base, shape (pose, shape, 4, 4)."""
    model, geometry = _geometry(robot)
    data, places = model.createData(), geometry.createData()
    columns = [model.joints[model.getJointId(name)].idx_q for name in robot.joint_names]
    full = np.tile(pin.neutral(model), (len(q), 1))
    full[:, columns] = q
    base = model.getFrameId(robot.base, pin.FrameType.BODY)
    found = np.empty((len(q), geometry.ngeoms, 4, 4))
    for row, configuration in zip(found, full, strict=True):
        pin.updateGeometryPlacements(model, data, geometry, places, configuration)
        T_base_world = pin.updateFramePlacement(model, data, base).inverse()
        row[:] = [(T_base_world * placement).homogeneous for placement in places.oMg]
    return found
