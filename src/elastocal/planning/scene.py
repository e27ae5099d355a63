"""The surface and the scene that a cell file describes.

The scene is the robot with its tool among tooling and fixtures, as collision geometry (coal,
through Pinocchio).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.random import Generator

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.cell import (
    TOOLING,
    Box as BoxEntry,
    Cell,
    Cylinder as CylinderEntry,
    Shape,
    Sphere as SphereEntry,
)
from elastocal.errors import PlanningError, RobotError
from elastocal.findings import Finding, Grade, Kind, as_number
from elastocal.planning.surface import (
    INVERTED,
    OF_WRONG_MESHES,
    ReachableFrom,
    Surface,
    arm_reach,
    first_joint_positions,
    flipped,
    load_surface,
    mesh_findings,
    placement_findings,
    read_mesh,
    size_findings,
    unit_findings,
)
from elastocal.results import brief_repr
from elastocal.robot import Robot, collision_model, tool_link
from elastocal.robot.inverse import inverse_for
from elastocal.shapes import Body, Box, Cylinder, Mesh, Solid, Sphere, box_corners, solid_of

_TILTED = np.radians(60.0)
"""Angle in rad between tool and last axis from which the user is asked to check it."""
_LEAST_TOOL = 5e-3
"""Distance of the tcp from the flange in m from which it shows which way the tool points."""
_INWARD = np.radians(120.0)
"""Angle between z of the tcp and the way to it from the flange beyond which no tool is bent."""
_NEIGHBOURS = 1
"""Links this many joints apart touch by construction and are not checked against each other."""


@brief_repr
@dataclass(frozen=True, eq=False)
class CollisionScene:
    """The bodies that must stay apart: links and tool from obstacles and from one another.

    Obstacles named in ``touched`` are those that the tool presses on: the tool is checked
    against them only where it is not in contact.
    """

    robot: Robot
    tool: tuple[Body, ...]
    obstacles: tuple[Body, ...]
    touched: frozenset[str] = frozenset()
    _model: pin.Model = field(init=False, repr=False)
    _geometry: pin.GeometryModel = field(init=False, repr=False)
    _tool_on_touched: BoolArray = field(init=False, repr=False)
    _columns: IndexArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        model, geometry = collision_model(self.robot)
        if geometry.ngeoms == 0:
            raise RobotError(f"robot {self.robot.name!r} has no collision shapes in its URDF")
        links = list(range(geometry.ngeoms))
        tool = _add(model, geometry, self.robot.tip, self.tool)
        obstacles = _add(model, geometry, self.robot.base, self.obstacles)
        pairs = _pairs(geometry, links, tool, obstacles)
        for pair in pairs:
            geometry.addCollisionPair(pin.CollisionPair(*pair))
        touched = {i for i in obstacles if geometry.geometryObjects[i].name in self.touched}
        on_touched = [a in tool and b in touched for a, b in pairs]
        object.__setattr__(self, "_model", model)
        object.__setattr__(self, "_geometry", geometry)
        object.__setattr__(self, "_tool_on_touched", np.array(on_touched, dtype=bool))
        columns = [model.joints[model.getJointId(name)].idx_q for name in self.robot.joint_names]
        object.__setattr__(self, "_columns", np.array(columns, dtype=np.intp))

    def keeps(self, q: FloatArray, distance: float, pressed: float | None = None) -> BoolArray:
        """Return whether all bodies that must stay apart keep a distance.

        Parameters
        ----------
        q : ndarray, shape (pose, joint)
            Joint positions in rad or m.
        distance : float
            In m.
        pressed : float, optional
            Distance that the tool keeps from what it presses on, in m; the same by default, and
            infinitely little (``-inf``) in contact, where it is not checked.

        Returns
        -------
        ndarray of bool, shape (pose,)
        """
        model, geometry = self._model, self._geometry
        data, results = model.createData(), geometry.createData()
        for pair, request in enumerate(results.collisionRequests):
            request.security_margin = distance
            if pressed is not None and self._tool_on_touched[pair]:
                request.security_margin = max(pressed, 0.0)
                if pressed < 0.0:
                    results.deactivateCollisionPair(pair)
        near = [
            pin.computeCollisions(model, data, geometry, results, configuration, True)
            for configuration in self._configurations(q)
        ]
        return np.logical_not(near)

    def nearest(self, q: FloatArray, pressed: bool = False) -> tuple[str, str]:
        """Return the names of the two bodies that are nearest to each other at one posture."""
        pair = self._geometry.collisionPairs[int(self.distances(q[None], pressed)[0].argmin())]
        names = [self._geometry.geometryObjects[i].name for i in (pair.first, pair.second)]
        return names[0], names[1]

    def distances(self, q: FloatArray, pressed: bool = False) -> FloatArray:
        """Return the exact distance of each pair, shape (pose, pair), in m.

        It is infinite between the tool and what it presses on where it is ``pressed``.
        """
        model, geometry = self._model, self._geometry
        data, results = model.createData(), geometry.createData()
        distances = np.empty((len(q), len(geometry.collisionPairs)))
        for row, configuration in zip(distances, self._configurations(q), strict=True):
            pin.computeDistances(model, data, geometry, results, configuration)
            row[:] = [result.min_distance for result in results.distanceResults]
        if pressed:
            distances[:, self._tool_on_touched] = np.inf
        return distances

    def _configurations(self, q: FloatArray) -> FloatArray:
        """Return the model's configurations, joints off the chain at neutral."""
        full = np.tile(pin.neutral(self._model), (len(q), 1))
        full[:, self._columns] = q
        return full

    def moving(self, q: FloatArray) -> list[Body]:
        """Return the links and then the tool where they are at many postures.

        Parameters
        ----------
        q : ndarray, shape (pose, joint)
            Joint positions in rad or m.

        Returns
        -------
        list of Body
            ``T_frame_body`` of each is its place in base at every posture, shape (pose, 4, 4).
        """
        model, data = self._model, self._model.createData()
        base = model.frames[model.getFrameId(self.robot.base, pin.FrameType.BODY)]
        T_world_joint = np.empty((len(q), model.njoints, 4, 4))
        for placements, configuration in zip(T_world_joint, self._configurations(q), strict=True):
            pin.forwardKinematics(model, data, configuration)
            placements[:] = [T.homogeneous for T in data.oMi]
        T_world_base = T_world_joint[:, base.parentJoint] @ base.placement.homogeneous
        T_base_joint = np.linalg.inv(T_world_base)[:, None] @ T_world_joint
        return [
            Body(body.name, solid, T_base_joint[:, body.parentJoint] @ body.placement.homogeneous)
            for body, solid in zip(self._geometry.geometryObjects, self._solids, strict=False)
        ]

    @cached_property
    def _solids(self) -> tuple[Solid, ...]:
        """The links and then the tool."""
        links = self._geometry.ngeoms - len(self.obstacles) - len(self.tool)
        bodies = list(self._geometry.geometryObjects)[:links]
        return (*(solid_of(link.geometry) for link in bodies), *(part.solid for part in self.tool))


def _add(
    model: pin.Model, geometry: pin.GeometryModel, link: str, bodies: Sequence[Body]
) -> list[int]:
    """Fix bodies to a link; return their numbers in the geometry model."""
    frame_id = model.getFrameId(link, pin.FrameType.BODY)
    frame = model.frames[frame_id]
    return [
        geometry.addGeometryObject(
            pin.GeometryObject(
                body.name,
                frame.parentJoint,
                frame_id,
                frame.placement * pin.SE3(body.T_frame_body),
                body.solid.geometry,
            )
        )
        for body in bodies
    ]


def _pairs(
    geometry: pin.GeometryModel, links: list[int], tool: list[int], obstacles: list[int]
) -> list[tuple[int, int]]:
    """Return links and tool against obstacles, and distant links against one another."""
    joint = [body.parentJoint for body in geometry.geometryObjects]
    moving = [*links, *tool]
    # Fixed solids may touch the tooling or the floor: that is not checked.
    outside = [(a, b) for a in moving if joint[a] > 0 for b in obstacles]
    inside = [
        (a, b)
        for i, a in enumerate(moving)
        for b in moving[i + 1 :]
        if abs(joint[a] - joint[b]) > _NEIGHBOURS
    ]
    return [*outside, *inside]


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


NO_MASSES = Kind(
    "plan.no-link-masses",
    "torques are not judged: the links of robot {name} have no masses (<inertial> in its URDF)",
    shown={"name": repr},
)
TILTED = Kind(
    "plan.tool-tilted",
    "z of the tcp, and of link {link}, points {direction}: if the tool points out of the arm,"
    " {advice}",
    shown={"link": repr},
)
TCP_INWARD = Kind(
    "plan.tcp-inward",
    "z of the tcp points back to the flange, {angle} deg from the way out of the tool: it must"
    " point into the surface; tcp.abc turns it",
    shown={"angle": as_number(".0f", 180.0 / np.pi)},
)
TOOL_BEYOND_TCP = Kind(
    "plan.tool-beyond-tcp",
    "{name} reaches {by} mm beyond the tcp along its z, and would stand in the surface: is the tcp"
    " where the tool touches (tcp.xyz)?",
    shown={"by": as_number(".3g", 1e3)},
)
OF_WRONG_CELLS = OF_WRONG_MESHES | {TCP_INWARD.name, TOOL_BEYOND_TCP.name}
"""Kinds that may be why no pose is found."""


def surface_findings(cell: Cell, surface: Surface, rng: Generator) -> tuple[Finding, ...]:
    """Return findings on the meshes, on the place of the surface, and on the arm.

    Parameters
    ----------
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
    found: list[Finding] = []
    for key, mesh in cell.file.meshes:
        path = cell.find(mesh.file)
        found += unit_findings(path, mesh.unit, key)
        if key != "surface":
            found += size_findings(path, mesh.metres, key, arm_reach(cell.robot))
    if not cell.robot.has_masses and np.isfinite(cell.torque_limits).any():
        found.append(NO_MASSES(name=cell.robot.name))
    of_tcp = _tcp_findings(cell)
    found += [*_tilted_findings(cell), *of_tcp]
    found += mesh_findings(surface)
    placed = placement_findings(
        surface,
        first_joint_positions(cell.robot, external),
        arm_reach(cell.robot),
        ReachableFrom(inverse_for(cell.robot), few),
        rng,
    )
    # With a tcp that points inwards the robot reaches the surface from the wrong side.
    inward = any(each.kind == TCP_INWARD.name for each in of_tcp)
    found += [each for each in placed if not (inward and each.kind == INVERTED.name)]
    for finding in found:
        if finding.grade is Grade.REFUSAL:
            raise PlanningError(finding)
    return tuple(found)


def _tilted_findings(cell: Cell) -> tuple[Finding, ...]:
    """Ask about a tool that points aside because its flange does; an angled tool is meant."""
    urdf, flange, tcp = cell.robot.urdf, cell.file.robot.flange, cell.robot.chain
    if not (tcp.tip_tilt > _TILTED and Robot.from_urdf(urdf, flange).chain.tip_tilt > _TILTED):
        return ()
    other = tool_link(urdf)  # The flange is no candidate: the tcp depends on it
    advice = "tcp.abc turns it" if other == tcp.tip else f"robot.flange is {other!r}"
    return (TILTED(link=flange, direction=tcp.tip_direction, advice=advice),)


def _tcp_findings(cell: Cell) -> tuple[Finding, ...]:
    """Return that z of the tcp points back into the tool, or that the tool is longer than it."""
    flange = cell.T_tcp_flange[:3, 3]
    if (away := float(np.linalg.norm(flange))) > _LEAST_TOOL:
        angle = float(np.arccos(np.clip(-flange[2] / away, -1.0, 1.0)))
        if angle > _INWARD:
            return (TCP_INWARD(angle=angle),)
    ends = {body.name: float(_corners(body)[:, 2].max()) for body in tool_bodies(cell)}
    name = max(ends, key=lambda each: ends[each], default="")
    if not name or not ends[name] > cell.file.engagement.near_contact:
        return ()
    return (TOOL_BEYOND_TCP(name=name, by=ends[name]),)


def _corners(body: Body) -> FloatArray:
    """Return the corners of a body's box in its frame, shape (8, 3), in m."""
    T = body.T_frame_body
    return np.asarray(box_corners(body.solid.geometry) @ T[:3, :3].T + T[:3, 3])


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
