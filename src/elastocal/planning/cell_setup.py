"""From a cell file to the objects that planning works with: surface and scene."""

import numpy as np
from numpy.random import Generator

from elastocal.arrays import FloatArray
from elastocal.cell import (
    TOOLING,
    Box as BoxEntry,
    Cell,
    Cylinder as CylinderEntry,
    Shape,
    Sphere as SphereEntry,
)
from elastocal.errors import PlanningError
from elastocal.planning.scene import CollisionScene
from elastocal.planning.surface import (
    Finding,
    ReachableFrom,
    Surface,
    arm_reach,
    first_joint_positions,
    flipped,
    load_surface,
    mesh_findings,
    placement_findings,
    read_mesh,
)
from elastocal.robot.inverse import inverse_for
from elastocal.shapes import Body, Box, Cylinder, Mesh, Solid, Sphere


def cell_surface(cell: Cell) -> Surface:
    """Return the surface that the cell file names, in base, its normals as it says.

    Raises
    ------
    SurfaceError, FileAccessError
        If the mesh cannot be read.
    """
    entry = cell.file.surface
    surface = load_surface(
        cell.surface_path, entry.metres, cell.T_base_surface, entry.region, entry.crease_angle
    )
    return flipped(surface) if entry.flip_normals else surface


def surface_findings(cell: Cell, surface: Surface, rng: Generator) -> tuple[Finding, ...]:
    """Return what a user should know of the mesh and of where it stands.

    Parameters
    ----------
    cell : Cell
        The cell.
    surface : Surface
        Its surface.
    rng : Generator
        Seeded source of randomness, for the points that are tried.

    Raises
    ------
    PlanningError
        If planning on this surface cannot lead anywhere.
    SurfaceError
        If the region holds no part of the surface.
    """
    external = cell.external_positions
    # The middle and the ends of a grid will do to see from which side the robot can work.
    few = external[np.unique(np.linspace(0, len(external) - 1, 3).astype(int))]
    found = mesh_findings(surface) + placement_findings(
        surface,
        first_joint_positions(cell.robot, external),
        arm_reach(cell.robot),
        ReachableFrom(inverse_for(cell.robot), few),
        rng,
    )
    for finding in found:
        if finding.fatal:
            raise PlanningError(finding.message)
    return found


def collision_scene(cell: Cell, surface: Surface) -> CollisionScene:
    """Return robot and tool among tooling and fixtures."""
    tooling = Body(TOOLING, Mesh(surface.rays), np.eye(4))
    obstacles = (tooling, *fixture_bodies(cell))
    return CollisionScene(cell.robot, tool_bodies(cell), obstacles, frozenset({TOOLING}))


def fixture_bodies(cell: Cell) -> tuple[Body, ...]:
    """Return the fixtures in base."""
    return tuple(
        _body(cell, shape, f"fixture {number}", np.eye(4))
        for number, shape in enumerate(cell.file.fixtures, start=1)
    )


def tool_bodies(cell: Cell) -> tuple[Body, ...]:
    """Return the tool's shapes in the tcp frame."""
    return tuple(
        _body(cell, shape, f"tool {number}", cell.T_tcp_flange)
        for number, shape in enumerate(cell.file.tool.shapes, start=1)
    )


def _body(cell: Cell, shape: Shape, name: str, T_frame: FloatArray) -> Body:
    return Body(shape.name or name, _solid(cell, shape), T_frame @ shape.pose.T)


def _solid(cell: Cell, shape: Shape) -> Solid:
    """Return a shape of a cell file as a solid."""
    given = shape.solid
    if isinstance(given, BoxEntry):
        return Box(*given.size)
    if isinstance(given, CylinderEntry):
        return Cylinder(given.radius, given.length)
    if isinstance(given, SphereEntry):
        return Sphere(given.radius)
    mesh = read_mesh(cell.find(given.file), given.metres)
    return Mesh.of(mesh.vertices, mesh.faces)
