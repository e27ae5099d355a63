"""What hangs on a force sensor and how the sensor sits: what a raw wrench is corrected by."""

from dataclasses import dataclass, field

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import CompensationError
from elastocal.robot import GRAVITY

_RIGID = 1e-6
"""How far R R^T may be from identity."""


def _zero() -> FloatArray:
    return np.zeros(3)


@dataclass(frozen=True, eq=False)
class SensorLoad:
    """Tool weight and bias of a force sensor, and its place at the tool centre point.

    The sensor reads, in its own frame,

        F = R^T (f + w) + b,        M = R^T m + c x R^T w + b_m,

    with its rotation ``R`` in base, force ``f`` and moment ``m`` on the robot about its origin,
    the tool's weight ``w`` and centre of mass ``c``, and the biases ``b``. The default is a
    sensor at the tool centre point that tool weight and bias have been taken from already.
    """

    mass: float = 0.0
    """In kg."""
    centre: FloatArray = field(default_factory=_zero)
    """Centre of mass in the sensor's frame, shape (3,), in m."""
    force_bias: FloatArray = field(default_factory=_zero)
    """In the sensor's frame, shape (3,), in N."""
    moment_bias: FloatArray = field(default_factory=_zero)
    """In the sensor's frame, shape (3,), in N·m."""
    T_tcp_sensor: FloatArray = field(default_factory=lambda: np.eye(4))
    """Sensor's measuring frame in the tcp frame, shape (4, 4), in m."""
    gravity: FloatArray = field(default_factory=lambda: np.array(GRAVITY))
    """Acceleration of gravity in base, shape (3,), in m/s²."""

    def __post_init__(self) -> None:
        for name, shape in (
            ("centre", (3,)),
            ("force_bias", (3,)),
            ("moment_bias", (3,)),
            ("T_tcp_sensor", (4, 4)),
            ("gravity", (3,)),
        ):
            array = np.array(getattr(self, name), dtype=float)
            if array.shape != shape or not np.all(np.isfinite(array)):
                raise CompensationError(
                    f"{name} of the tool must be finite numbers of shape {shape}, got {array}"
                )
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if not 0.0 <= self.mass < np.inf:
            raise CompensationError(f"mass of the tool is {self.mass} kg: it must be 0 or above")
        R = self.T_tcp_sensor[:3, :3]
        if not np.abs(R @ R.T - np.eye(3)).max() <= _RIGID or not np.linalg.det(R) > 0.0:
            raise CompensationError("T_tcp_sensor of the tool does not hold a rotation")

    def wrench_tcp(
        self, R_base_tcp: FloatArray, force: FloatArray, moment: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the wrench on the robot about the tool centre point, in the tcp frame.

        Bias and weight are taken away, then the moment is moved from the sensor's origin:
        ``m_tcp = m_sensor + p x f`` with ``p`` the sensor's origin in the tcp frame.

        Parameters
        ----------
        R_base_tcp : ndarray, shape (..., 3, 3)
            Rotation of the tool centre point in base.
        force, moment : ndarray, shape (..., 3)
            Raw, in the sensor's frame, in N and N·m.

        Returns
        -------
        tuple of ndarray, shape (..., 3)
            Force in N and moment in N·m.
        """
        R, p = self.T_tcp_sensor[:3, :3], self.T_tcp_sensor[:3, 3]
        weight = self.mass * (self.gravity @ R_base_tcp)
        f = (force - self.force_bias) @ R.T - weight
        m = (moment - self.moment_bias) @ R.T - np.cross(R @ self.centre, weight)
        return f, m + np.cross(p, f)
