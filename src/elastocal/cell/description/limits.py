"""How far the robot may go."""

from typing import Annotated, Any

from pydantic import Field, FiniteFloat, field_validator

from elastocal.cell.description.quantities import Distance, PositiveMass, SpanAngle
from elastocal.schema import StrictModel
from elastocal.units import parse_quantity


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
            if not _torque(text) > 0.0:
                raise ValueError(f"{joint} must be above 0")
        return values

    @property
    def figures(self) -> dict[str, float]:
        """Figure of each joint that is given, in N·m or N."""
        return {joint: _torque(text) for joint, text in self.values.items()}

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


def _torque(text: str) -> float:
    """Return a torque in N·m, or, for a linear axis, a force in N."""
    return parse_quantity(text, "force" if text.rstrip().endswith("N") else "moment")
