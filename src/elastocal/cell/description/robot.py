"""Which robot stands in the cell, how it is mounted, and on what it travels."""

from typing import Literal, Self

from pydantic import Field, model_validator

from elastocal.cell.description.pose import IDENTITY, Pose
from elastocal.cell.description.quantities import Direction, Travel, check_exactly_one
from elastocal.records import StrictModel


class RailEntry(StrictModel):
    """A linear axis that carries the robot; its frame is then the base."""

    name: str = "rail"
    """Of its joint."""
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
