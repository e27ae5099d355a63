"""How long the robot is on its way: an estimate, not a simulation of its controller."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class AxisMotion:
    """Synchronous point-to-point motion with trapezoidal velocity (Biagiotti, Melchiorri 2008).

    A joint reaches its speed ``v`` in the time ``t_a`` and needs for a distance ``d``

        d / v + t_a          if d >= v t_a,  else  2 sqrt(d t_a / v).

    All joints arrive together, so that the slowest decides. A move by way of another posture
    stops there; as the duration is concave in each distance, no way is shorter than the straight
    one.
    """

    speed: FloatArray
    """Of each joint, shape (joint,), in rad/s or m/s, above 0."""
    acceleration_time: float
    """t_a in s, above 0."""

    def duration(self, start: ArrayLike, end: ArrayLike) -> FloatArray:
        """Return the duration of straight moves in joint space.

        Parameters
        ----------
        start, end : array_like, shape (..., joint)
            Joint positions in rad or m; their leading shapes broadcast.

        Returns
        -------
        ndarray, shape (...)
            In s.
        """
        at_speed = np.abs(np.asarray(end) - np.asarray(start)) / self.speed
        slow = at_speed < self.acceleration_time
        ramps = 2.0 * np.sqrt(at_speed * self.acceleration_time)
        return np.asarray(np.where(slow, ramps, at_speed + self.acceleration_time).max(axis=-1))

    def between(self, q: FloatArray) -> FloatArray:
        """Return the durations between all pairs of postures, shape (pose, pose), in s.

        Parameters
        ----------
        q : ndarray, shape (pose, joint)
            Joint positions in rad or m.
        """
        return self.duration(q[:, None], q[None])

    def along(self, postures: FloatArray) -> float:
        """Return the duration of a chain of straight moves with a stop at each posture, in s.

        Parameters
        ----------
        postures : ndarray, shape (posture, joint)
            Joint positions in rad or m, start and end included.
        """
        return float(self.duration(postures[:-1], postures[1:]).sum())
