"""Check ``friction``: the disk sticks under every load case (paper section 4.1)."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.planning.checks.check import PostureCheck
from elastocal.planning.postures import Postures
from elastocal.planning.surface import Surface
from elastocal.results import brief_repr


@brief_repr
@dataclass(frozen=True, eq=False)
class FrictionCheck(PostureCheck):
    """``mu fz / safety - |f_lateral|``, the smallest over the load cases; alike at every pose."""

    force_tcp: FloatArray
    """Force on the robot in each load case, tcp frame, shape (load_case, 3), in N."""
    mu: float
    """Coefficient of static friction between disk and surface."""
    safety: float
    """Factor by which the friction must exceed the lateral force, at least 1."""
    name: str = "friction"
    unit: str = "N"
    advice: str = "press harder, ask for less lateral force, or use a disk with more friction"
    order: ClassVar[int] = 50

    @classmethod
    def of(cls, cell: Cell, surface: Surface) -> Self:
        """Return the check of the load cases."""
        loads = cell.file.load_cases
        return cls(loads.force_tcp, loads.friction, loads.safety)

    def margin(self, postures: Postures) -> FloatArray:
        """Return the margin of each posture, shape (pose,), in N."""
        lateral = np.hypot(self.force_tcp[:, 0], self.force_tcp[:, 1])
        # Pushing onto the surface is a force on the robot along -z of the tcp.
        held = self.mu * -self.force_tcp[:, 2] / self.safety
        return np.full(len(postures), float(np.min(held - lateral)))
