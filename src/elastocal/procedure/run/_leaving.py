"""What presses on the tool, measured, and how it leaves a surface: the force must not grow.

What the arm remembers is not asked: a process that was killed has taken its memory with it.
"""

import math
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import SensorStatus, WrenchBlock
from elastocal.procedure.run.steps import Fault, FaultError

_WRONG_WEIGHT = 0.35
"""Part of the weight that may be missing: a mass a quarter off, with a tool turned by 90 deg."""
_BIAS = 0.1
"""Bias of a sensor that is let pass, as a part of the force limit."""


@dataclass(frozen=True, eq=False)
class ToolLoad:
    """How to tell what presses on the tool from its weight."""

    weight_base: FloatArray
    """Of the tool, base, shape (3,), in N; zero where nobody has stated a mass."""
    R_tcp_sensor: FloatArray
    """Axes of the sensor in the tcp frame, shape (3, 3)."""
    force_limit: float
    """Of the procedure, in N."""

    @property
    def tolerance(self) -> float:
        """Largest force that a wrong mass and a bias explain, in N; infinite without a mass."""
        weight = float(np.linalg.norm(self.weight_base))
        return _WRONG_WEIGHT * weight + _BIAS * self.force_limit if weight > 0.0 else math.inf

    def beyond_weight(self, block: WrenchBlock, T_base_tcp: FloatArray) -> FloatArray | None:
        """Return the mean force on the robot less the tool's weight, base, shape (3,), in N.

        None where no sample of the block can be trusted.
        """
        if not len(block) or block.status is not SensorStatus.OK:
            return None
        force = block.force.mean(axis=0)
        if not np.isfinite(force).all():
            return None
        left: FloatArray = T_base_tcp[:3, :3] @ self.R_tcp_sensor @ force - self.weight_base
        return left


class LeavingWatch:
    """Watches the force while a tool leaves a surface along its normal.

    Parameters
    ----------
    load : ToolLoad
        What is taken for contact.
    normal : ndarray, shape (3,)
        Direction in which the tool leaves, base.
    limit : float
        Growth of the force that is a collision, in N.
    """

    def __init__(self, load: ToolLoad, normal: FloatArray, limit: float) -> None:
        self._load, self._normal, self._limit = load, normal, limit
        self._least = math.inf
        self.force: float | None = None
        """Force along the normal at the last look, in N; None as long as none can be trusted."""

    def look(self, block: WrenchBlock, T_base_tcp: FloatArray) -> None:
        """Refuse a force that grows, or that holds the tool back.

        Raises
        ------
        FaultError
            With both forces.
        """
        beyond = self._load.beyond_weight(block, T_base_tcp)
        if beyond is None:
            return
        self.force = along = float(beyond @ self._normal)
        self._least = min(self._least, along)
        if not along <= self._least + self._limit:
            text = f"it grew from {self._least:.0f} N to {along:.0f} N"
        elif not along >= -(self._load.tolerance + self._limit):
            text = f"{-along:.0f} N hold the tool back"
        else:
            return
        raise FaultError(
            Fault.COLLISION,
            f"the force while the tool leaves the surface: {text}, limit {self._limit:.0f} N",
        )
