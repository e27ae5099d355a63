"""Slip: the marker moves sideways more than the force explains.

The tracker's orientation is not known during a run, but the approach shows it the normal: on the
straight way to near contact the marker moves along it. Lateral is what is at right angles to that.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray

LEAST_WAY = 5e-3
"""Shortest approach from which a direction is taken, in m."""
SUDDEN = 10
"""Cycles within which a slide is sudden: no force that is built up explains it."""
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

    def along(self, movement: FloatArray) -> float:
        """Return the length of a movement's part along the normal, in m; 0 without a normal."""
        return 0.0 if self.normal is None else abs(float(movement @ self.normal))

    def during(self, positions: FloatArray) -> float:
        """Return how far the marker moved sideways within a window, shape (sample, 3), in m."""
        ends = max(len(positions) // _ENDS, 1)
        return self.lateral(positions[-ends:].mean(axis=0) - positions[:ends].mean(axis=0))

    def so_far(self, positions: FloatArray) -> float:
        """Return how far the marker is aside of where it was unloaded, in m."""
        return self.lateral(positions.mean(axis=0) - self.unloaded)


class SlideWatch:
    """Looks for sudden slides while a load case is built up and held.

    Parameters
    ----------
    slip : SlipWatch
        What the marker did before contact.
    along : bool, default False
        Look for jumps along the normal in place of slides aside.
    """

    def __init__(self, slip: SlipWatch, along: bool = False) -> None:
        self._length = slip.along if along else slip.lateral
        self._recent: deque[FloatArray] = deque(maxlen=SUDDEN)
        self.largest = 0.0
        """Longest sudden slide so far, in m."""

    def forget(self) -> None:
        """Begin anew after a gap; the longest slide is kept."""
        self._recent.clear()

    def see(self, positions: FloatArray) -> None:
        """Take the positions of one cycle, shape (sample, 3), in m; none after a gap."""
        if not len(positions):
            self._recent.clear()
            return
        self._recent.append(positions.mean(axis=0))
        slide = self._length(self._recent[-1] - self._recent[0])
        self.largest = max(self.largest, slide)
