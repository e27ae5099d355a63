"""A stretch of process path under force, at even steps of time."""

from dataclasses import dataclass, field, replace

import numpy as np

from elastocal.arrays import FloatArray


@dataclass(frozen=True)
class Ripple:
    """A force that swings about its mean, too quick for the arm: teeth that pass, run-out."""

    frequency: float
    """In Hz."""
    share: float
    """Amplitude over the mean force."""


@dataclass(frozen=True, eq=False)
class Course:
    """From the first contact to the last."""

    name: str
    step: float
    """Time between rows, in s."""
    T_base_tcp: FloatArray
    """Programmed poses, shape (row, 4, 4), in m."""
    force: FloatArray
    """On the robot in base, shape (row, 3), in N."""
    direction: FloatArray
    """Unit vector that the deviation is measured along, in base, shape (row, 3)."""
    ripple: tuple[Ripple, ...] = ()
    q: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    """Programmed joints, shape (row, joint), in rad or m; none before a posture is chosen."""

    def with_joints(self, q: FloatArray) -> "Course":
        """Return the course with joints, shape (row, joint)."""
        return replace(self, q=q)

    def shortened(self, rows: int) -> "Course":
        """Return the first rows of the course."""
        cut = (self.T_base_tcp[:rows], self.force[:rows], self.direction[:rows], self.q[:rows])
        return replace(self, T_base_tcp=cut[0], force=cut[1], direction=cut[2], q=cut[3])


def along(points: FloatArray, speed: float, step: float) -> FloatArray:
    """Return points of a polyline passed at an even speed, shape (row, column).

    Parameters
    ----------
    points : ndarray, shape (corner, column)
        Position in m in the first three columns; what the others hold is interpolated.
    speed : float
        In m/s.
    step : float
        Time between rows, in s.
    """
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points[:, :3], axis=0), axis=1))])
    wanted = np.arange(0.0, way[-1], speed * step)
    return np.stack([np.interp(wanted, way, column) for column in points.T], axis=1)


def travel(points: FloatArray) -> FloatArray:
    """Return unit vectors along a path, shape (row, 3)."""
    slope = np.gradient(points, axis=0)
    result: FloatArray = slope / np.linalg.norm(slope, axis=1, keepdims=True)
    return result


def frames(position: FloatArray, x: FloatArray, z: FloatArray) -> FloatArray:
    """Return T_base_tcp, z as given and x as near to ``x`` as that allows, shape (row, 4, 4)."""
    y = np.cross(z, x)
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    T = np.zeros((len(position), 4, 4))
    T[:, :3, 0], T[:, :3, 1], T[:, :3, 2] = np.cross(y, z), y, z
    T[:, :3, 3], T[:, 3, 3] = position, 1.0
    return T
