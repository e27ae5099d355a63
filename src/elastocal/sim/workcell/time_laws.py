"""How far along its way a movement or a force is after a time: from 0 to 1, never back."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray

SETTLED = 1e-5
"""What is left of a settling force that counts as nothing, over its change."""


class TimeLaw(Protocol):
    """Progress over time."""

    @property
    def duration(self) -> float:
        """Time after which the progress is 1, in s."""

    def at(self, time: ArrayLike) -> FloatArray:
        """Return the progress at times from the beginning, in s, in their shape."""
        ...


@dataclass(frozen=True)
class Uniform:
    """``s = t / T``."""

    duration: float

    def at(self, time: ArrayLike) -> FloatArray:
        """Return the progress at times in s."""
        if self.duration <= 0.0:
            return np.ones_like(np.asarray(time, dtype=float))
        progress: FloatArray = np.clip(np.asarray(time) / self.duration, 0.0, 1.0)
        return progress


@dataclass(frozen=True)
class Trapezoid:
    """Speed that rises for a time, stays, and falls as long (Biagiotti, Melchiorri 2008, 3.2)."""

    duration: float
    rise: float
    """In s, at most half the duration."""

    def at(self, time: ArrayLike) -> FloatArray:
        """Return the progress at times in s."""
        t = np.clip(time, 0.0, self.duration)
        if self.duration <= 0.0:
            return np.ones_like(t)
        speed = 1.0 / (self.duration - self.rise)
        left = self.duration - t
        rising = 0.5 * speed * t**2 / self.rise
        falling = 1.0 - 0.5 * speed * left**2 / self.rise
        level = speed * (t - 0.5 * self.rise)
        progress: FloatArray = np.where(
            t < self.rise, rising, np.where(left < self.rise, falling, level)
        )
        return progress


@dataclass(frozen=True)
class SettlingRamp:
    """A ramp of duration T followed by a first-order lag with time constant tau.

    The answer of ``tau s' + s = ramp``: ``s = (t - tau (1 - exp(-t / tau))) / T`` on the ramp, and
    ``1 - s`` falling as ``exp(-t / tau)`` after it. Its slope never exceeds that of the ramp.
    """

    ramp: float
    tau: float

    @property
    def duration(self) -> float:
        """Time after which less than `SETTLED` is left, in s."""
        return self.ramp - self.tau * float(np.log(SETTLED))

    def at(self, time: ArrayLike) -> FloatArray:
        """Return the progress at times in s."""
        t = np.maximum(time, 0.0)
        if self.ramp <= 0.0:
            progress = 1.0 - np.exp(-t / self.tau)
        else:
            on = np.minimum(t, self.ramp)
            reached = (on + self.tau * np.expm1(-on / self.tau)) / self.ramp
            progress = 1.0 - (1.0 - reached) * np.exp(-(t - on) / self.tau)
            progress = np.where(t < self.ramp, reached, progress)
        settled: FloatArray = np.where(t >= self.duration, 1.0, progress)
        return settled


def joint_move(distance: FloatArray, speed: FloatArray, rise: float) -> Trapezoid:
    """Return the law of a move in which all joints arrive together; the slowest decides.

    Parameters
    ----------
    distance : ndarray, shape (joint,)
        In rad or m.
    speed : ndarray, shape (joint,)
        Largest speed, in rad/s or m/s.
    rise : float
        Time to reach it, in s.
    """
    at_speed = float(np.max(np.abs(distance) / speed))
    if at_speed < rise:
        duration = 2.0 * float(np.sqrt(at_speed * rise))
        return Trapezoid(duration, 0.5 * duration)
    return Trapezoid(at_speed + rise, rise)
