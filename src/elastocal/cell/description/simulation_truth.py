"""Stiffness of the simulated robot: what the calibration is to find out, and what it cannot."""

import math
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, FiniteFloat, field_validator

from elastocal.cell.description.quantities import PositiveLength, SpanAngle
from elastocal.records import StrictModel
from elastocal.units import parse_quantity

RotationalStiffness = Annotated[
    float,
    BeforeValidator(lambda text: parse_quantity(text, "rotational stiffness")),
    Field(gt=0.0),
]
"""In N·m/rad, above 0."""
TranslationalStiffness = Annotated[
    float,
    BeforeValidator(lambda text: parse_quantity(text, "translational stiffness")),
    Field(gt=0.0),
]
"""In N/m, above 0."""
Scale = Annotated[FiniteFloat, Field(gt=0.0)]
"""A factor, above 0."""
PartBelowHalf = Annotated[FiniteFloat, Field(ge=0.0, lt=0.5)]
"""From 0 to below a half, without dimension."""
_SIX = Field(min_length=6, max_length=6)


class TruthScale(StrictModel):
    """Factors on the stiffness of parts; 2 makes them twice as stiff."""

    gears: Scale = 1.0
    bearings: Scale = 1.0
    links: Scale = 1.0
    balancer: Scale = 1.0
    floor: Scale = 1.0
    external: Scale = 1.0
    end_effector: Scale = 1.0


class Gears(StrictModel):
    """Gears of the six arm joints (`elastocal.sim.workcell.springs`)."""

    stiffness: Annotated[tuple[RotationalStiffness, ...], _SIX] | None = None
    """At high torque, in N·m/rad; by default those of a 1.1 t arm, scaled with the moved mass."""
    growth: PartBelowHalf = 0.2
    """How much softer a gear is at rest, over its stiffness at high torque."""
    growth_angle: Annotated[SpanAngle, Field(gt=0.0)] = 3e-4
    """Twist at which it is half way between the two, in rad."""
    backlash: SpanAngle = 3e-5
    """Twist that is lost between a torque and its opposite, in rad; there the gear is soft, not
    free."""
    hysteresis: Annotated[FiniteFloat, Field(ge=0.0, lt=0.3)] = 0.03
    """Friction in the gear over its torque at `reference_angle`: half the height of its loop."""
    reference_angle: Annotated[SpanAngle, Field(gt=0.0)] = 5e-4
    """In rad."""
    presliding: Annotated[SpanAngle, Field(gt=0.0)] = 6e-5
    """Twist from rest after which the friction is at its full height, in rad."""


class Bearings(StrictModel):
    """Tilt of the bearings."""

    ratio: tuple[Scale, Scale] = (4.0, 6.0)
    """Stiffness of the two tilts over that of the joint's gear."""


class Links(StrictModel):
    """Bending of the two long links."""

    bending: RotationalStiffness | None = None
    """Of a hinge in the middle of the link, in N·m/rad; by default that of a 1.1 t arm, scaled
    with the moved mass."""


class Balancer(StrictModel):
    """Spring between carousel and arm, beside the gear of axis 2."""

    rate: TranslationalStiffness | None = None
    """Of the spring, in N/m; by default one that carries about 3 kN·m of a 1.1 t arm stretched
    out, scaled with the moved mass."""
    free_length: PositiveLength = 0.3
    """In m."""
    anchor: PositiveLength = 0.6
    """Distance of its end on the carousel from axis 2, in m."""
    lever: PositiveLength = 0.18
    """Distance of its end on the arm from axis 2, in m; below ``anchor``."""
    fitted: bool = True
    """Whether the robot has one."""

    @field_validator("lever")
    @classmethod
    def _below_anchor(cls, value: float, info: Any) -> float:
        anchor = info.data.get("anchor", math.inf)
        if not value < anchor:
            raise ValueError(f"must be below anchor ({anchor:g} m)")
        return value


class Floor(StrictModel):
    """What the robot stands on: foundation, rail carriage, base frame."""

    tilt: RotationalStiffness = 4e7
    """About each of three axes through the foot, in N·m/rad."""


class ExternalAxes(StrictModel):
    """Drives of the axes before the arm."""

    linear: TranslationalStiffness = 4e7
    """Of a rail's drive, in N/m."""
    turning: RotationalStiffness = 8e6
    """Of a turntable's drive, in N·m/rad."""


class EndEffector(StrictModel):
    """Tool between sensor and tool centre point."""

    turn: RotationalStiffness = 2.5e6
    """About each axis of the sensor's frame, in N·m/rad."""
    shift: TranslationalStiffness = 8e7
    """Along each axis, in N/m."""
