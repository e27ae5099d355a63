"""From a cell file to the objects that planning works with: surface, scene, checks."""

import math

import numpy as np
import trimesh
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
from elastocal.planning.checks import (
    Check,
    Checks,
    CollisionCheck,
    EdgeCheck,
    FlatnessCheck,
    FrictionCheck,
    JointLimitsCheck,
    MovingSolids,
    SensorCheck,
    SightCheck,
    SingularityCheck,
    Station,
    TorqueCheck,
    TravelLimitsCheck,
    WristCheck,
)
from elastocal.planning.scene import CollisionScene
from elastocal.planning.surface import (
    Finding,
    ReachableFrom,
    Surface,
    SurfacePoints,
    arm_reach,
    distance_to_boundary,
    first_joint_positions,
    fit_disk,
    flipped,
    load_surface,
    mesh_findings,
    placement_findings,
    read_mesh,
)
from elastocal.robot import has_wrist
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
    obstacles = (tooling, *_fixtures(cell))
    return CollisionScene(cell.robot, _tool(cell), obstacles, frozenset({TOOLING}))


def _fixtures(cell: Cell) -> tuple[Body, ...]:
    """Return the fixtures in base."""
    return tuple(
        _body(cell, shape, f"fixture {number}", np.eye(4))
        for number, shape in enumerate(cell.file.fixtures, start=1)
    )


def _tool(cell: Cell) -> tuple[Body, ...]:
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


def point_checks(
    cell: Cell, surface: Surface, points: SurfacePoints
) -> tuple[EdgeCheck, FlatnessCheck]:
    """Return the checks that sampled points decide alone.

    Parameters
    ----------
    cell : Cell
        The cell.
    surface : Surface
        What the robot presses on.
    points : SurfacePoints
        The sampled points that postures refer to.
    """
    engagement = cell.file.engagement
    radius = engagement.disk_radius
    return (
        EdgeCheck(distance_to_boundary(surface, points), radius, engagement.edge_margin),
        FlatnessCheck(fit_disk(surface, points, radius), engagement.normal_tolerance),
    )


def robot_checks(cell: Cell, surface: Surface) -> Checks:
    """Return the checks that postures decide: quick ones, and collision."""
    engagement = cell.file.engagement
    collision = CollisionCheck(
        collision_scene(cell, surface),
        cell.file.limits.clearance,
        engagement.approach_distance,
        engagement.near_contact,
    )
    seen, sensed = sight_check(cell, surface), _sensor_check(cell)
    torque = torque_check(cell)
    judged = torque if torque.judged else None
    optional: list[Check] = [check for check in (judged, sensed, seen) if check is not None]
    return Checks((), (*_joint_checks(cell), *optional), (collision,))


def _joint_checks(cell: Cell) -> tuple[Check, ...]:
    file, robot = cell.file, cell.robot
    loads, limits = file.load_cases, file.limits
    slides = not all(robot.revolute)
    travel = (TravelLimitsCheck(robot, cell.joint_margin),) if slides else ()
    wrist = (WristCheck(robot, limits.wrist_angle),) if has_wrist(robot) else ()
    return (
        JointLimitsCheck(robot, cell.joint_margin),
        *travel,
        SingularityCheck(robot, limits.singular_value),
        *wrist,
        FrictionCheck(loads.force_tcp, loads.friction, loads.safety),
    )


def torque_check(cell: Cell) -> TorqueCheck:
    """Return the check of the actuators; it knows which joints it can judge."""
    return TorqueCheck(
        cell.robot,
        cell.file.load_cases.force_tcp,
        cell.torque_limits,
        cell.file.tool.mass,
        cell.tool_centre_tcp,
        tuple(cell.gravity_base.tolist()),
    )


def _sensor_check(cell: Cell) -> SensorCheck | None:
    sensor, T_sensor_tcp = cell.file.sensor, cell.T_sensor_tcp
    if sensor is None or T_sensor_tcp is None:
        return None
    centre = T_sensor_tcp[:3, :3] @ cell.tool_centre_tcp + T_sensor_tcp[:3, 3]
    return SensorCheck(
        cell.file.load_cases.force_tcp,
        T_sensor_tcp,
        sensor.largest_force,
        sensor.largest_moment,
        cell.file.tool.mass * float(np.linalg.norm(cell.gravity_base)),
        float(np.linalg.norm(centre)),
    )


def sight_check(cell: Cell, surface: Surface) -> SightCheck | None:
    """Return the check that a station sees the marker; None without marker or stations."""
    marker, trackers = cell.file.marker, cell.file.trackers
    if marker is None or not trackers:
        return None
    stations = tuple(
        Station(tracker.name, tuple(tracker.position_base.tolist()), *map(float, tracker.range))
        for tracker in trackers
    )
    solids = [surface.rays, *(fixture.triangulated() for fixture in _fixtures(cell))]
    return SightCheck(
        stations,
        marker.position_tcp,
        marker.axis_tcp,
        min(marker.acceptance, math.pi),
        _joined(solids),
        MovingSolids(CollisionScene(cell.robot, _tool(cell), ()), marker.position_tcp),
    )


def _joined(meshes: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    joined = trimesh.util.concatenate(meshes)
    assert isinstance(joined, trimesh.Trimesh)
    return joined
