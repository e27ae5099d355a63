"""How the robot presses: the load cases, the engagement of the disk, the limits of the robot.

The load cases are those of the paper's section 4.1, as force on the robot in the tcp frame.
"""

import math
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, FiniteFloat, field_validator

from elastocal.arrays import FloatArray
from elastocal.cell.description._quantities import (
    Distance,
    Force,
    PositiveAngle,
    PositiveForce,
    PositiveLength,
    PositiveMass,
    SpanAngle,
)
from elastocal.errors import UnitError
from elastocal.records import StrictModel
from elastocal.units import parse_quantity

DIRECTIONS = {
    "normal": (0.0, 0.0, -1.0),
    "north": (1.0, 0.0, -1.0),
    "south": (-1.0, 0.0, -1.0),
    "east": (0.0, -1.0, -1.0),
    "west": (0.0, 1.0, -1.0),
}
"""Signs of (fx, fy, fz) in the force on the robot (spec section 2, load cases)."""
_CaseName = Literal["normal", "north", "south", "east", "west"]


class LoadCases(StrictModel):
    """Amplitudes, and which cases are applied at each pose."""

    fz: PositiveForce
    """Pressing force in N."""
    fx: Force = 0.0
    """Lateral force of north and south in N."""
    fy: Force = 0.0
    """Lateral force of east and west in N."""
    friction: Annotated[FiniteFloat, Field(gt=0.0, le=10.0)]
    """Coefficient of static friction between disk and surface."""
    safety: Annotated[FiniteFloat, Field(ge=1.0, le=100.0)] = 1.5
    """Factor by which the friction must exceed the lateral force."""
    cases: Annotated[tuple[_CaseName, ...], Field(validate_default=True)] = (
        "normal",
        "north",
        "south",
        "east",
        "west",
    )

    @field_validator("cases")
    @classmethod
    def _distinct(cls, cases: tuple[str, ...]) -> tuple[str, ...]:
        if not cases:
            raise ValueError("at least one load case is needed")
        if len(set(cases)) != len(cases):
            raise ValueError("a load case is named twice")
        return cases

    @field_validator("cases")
    @classmethod
    def _lateral_force_is_given(cls, cases: tuple[str, ...], info: Any) -> tuple[str, ...]:
        for axis, names in (("fx", {"north", "south"}), ("fy", {"east", "west"})):
            pushed = sorted(names & set(cases))
            if pushed and not info.data.get(axis, 1.0) > 0.0:
                raise ValueError(f"{' and '.join(pushed)} need {axis} above 0")
        return cases

    @property
    def force_tcp(self) -> FloatArray:
        """Force on the robot in each case, tcp frame, shape (load_case, 3), in N."""
        signs = np.array([DIRECTIONS[name] for name in self.cases])
        return signs * (self.fx, self.fy, self.fz)


class Engagement(StrictModel):
    """Contact disk, and the way to it."""

    disk_radius: PositiveLength
    """In m."""
    normal_tolerance: PositiveAngle = math.radians(3.0)
    """Largest angle between the disk's axis and the surface's normal under it, in rad."""
    edge_margin: Distance = 5e-3
    """Least distance from the rim of the disk to an edge of the surface, in m."""
    near_contact: PositiveLength = 3e-3
    """Distance from the surface at which the unloaded readings are taken, in m."""
    approach_distance: PositiveLength = 0.1
    """Distance of the approach pose A_i from the surface, along the normal, in m."""

    @field_validator("approach_distance")
    @classmethod
    def _behind_near_contact(cls, value: float, info: Any) -> float:
        near = info.data.get("near_contact", 0.0)
        if not value > near:
            raise ValueError(f"must be above near_contact ({near:g} m)")
        return value


class TorqueLimits(StrictModel):
    """Continuous torques of the actuators (paper 4.1).

    Catalogues give one figure, mostly without saying whether it is peak or continuous.
    """

    factor: Annotated[FiniteFloat, Field(gt=0.0, le=1.0)] = 1.0
    """Part of the figure that may be used for seconds on end."""
    values: dict[str, str] = Field(default_factory=dict)
    """Figure of each joint, by name; those of the robot's description by default."""
    provenance: Annotated[str | None, Field(validate_default=True)] = None
    """Where the figures are from; needed when there are any."""

    @field_validator("values")
    @classmethod
    def _positive(cls, values: dict[str, str]) -> dict[str, str]:
        for joint, text in values.items():
            if not _either(text) > 0.0:
                raise ValueError(f"{joint} must be above 0")
        return values

    def figure(self, joint: str, revolute: bool) -> float:
        """Return the figure of a joint that has one.

        Parameters
        ----------
        joint : str
            One of `values`.
        revolute : bool
            Whether it turns (a moment in N·m) or slides (a force in N).

        Raises
        ------
        UnitError
            If the figure is of the other kind.
        """
        text = self.values[joint]
        try:
            return parse_quantity(text, "moment" if revolute else "force")
        except UnitError as error:
            kind = "turns and has a moment" if revolute else "slides and has a force"
            raise UnitError(f"{joint} {kind}: {error}") from error

    @field_validator("provenance")
    @classmethod
    def _known_origin(cls, text: str | None, info: Any) -> str | None:
        if info.data.get("values") and not (text or "").strip():
            raise ValueError("say where the torque values are from")
        return text


class Limits(StrictModel):
    """Margins that every pose keeps."""

    joint_margin: SpanAngle = 0.0873
    """Least distance of a revolute joint to its limits, in rad."""
    rail_margin: Distance = 0.0
    """Least distance of a prismatic joint to its limits, in m."""
    singular_value: Annotated[FiniteFloat, Field(ge=0.0, le=1.0)] = 0.05
    """Least singular value of the length-scaled Jacobian, without dimension."""
    wrist_angle: SpanAngle = 0.1745
    """Least |A5|, in rad."""
    clearance: Distance = 0.0
    """Least distance between solids that must not touch, in m."""
    payload: PositiveMass | None = None
    """Largest mass that the flange may carry, in kg."""
    torque: TorqueLimits = TorqueLimits()


def _either(text: str) -> float:
    """Return a moment in N·m or a force in N: which one a joint has, only the robot knows."""
    return parse_quantity(text, "force" if text.rstrip().endswith("N") else "moment")
