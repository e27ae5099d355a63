"""The load cases of the paper's section 4.1, as force on the robot in the tcp frame."""

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, FiniteFloat, field_validator

from elastocal.arrays import FloatArray
from elastocal.cell.description.quantities import Force, PositiveForce
from elastocal.records import StrictModel

DIRECTIONS = {
    "normal": (0.0, 0.0, -1.0),
    "north": (1.0, 0.0, -1.0),
    "south": (-1.0, 0.0, -1.0),
    "east": (0.0, -1.0, -1.0),
    "west": (0.0, 1.0, -1.0),
}
"""Signs of (fx, fy, fz) in the force on the robot (spec section 2, load cases)."""

CaseName = Literal["normal", "north", "south", "east", "west"]


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
    cases: Annotated[tuple[CaseName, ...], Field(validate_default=True)] = (
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
        force: FloatArray = signs * (self.fx, self.fy, self.fz)
        return force
