"""How Procedure 1 is carried out: speeds, limits, and when a reading is good."""

import math
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field, field_validator

from elastocal.cell.description.motion import PositiveSpeed, PositiveTime
from elastocal.cell.description.quantities import PositiveForce, PositiveLength
from elastocal.schema import StrictModel
from elastocal.units import parse_quantity


def _finite(value: float) -> float:
    if not math.isfinite(value):
        raise ValueError("must be finite")
    return value


PositiveForceRate = Annotated[
    float,
    BeforeValidator(lambda text: parse_quantity(text, "force rate")),
    Field(gt=0.0),
    AfterValidator(_finite),
]
"""In N/s, above 0."""
TranslationalCompliance = Annotated[
    float,
    BeforeValidator(lambda text: parse_quantity(text, "translational compliance")),
    Field(ge=0.0),
    AfterValidator(_finite),
]
"""In m/N, 0 or above."""


class ProcedureSettings(StrictModel):
    """Settings of `elastocal run`. Joint moves go at the speeds of the section ``motion``."""

    cycle: PositiveTime = 0.04
    """Time between two looks at the devices, in s."""
    approach_speed: PositiveSpeed = 0.02
    """Between approach pose and near contact, and back, in m/s."""
    contact_speed: PositiveSpeed = 0.005
    """From near contact to the surface, in m/s."""
    contact_force: PositiveForce = 60.0
    """Force at which the guarded approach stops, in N."""
    ramp: PositiveForceRate = 400.0
    """Fastest change of the force, in N/s."""
    force_limit: PositiveForce | None = None
    """Largest force that is let happen, in N; by default 1.3 times the largest load case, and
    never more than the sensor's range allows."""
    travel_limit: PositiveLength = 15e-3
    """How far the tool may go beyond the expected contact, or aside, in m."""
    contact_compliance: TranslationalCompliance = 0.5e-6
    """Lateral movement of the marker under load that is expected without slip (disk, tooling,
    tilt of the tool), in m/N of the load case."""
    force_tolerance: PositiveForce = 5.0
    """Largest distance of the mean force from the load case, in N."""
    force_drift: PositiveForceRate = 5.0
    """Largest drift of the force over the dwell, in N/s."""
    force_spread: PositiveForce = 8.0
    """Largest width of the force about its drift that holds 95 % of the samples, each axis, in N;
    counted as four standard deviations."""
    dwell: PositiveTime = 0.5
    """How long the force must be like that before it is averaged, in s."""
    average: PositiveTime = 1.0
    """Time over which a loaded reading is averaged, in s."""
    unloaded_average: PositiveTime = 1.0
    """Time over which the unloaded reference is averaged, in s."""
    marker_sigma: PositiveLength = 50e-6
    """Largest standard deviation of the marker during the unloaded reference, each axis, in m."""
    slip_limit: PositiveLength = 0.2e-3
    """Largest lateral movement of the marker that is not expected, in m."""
    timeout: PositiveTime = 20.0
    """How long a load case may take to become stable after its ramp, in s; also what every other
    step may take beyond its expected time."""
    beam_timeout: PositiveTime = 5.0
    """How long a tracker may look for the marker, in s."""
    stale: PositiveTime = 0.3
    """Oldest data that are trusted, in s."""
    retries: Annotated[int, Field(ge=0)] = 1
    """Further attempts at a pose after one that failed."""

    @field_validator("stale")
    @classmethod
    def _longer_than_a_cycle(cls, stale: float, info: Any) -> float:
        cycle = info.data.get("cycle", 0.0)
        if not stale > 2.0 * cycle:
            raise ValueError(f"must be above two cycles ({2.0 * cycle:g} s)")
        return stale

    @field_validator("dwell", "average", "unloaded_average")
    @classmethod
    def _several_cycles(cls, duration: float, info: Any) -> float:
        cycle = info.data.get("cycle", 0.0)
        if not duration >= 4.0 * cycle:
            raise ValueError(f"must be at least four cycles ({4.0 * cycle:g} s)")
        return duration
