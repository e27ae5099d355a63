"""How far the robot may go."""

from typing import Annotated, Any

from pydantic import Field, FiniteFloat, field_validator

from elastocal.cell.description.quantities import Distance, PositiveMass, SpanAngle
from elastocal.errors import UnitError
from elastocal.records import StrictModel
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
