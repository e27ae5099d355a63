"""Judge a load case while it is held: whether force and marker are steady, and whether it slips.

A force is steady when it is close to what is wanted, without drift, without spread. A marker slips
when it moves sideways more than the force explains. The tracker's orientation is not known during
a run, but the approach shows it the normal: on the straight way to near contact the marker moves
along it. Lateral is what is at right angles to that.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import ProcedureSettings

_SPREAD = 4.0
"""Standard deviations that make up the width which holds 95 % of the samples."""
LEAST_SAMPLES = 3
"""A line and a spread about it need as many."""
_MICROSECOND = 1e-6
_LEAST_APPROACH = 5e-3
"""Shortest approach from which a direction is taken, in m."""
_SUDDEN = 10
"""Cycles within which a slide is sudden: no force that is built up explains it."""
_ENDS = 5
"""The first and the last fifth of a window are compared."""


@dataclass(frozen=True, eq=False)
class Steadiness:
    """Straight line ``mean + drift (t - mean t)`` through force samples, and their spread."""

    mean: FloatArray
    """Shape (3,), in N."""
    drift: float
    """Norm of the slope, in N/s."""
    spread: float
    """Largest over the axes of four standard deviations about the line, in N."""


def steadiness(time: FloatArray, force: FloatArray) -> Steadiness:
    """Return mean, drift and spread of a stretch of samples.

    Parameters
    ----------
    time : ndarray, shape (sample,)
        In s; at least three, not all equal.
    force : ndarray, shape (sample, 3)
        In N.
    """
    # Whole microseconds since the first sample: the same stretch at another time of day gives the
    # same figures to the last bit, so that a run that was resumed decides as one that was not.
    t = np.round((time - time[0]) / _MICROSECOND) * _MICROSECOND
    t -= t.mean()
    mean = force.mean(axis=0)
    about = force - mean
    slope = (t @ about) / (t @ t)
    about -= t[:, None] * slope
    variance = (about * about).sum(axis=0).max() / (len(t) - 2)
    return Steadiness(mean, float(np.sqrt(slope @ slope)), _SPREAD * float(np.sqrt(variance)))


def why_off(found: Steadiness, target: FloatArray, tolerance: float) -> str:
    """Return why a force is not the one that is wanted; empty when it is.

    Parameters
    ----------
    found : Steadiness
        Of the dwell.
    target : ndarray, shape (3,)
        The mean that is wanted, in N.
    tolerance : float
        Largest distance from it, in N.
    """
    away = float(np.linalg.norm(found.mean - target))
    return "" if away <= tolerance else f"force is off {away:.1f} N, limit {tolerance:g} N"


def why_unsteady(found: Steadiness, limits: ProcedureSettings) -> str:
    """Return why a force is not steady enough; empty when it is.

    Parameters
    ----------
    found : Steadiness
        Of the dwell.
    limits : ProcedureSettings
        Drift and spread that are allowed.
    """
    for value, limit, what, unit in (
        (found.drift, limits.force_drift, "force drifts by", "N/s"),
        (found.spread, limits.force_spread, "force spreads over", "N"),
    ):
        if not value <= limit:
            return f"{what} {value:.1f} {unit}, limit {limit:g} {unit}"
    return ""


def why_shaking(positions: FloatArray, limit: float) -> str:
    """Return why a marker is not quiet enough; empty when it is.

    Parameters
    ----------
    positions : ndarray, shape (sample, 3)
        In m; at least two.
    limit : float
        Largest standard deviation, each axis, in m.
    """
    sigma = float(positions.std(axis=0, ddof=1).max())
    if not sigma <= limit:
        return f"marker has a sigma of {sigma * 1e6:.0f} um, limit {limit * 1e6:g} um"
    return ""


class RecentSamples:
    """The newest samples of a stream, as far back as a duration.

    Parameters
    ----------
    duration : float
        In s; infinite: everything since the beginning.
    """

    def __init__(self, duration: float = np.inf) -> None:
        self._duration = duration
        self._blocks: deque[tuple[FloatArray, FloatArray]] = deque()

    def add(self, time: FloatArray, values: FloatArray) -> None:
        """Append a block, shape (sample,) in s and (sample, 3)."""
        if not len(time):
            return
        self._blocks.append((time, values))
        while self._blocks[0][0][-1] < time[-1] - self._duration - _MICROSECOND:
            self._blocks.popleft()

    def __len__(self) -> int:
        """Return the number of samples."""
        return sum(len(time) for time, _ in self._blocks)

    @property
    def time(self) -> FloatArray:
        """Shape (sample,), in s."""
        return np.concatenate([time for time, _ in self._blocks])

    @property
    def values(self) -> FloatArray:
        """Shape (sample, 3)."""
        return np.concatenate([values for _, values in self._blocks])


@dataclass(frozen=True, eq=False)
class SlipReference:
    """Place of the marker before contact, and the direction in which it got there."""

    unloaded: FloatArray
    """Marker at the unloaded reference, shape (3,), in m, tracker frame."""
    normal: FloatArray | None
    """Unit normal in the tracker frame, shape (3,); None when the approach was too short: every
    movement then counts."""

    @classmethod
    def of(cls, at_approach: FloatArray, unloaded: FloatArray) -> "SlipReference":
        """Return the reference of a pose.

        Parameters
        ----------
        at_approach, unloaded : ndarray, shape (3,)
            Marker at the approach pose and near contact, in m, tracker frame.
        """
        way = at_approach - unloaded
        length = float(np.linalg.norm(way))
        return cls(unloaded, way / length if length >= _LEAST_APPROACH else None)

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


class SlideDetector:
    """Looks for sudden slides while a load case is built up and held.

    Parameters
    ----------
    slip : SlipReference
        Where the marker was before contact.
    along : bool, default False
        Look for jumps along the normal in place of slides aside.
    """

    def __init__(self, slip: SlipReference, along: bool = False) -> None:
        self._length = slip.along if along else slip.lateral
        self._recent: deque[FloatArray] = deque(maxlen=_SUDDEN)
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
