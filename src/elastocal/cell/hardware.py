"""The hardware of the cell: robot with its tool, instruments, tooling surface, other solids."""

import math
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, field_validator, model_validator

from elastocal.arrays import BoolArray, FloatArray
from elastocal.cell._quantities import (
    IDENTITY,
    Direction,
    Length,
    Mass,
    Name,
    OptionalName,
    Point,
    Pose,
    PositiveAngleUpToPi,
    PositiveForce,
    PositiveLength,
    PositiveMoment,
    Range,
    Travel,
    check_exactly_one,
    unit_vector,
    vector,
)
from elastocal.errors import present
from elastocal.records import StrictModel
from elastocal.robot import GRAVITY
from elastocal.units import factor


class Box(StrictModel):
    """A box about its centre."""

    size: tuple[PositiveLength, PositiveLength, PositiveLength]
    """Edge lengths along x, y, z in m."""

    @property
    def extent(self) -> FloatArray:
        """The edge lengths, shape (3,), in m."""
        return vector(self.size)


class Cylinder(StrictModel):
    """A cylinder about its centre, along z."""

    radius: PositiveLength
    length: PositiveLength


class Sphere(StrictModel):
    """A sphere about its centre."""

    radius: PositiveLength


class MeshFile(StrictModel):
    """Triangles of a file."""

    file: str
    """STL, OBJ or PLY; relative to the cell file."""
    unit: str
    """Unit of the file's numbers: ``mm``, ``m`` or ``in``; mesh files do not say."""

    @model_validator(mode="after")
    def _known_unit(self) -> Self:
        factor(self.unit, "length")
        return self

    @property
    def metres(self) -> float:
        """Length of one unit of the file, in m."""
        return factor(self.unit, "length")


class Shape(StrictModel):
    """One solid with its place: a box, a cylinder, a sphere or a mesh."""

    name: OptionalName = ""
    pose: Pose = IDENTITY
    """Pose of the shape in its frame: the flange for parts of the tool, the base for fixtures."""
    box: Box | None = None
    cylinder: Cylinder | None = None
    sphere: Sphere | None = None
    mesh: MeshFile | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        check_exactly_one(box=self.box, cylinder=self.cylinder, sphere=self.sphere, mesh=self.mesh)
        return self

    @property
    def solid(self) -> Box | Cylinder | Sphere | MeshFile:
        """The one that is given."""
        return self.box or self.cylinder or self.sphere or present(self.mesh, "form of a body")


class RegionBox(StrictModel):
    """All points between two corners."""

    min: Point
    max: Point

    @field_validator("max")
    @classmethod
    def _above_min(cls, value: Any, info: Any) -> Any:
        lower = info.data.get("min", (-math.inf,) * 3)
        if not all(low < high for low, high in zip(lower, value, strict=True)):
            raise ValueError("every coordinate must be above that of min")
        return value


_Corner = tuple[Length, Length]


def _encloses(corners: tuple[_Corner, ...]) -> tuple[_Corner, ...]:
    x, y = np.array(corners).T
    area = 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    if not abs(area) > 0.0:
        raise ValueError("the polygon encloses no area")
    return corners


class RegionPolygon(StrictModel):
    """All points over or under a polygon in the x-y plane."""

    corners: Annotated[tuple[_Corner, ...], Field(min_length=3), AfterValidator(_encloses)]
    """In order, either way round; the last is joined to the first."""
    height: Travel | None = None
    """Lowest and highest z; all by default."""


class RegionEntry(StrictModel):
    """A box or a polygon that bounds where poses may be."""

    pose: Pose = IDENTITY
    """Pose of the box or polygon in the frame of the mesh."""
    box: RegionBox | None = None
    polygon: RegionPolygon | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        check_exactly_one(box=self.box, polygon=self.polygon)
        return self

    def contains(self, points_surface: FloatArray) -> BoolArray:
        """Return whether points lie in the region, shape (point,).

        Parameters
        ----------
        points_surface : ndarray, shape (point, 3)
            In the frame of the mesh, in m.
        """
        T = self.pose.T
        own = (np.asarray(points_surface, dtype=float) - T[:3, 3]) @ T[:3, :3]
        if self.box is not None:
            inside = (own >= self.box.min) & (own <= self.box.max)
            return np.asarray(inside.all(axis=1))
        polygon = present(self.polygon, "polygon")
        low, high = polygon.height or (-math.inf, math.inf)
        between = (own[:, 2] >= low) & (own[:, 2] <= high)
        return between & _in_polygon(own[:, :2], np.array(polygon.corners))


class SurfaceEntry(MeshFile):
    """The surface that the robot presses on."""

    pose: Pose = IDENTITY
    """Frame of the mesh in base."""
    region: RegionEntry | None = None
    flip_normals: bool = False
    """Turn the normals round; they must point to the robot's side."""
    crease_angle: PositiveAngleUpToPi = math.radians(30.0)
    """Adjacent faces whose normals differ by more meet in an edge that the disk must not
    overhang."""


def _in_polygon(points: FloatArray, corners: FloatArray) -> BoolArray:
    """Return whether a ray from each point along x crosses the polygon an odd number of times.

    Source: M. Shimrat, "Algorithm 112: Position of point relative to polygon", Communications
    of the ACM 5(8), 1962.
    """
    inside = np.zeros(len(points), dtype=bool)
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if y0 == y1:
            continue
        spans = (points[:, 1] < y0) != (points[:, 1] < y1)
        crossing = x0 + (points[:, 1] - y0) * (x1 - x0) / (y1 - y0)
        inside ^= spans & (points[:, 0] < crossing)
    return inside


class RailEntry(StrictModel):
    """A linear axis that carries the robot; its frame is then the base."""

    name: Name = "rail"
    """Name of its joint."""
    axis: Direction
    """Direction of positive travel in the rail's frame."""
    travel: Travel
    """Lower and upper end in m."""
    pose: Pose = IDENTITY
    """Foot of the robot in the rail's frame at travel zero."""


class RobotEntry(StrictModel):
    """A robot of the catalogue, or of a URDF file."""

    model: str | None = None
    """Catalogue name (`elastocal robots`)."""
    urdf: str | None = None
    """URDF file, relative to the cell file."""
    flange: str = "flange"
    """Link that carries the tool."""
    mounting: Pose = IDENTITY
    """Base in the world, whose z axis points up: a robot on the ceiling has c = 180 deg."""
    rail: RailEntry | None = None
    external: dict[str, Literal["search"] | tuple[str, ...]] = Field(default_factory=dict)
    """Positions of each external axis: ``search``, or a list; ``search`` by default."""

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        check_exactly_one(model=self.model, urdf=self.urdf)
        return self

    @property
    def gravity_base(self) -> FloatArray:
        """Acceleration of gravity in base, shape (3,), in m/s²."""
        gravity: FloatArray = self.mounting.T[:3, :3].T @ np.array(GRAVITY)
        return gravity

    @property
    def tilted_gravity(self) -> tuple[float, float, float] | None:
        """Acceleration of gravity in base, in m/s²; None where the base stands upright."""
        x, y, z = self.gravity_base.tolist()
        return None if np.allclose((x, y, z), GRAVITY, rtol=0.0, atol=1e-9) else (x, y, z)


class Tool(StrictModel):
    """Everything behind the flange, in the flange frame."""

    mass: Mass
    """Mass of all of it, in kg."""
    centre_of_mass: Point = (0.0, 0.0, 0.0)
    """In the flange frame, in m."""
    shapes: tuple[Shape, ...] = ()
    """Solids that must not touch anything, in the flange frame."""

    @property
    def centre(self) -> FloatArray:
        """Centre of mass in the flange frame, shape (3,), in m."""
        return vector(self.centre_of_mass)


class SensorEntry(StrictModel):
    """A force/torque sensor between flange and tool."""

    name: OptionalName = ""
    pose: Pose = IDENTITY
    """Pose of its measuring frame in the flange frame."""
    force_range: tuple[PositiveForce, PositiveForce, PositiveForce]
    """Largest force along each of its axes, in N."""
    moment_range: tuple[PositiveMoment, PositiveMoment, PositiveMoment]
    """Largest moment about each of its axes, in N·m."""

    @property
    def T_flange_sensor(self) -> FloatArray:
        """Measuring frame in the flange frame, shape (4, 4)."""
        return self.pose.T

    @property
    def largest_force(self) -> FloatArray:
        """Shape (3,), in N."""
        return vector(self.force_range)

    @property
    def largest_moment(self) -> FloatArray:
        """Shape (3,), in N·m."""
        return vector(self.moment_range)

    @property
    def ranges(self) -> FloatArray:
        """Largest forces and moments, shape (6,), in N and N·m."""
        return np.concatenate([self.largest_force, self.largest_moment])


class Tracker(StrictModel):
    """One tracker station and its position."""

    name: Name
    position: Point
    """Place of its beam's origin in base, in m; a rough value will do."""
    range: Range
    """Nearest and farthest marker that it measures, in m."""

    @property
    def position_base(self) -> FloatArray:
        """Shape (3,), in m."""
        return vector(self.position)


class Marker(StrictModel):
    """A reflector or a 6D probe on the tool."""

    position: Point
    """In the tcp frame, in m."""
    axis: Direction
    """Direction that it looks in, in the tcp frame."""
    acceptance: PositiveAngleUpToPi
    """Largest angle between that axis and the beam, in rad."""

    @property
    def position_tcp(self) -> FloatArray:
        """Shape (3,), in m."""
        return vector(self.position)

    @property
    def axis_tcp(self) -> FloatArray:
        """Unit vector, shape (3,)."""
        return unit_vector(self.axis)
