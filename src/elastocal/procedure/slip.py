"""Slip: the marker moves sideways more than the force explains.

The tracker's orientation is not known during a run, but the approach shows it the normal: on the
straight way to near contact the marker moves along it. Lateral is what is at right angles to that.
"""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray

LEAST_WAY = 5e-3
"""Shortest approach from which a direction is taken, in m."""
_ENDS = 5
"""The first and the last fifth of a window are compared."""


@dataclass(frozen=True, eq=False)
class SlipWatch:
    """What the marker did before contact."""

    unloaded: FloatArray
    """Marker at the unloaded reference, shape (3,), in m, tracker frame."""
    normal: FloatArray | None
    """Unit normal in the tracker frame, shape (3,); None when the approach was too short: every
    movement then counts."""

    @classmethod
    def of(cls, at_approach: FloatArray, unloaded: FloatArray) -> "SlipWatch":
        """Return the watch of a pose.

        Parameters
        ----------
        at_approach, unloaded : ndarray, shape (3,)
            Marker at the approach pose and near contact, in m, tracker frame.
        """
        way = at_approach - unloaded
        length = float(np.linalg.norm(way))
        return cls(unloaded, way / length if length >= LEAST_WAY else None)

    def lateral(self, movement: FloatArray) -> float:
        """Return the length of a movement, shape (3,), without its part along the normal, in m."""
        if self.normal is not None:
            movement = movement - (movement @ self.normal) * self.normal
        return float(np.linalg.norm(movement))

    def during(self, positions: FloatArray) -> float:
        """Return how far the marker moved sideways within a window, shape (sample, 3), in m."""
        ends = max(len(positions) // _ENDS, 1)
        return self.lateral(positions[-ends:].mean(axis=0) - positions[:ends].mean(axis=0))

    def so_far(self, positions: FloatArray) -> float:
        """Return how far the marker is aside of where it was unloaded, in m."""
        return self.lateral(positions.mean(axis=0) - self.unloaded)
