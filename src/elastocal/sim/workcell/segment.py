"""A stretch of time in which the cell does one thing: the way from one state to the next.

At the knots everything is exact; between them joints, forces and small deviations are
interpolated along the progress of the movement.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell.devices import Motion
from elastocal.sim.workcell.clock import MICROSECONDS, to_microseconds
from elastocal.sim.workcell.springs import RobotSprings
from elastocal.sim.workcell.time_laws import TimeLaw


@dataclass(frozen=True, eq=False)
class Knots:
    """States along the way."""

    progress: FloatArray
    """From 0 to 1, ascending, shape (knot,)."""
    q: FloatArray
    """Joints of the controller, shape (knot, joint), in rad or m."""
    twist: FloatArray
    """True minus commanded: shift of the tool in m, rotation vectors of tool and sensor in rad, in
    base, shape (knot, 9)."""
    force: FloatArray
    """Force on the robot in base, shape (knot, 3), in N."""
    seen: FloatArray
    """What instruments see: marker in base in m, true wrench at the sensor in its frame in N and
    N·m, weight in; shape (knot, 9)."""

    def at(self, array: FloatArray, progress: FloatArray) -> FloatArray:
        """Return one of the arrays between the knots, shape (time, column)."""
        if len(self.progress) == 2:
            part = progress[:, None]
            direct: FloatArray = (1.0 - part) * array[0] + part * array[1]
            return direct
        after = np.clip(
            np.searchsorted(self.progress, progress, "right"), 1, len(self.progress) - 1
        )
        low, high = self.progress[after - 1], self.progress[after]
        part = ((progress - low) / (high - low))[:, None]
        between: FloatArray = (1.0 - part) * array[after - 1] + part * array[after]
        return between


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
        force: FloatArray = 0.5 * self.amplitude * (first + second)
        return force


@dataclass(frozen=True, eq=False)
class Segment:
    """One thing that the cell does, and what comes of it."""

    begin: int
    """In µs of the clock."""
    law: TimeLaw
    knots: Knots
    motion: Motion
    """On the way."""
    motion_after: Motion
    """When it is done."""
    springs: tuple[RobotSprings, RobotSprings]
    """Memory of the gears at the beginning and at the end."""
    theta: FloatArray
    """Spring positions at the end, shape (spring,), to start from."""
    fault_after: str | None = None
    """What the controller says when it is done."""
    ripple: Ripple | None = None
    ripple_wrench: FloatArray = field(default_factory=lambda: np.zeros(6))
    """Wrench at the sensor per N of the ripple, sensor frame, shape (6,)."""

    @cached_property
    def end(self) -> int:
        """When it is done, in µs."""
        return self.begin + to_microseconds(self.law.duration)

    def progress(self, now: int) -> float:
        """Return how far it is at a time in µs."""
        if now >= self.end:
            return 1.0
        return float(self.law.at((now - self.begin) / MICROSECONDS))

    def seen(self, times: IndexArray) -> FloatArray:
        """Return what instruments see at times in µs, without unrest of the force.

        Shape (time, 9), or (1, 9) where nothing changes any more; see `Knots.seen`.
        """
        if times[0] >= self.end:
            return self.knots.seen[-1:]
        return self.knots.at(self.knots.seen, self.law.at((times - self.begin) / MICROSECONDS))

    def unrest(self, times: IndexArray) -> FloatArray | None:
        """Return the unrest of the force at times in µs, shape (time, 1), in N; None: none."""
        if self.ripple is None:
            return None
        return self.ripple.at((times - self.begin) / MICROSECONDS)[:, None]
