"""Where a guarded move of a Universal Robots controller goes, and when it has ended."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.drivers.rtde.line import UrSample
from elastocal.errors import DeviceError

_ZEROED = 0.05
"""How long after the order the sensor may still show its old zero, in s."""
_FELT = 0.8
"""Part of the contact force at which the approach has ended."""


@dataclass(frozen=True)
class Guard:
    """Where a guarded move ends."""

    direction: FloatArray
    distance: float
    force: float
    start: UrSample

    def gone(self, now: UrSample) -> float:
        """Return how far the tool has come, in m."""
        return float((now.T_base_tcp[:3, 3] - self.start.T_base_tcp[:3, 3]) @ self.direction)

    def felt(self, now: UrSample) -> bool:
        """Return whether the contact force is there; what came before the new zero is not asked."""
        fresh = now.time > self.start.time + _ZEROED
        return fresh and float(-now.force_base @ self.direction) >= _FELT * self.force


def unit_vector(direction: FloatArray) -> FloatArray:
    """Return a direction.

    Raises
    ------
    DeviceError
        If it is no unit vector of three parts.
    """
    found = np.asarray(direction, dtype=float)
    if not (found.shape == (3,) and abs(float(np.linalg.norm(found)) - 1.0) < 1e-6):
        raise DeviceError(f"rtde: direction {found}: must be a unit vector")
    return found


def frame_along(direction: FloatArray, origin: FloatArray) -> FloatArray:
    """Return a frame whose z axis is a direction, shape (4, 4)."""
    side = np.eye(3)[int(np.argmin(np.abs(direction)))]
    x = np.cross(side, direction)
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.column_stack([x, np.cross(direction, x), direction])
    T[:3, 3] = origin
    return T
