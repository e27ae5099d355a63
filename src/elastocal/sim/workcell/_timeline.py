"""Time in the simulated cell: clock, random numbers, time laws, and segments.

Time is in whole microseconds, so that time differences are exact. A segment is a period in which
the cell does one thing: at its knots everything is exact; between them joints, forces and small
deviations are interpolated along the progress of the movement.

Every generator of random numbers is seeded by the seed and by words for its purpose: the target
posture of the arm, the device, the number of the block. A repeated pose, in the same process or
another, has the same noise.
"""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import Motion, require_duration
from elastocal.errors import DeviceError
from elastocal.sim.arm import RobotSprings

SETTLED = 1e-5
"""Rest of a settling force that counts as none, over its change."""
MICROSECONDS = 1_000_000


def to_microseconds(seconds: float) -> int:
    """Return a time rounded to whole microseconds.

    >>> to_microseconds(0.04)
    40000
    """
    return round(seconds * MICROSECONDS)


def generator(seed: int, *words: object) -> np.random.Generator:
    """Return the generator of some purpose.

    Parameters
    ----------
    seed : int
        Seed of the simulated cell.
    *words : object
        What it is for; objects with distinct `repr`.
    """
    digest = hashlib.sha256(repr((seed, *words)).encode()).digest()
    return np.random.default_rng(np.frombuffer(digest, dtype=np.uint32))


def posture_key(q: FloatArray) -> str:
    """Return the key of a posture: its joint positions to a nanoradian.

    Parameters
    ----------
    q : ndarray, shape (joint,)
        In rad or m.
    """
    return ",".join(f"{value + 0.0:.9f}" for value in np.round(q, 9))


class SimClock:
    """A clock that advances only while a caller sleeps; see `elastocal.cell.devices.Clock`."""

    def __init__(self, start: float = 0.0) -> None:
        """Start the clock at ``start`` s."""
        if not 0.0 <= start < 1e9:
            raise DeviceError(f"start of the simulated clock is {start!r} s: must be 0 to 1e9")
        self._now = to_microseconds(start)
        self._woken: list[Callable[[int], None]] = []

    @property
    def microseconds(self) -> int:
        """The time in µs."""
        return self._now

    def now(self) -> float:
        """Return the time in s."""
        return self._now / MICROSECONDS

    def sleep(self, seconds: float) -> None:
        """Advance the time; simulated devices carry out what is due.

        Raises
        ------
        DeviceError
            If the time is negative or not finite.
        """
        require_duration(seconds)
        self._now += to_microseconds(seconds)
        for wake in self._woken:
            wake(self._now)

    def on_wake(self, wake: Callable[[int], None]) -> None:
        """Register a function that is called with the time in µs after every sleep."""
        self._woken.append(wake)


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
        return np.clip(np.asarray(time) / self.duration, 0.0, 1.0)


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
        return np.where(t < self.rise, rising, np.where(left < self.rise, falling, level))


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
        return np.where(t >= self.duration, 1.0, progress)


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


@dataclass(frozen=True, eq=False)
class Knots:
    """States along a path."""

    progress: FloatArray
    """From 0 to 1, ascending, shape (knot,)."""
    q: FloatArray
    """Joints of the controller, shape (knot, joint), in rad or m."""
    twist: FloatArray
    """True minus commanded: shift of the tool in m, rotation vectors of tool and sensor in rad, in
    base, shape (knot, 9)."""
    force: FloatArray
    """Force on the robot in base, shape (knot, 3), in N."""
    moment: FloatArray
    """Its moment about where the controller believes the tool centre point, in base, shape
    (knot, 3), in N·m."""
    seen: FloatArray
    """Truth that instruments see: marker in base in m, wrench at the sensor in its frame in N and
    N·m, weight in; shape (knot, 9)."""

    def at(self, array: FloatArray, progress: FloatArray) -> FloatArray:
        """Return one of the arrays interpolated between the knots, shape (time, column)."""
        if len(self.progress) == 2:
            part = progress[:, None]
            direct: FloatArray = (1.0 - part) * array[0] + part * array[1]
            return direct
        after = np.clip(
            np.searchsorted(self.progress, progress, "right"), 1, len(self.progress) - 1
        )
        low, high = self.progress[after - 1], self.progress[after]
        part = ((progress - low) / (high - low))[:, None]
        return (1.0 - part) * array[after - 1] + part * array[after]


@dataclass(frozen=True, eq=False)
class RobotState:
    """State of the robot between two commands; in many postures at once with a leading axis."""

    q: FloatArray
    """Joints of the controller, shape (..., joint), in rad or m."""
    twist: FloatArray
    """See `Knots.twist`, shape (..., 9)."""
    force: FloatArray
    """Force on the robot in base, shape (..., 3), in N."""
    moment: FloatArray
    """See `Knots.moment`, shape (..., 3)."""
    springs: RobotSprings
    """Springs with the memory of the gears."""
    theta: FloatArray
    """Spring positions, shape (..., spring), in rad or m."""
    sag: FloatArray
    """Twist under weight alone that the controller has taken out a part of, shape (..., 9)."""


@dataclass(frozen=True, eq=False)
class RobotPath:
    """A path that the robot takes."""

    knots: Knots
    start: RobotState
    end: RobotState


@dataclass(frozen=True)
class Ripple:
    """Unrest of a held force: two sines, never in step."""

    amplitude: float
    """In N."""
    frequency: tuple[float, float]
    """In Hz."""
    phase: tuple[float, float]
    """In rad."""

    def at(self, time: FloatArray) -> FloatArray:
        """Return the force at times in s, in their shape."""
        first, second = (
            np.sin(2.0 * np.pi * f * time + p)
            for f, p in zip(self.frequency, self.phase, strict=True)
        )
        return 0.5 * self.amplitude * (first + second)


@dataclass(frozen=True, eq=False)
class Segment:
    """One thing that the cell does, and what comes of it."""

    begin: int
    """In µs of the clock."""
    law: TimeLaw
    path: RobotPath
    motion: Motion
    """Motion on the path."""
    motion_after: Motion
    """When it is done."""
    fault_after: str | None
    """Fault that the controller reports when it is done."""
    ripple: Ripple | None
    ripple_wrench: FloatArray
    """Wrench at the sensor per N of the ripple, sensor frame, shape (6,)."""

    @cached_property
    def end(self) -> int:
        """When it is done, in µs."""
        return self.begin + to_microseconds(self.law.duration)

    def progress(self, now: int) -> float:
        """Return the progress at a time in µs."""
        if now >= self.end:
            return 1.0
        return float(self.law.at((now - self.begin) / MICROSECONDS))

    def seen(self, times: IndexArray) -> FloatArray:
        """Return the state that instruments see at times in µs, without unrest of the force.

        Shape (time, 9), or (1, 9) where nothing changes any more; see `Knots.seen`.
        """
        if times[0] >= self.end:
            return self.path.knots.seen[-1:]
        progress = self.law.at((times - self.begin) / MICROSECONDS)
        return self.path.knots.at(self.path.knots.seen, progress)

    def unrest(self, times: IndexArray) -> FloatArray | None:
        """Return the unrest of the force at times in µs, shape (time, 1), in N; None: none."""
        if self.ripple is None:
            return None
        return self.ripple.at((times - self.begin) / MICROSECONDS)[:, None]
