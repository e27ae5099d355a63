"""Corrections of a simulated RSI context: their sum, its limits, and the stop beyond them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.errors import DeviceError

_CORRECTIONS = ("RKorr.X", "RKorr.Y", "RKorr.Z", "RKorr.A", "RKorr.B", "RKorr.C")


class RsiStopError(DeviceError):
    """The controller stops the arm and the RSI context; an operator has to reset it."""


@dataclass(frozen=True)
class PosCorrLimits:
    """Limits in the RSI context; the defaults are the controller's, but for the ways."""

    lower: tuple[float, float, float] = (-0.2, -0.2, -0.2)
    """LowerLimX..Z of POSCORR in m; it clamps and says nothing."""
    upper: tuple[float, float, float] = (0.2, 0.2, 0.2)
    rotation: float = math.radians(5.0)
    """MaxRotAngle of POSCORR in rad."""
    monitor_way: float = 0.25
    """MaxTrans of POSCORRMON in m; it stops the arm."""
    monitor_rotation: float = math.radians(6.0)


@dataclass
class PosCorr:
    """Sums corrections up (relative), or takes them as they are (absolute); frame Base."""

    limits: PosCorrLimits
    absolute: bool
    shift: FloatArray = field(default_factory=lambda: np.zeros(3))
    """Shape (3,), in m."""
    turn: FloatArray = field(default_factory=lambda: np.eye(3))
    """Shape (3, 3)."""

    def take(self, channels: Mapping[str, float]) -> None:
        """Take the corrections of a cycle, in mm and deg.

        Raises
        ------
        RsiStopError
            Where their sum is beyond what POSCORRMON allows.
        """
        values = np.array([channels.get(tag, 0.0) for tag in _CORRECTIONS])
        if self.absolute or np.any(values):
            way = 1e-3 * values[:3] if self.absolute else self.shift + 1e-3 * values[:3]
            self.shift = np.clip(way, self.limits.lower, self.limits.upper)
        if np.any(values[3:]) or self.absolute:
            self._turn(values[3:])
        length, angle = float(np.linalg.norm(self.shift)), _angle(self.turn)
        if length > self.limits.monitor_way or angle > self.limits.monitor_rotation:
            raise RsiStopError(
                f"KSS29000 POSCORRMON: correction {1e3 * length:.3f} mm, {math.degrees(angle):.3f}°"
                f" beyond {1e3 * self.limits.monitor_way:g} mm,"
                f" {math.degrees(self.limits.monitor_rotation):g}°"
            )

    def _turn(self, degrees: FloatArray) -> None:
        asked: FloatArray = Rotation.from_euler("ZYX", degrees, degrees=True).as_matrix()
        asked = asked if self.absolute else asked @ self.turn
        # A turn that is too large is not made smaller: the axes would not be those asked for.
        self.turn = asked if _angle(asked) <= self.limits.rotation else self.turn

    def clear(self) -> None:
        """Correct nothing; RSI_ON begins so."""
        self.shift, self.turn = np.zeros(3), np.eye(3)

    @property
    def offset(self) -> FloatArray:
        """The correction as shift (3,) over turn (3, 3), shape (4, 3)."""
        return np.vstack([self.shift, self.turn])


def _angle(turn: FloatArray) -> float:
    return math.acos(min(1.0, max(-1.0, 0.5 * (float(np.trace(turn)) - 1.0))))
