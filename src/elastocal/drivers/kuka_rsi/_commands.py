"""Checks of what an arm is told, before anything is begun."""

import math
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import CommandChecks
from elastocal.drivers.kuka_rsi.force_control import ForceLaw, overshoot
from elastocal.drivers.kuka_rsi.settings import Bounds
from elastocal.errors import DeviceError

_WRIST = math.radians(5.0)
"""Least |A5| at which the tool is moved straight: near 0 axes 4 and 6 run away."""


CHECKS = CommandChecks("kuka_rsi")


@dataclass(frozen=True)
class StraightMoveRules:
    """What straight moves keep to."""

    bounds: Bounds
    law: ForceLaw
    delay: float
    """From force to standstill, in s."""

    def require_room(self, command: str, end: FloatArray, speed: float) -> None:
        """Refuse a move that leaves what corrections may do.

        Parameters
        ----------
        command : str
            Name of the command.
        end : ndarray, shape (3,)
            Correction at its end, base, in m.
        speed : float
            In m/s.
        """
        bounds, size = self.bounds, float(np.linalg.norm(end))
        CHECKS.require(
            size <= bounds.correction,
            f"{command}: correction at its end",
            f"{1e3 * size:.1f} mm",
            f"at most {1e3 * bounds.correction:g} mm (largest_correction)",
        )
        CHECKS.require(
            speed <= bounds.speed,
            f"{command} speed",
            f"{1e3 * speed:g} mm/s",
            f"at most {1e3 * bounds.speed:g} mm/s (correction_speed)",
        )

    def require_bent_wrist(self, q: FloatArray) -> None:
        """Refuse a move with axes 4 and 6 in line; joints of shape (joint,), A5 last but one."""
        bend = abs(math.remainder(float(q[-2]), math.pi))
        CHECKS.require(
            bend >= _WRIST,
            "A5",
            f"{math.degrees(bend):.1f} deg from straight",
            f"at least {math.degrees(_WRIST):g} deg for a straight move",
        )

    def require_gentle(self, speed: float, contact_force: float) -> None:
        """Refuse a guarded move that would press too hard before it stands."""
        if math.isinf(contact_force):
            return
        stiffness, room = self.law.stiffness, self.bounds.force - contact_force
        further = overshoot(speed, stiffness, self.delay)
        if not further <= room:
            allowed = max(room, 0.0) / (stiffness * self.delay)
            raise DeviceError(
                f"kuka_rsi refuses approach: at {1e3 * speed:.3g} mm/s it would press"
                f" {further:.0f} N beyond {contact_force:g} N before it stands (delay"
                f" {1e3 * self.delay:.0f} ms, stiffness {1e-6 * stiffness:.3g} N/um), force limit"
                f" {self.bounds.force:.0f} N: at most {1e3 * allowed:.2g} mm/s"
            )
