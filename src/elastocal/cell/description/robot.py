"""The robot and its instruments: mounting, rail, tool, force sensor, marker and trackers."""

from typing import Literal, Self

from pydantic import Field, model_validator

from elastocal.arrays import FloatArray
from elastocal.cell.description._quantities import (
    IDENTITY,
    Direction,
    Mass,
    Point,
    Pose,
    PositiveAngle,
    PositiveForce,
    PositiveMoment,
    Range,
    Travel,
    check_exactly_one,
    unit_vector,
    vector,
)
from elastocal.cell.description.surface import Shape
from elastocal.records import StrictModel


class RailEntry(StrictModel):
    """A linear axis that carries the robot; its frame is then the base."""

    name: str = "rail"
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

    name: str = ""
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


class Tracker(StrictModel):
    """One station: where a tracker stands."""

    name: str
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
    acceptance: PositiveAngle
    """Largest angle between that axis and the beam, in rad."""

    @property
    def position_tcp(self) -> FloatArray:
        """Shape (3,), in m."""
        return vector(self.position)

    @property
    def axis_tcp(self) -> FloatArray:
        """Unit vector, shape (3,)."""
        return unit_vector(self.axis)
