"""Courses of a process: stretches of path under force, at even steps of time.

A process (`placement`, `roughing`) makes courses on a surface, with forces from a seeded generator
that change slowly. A further process is a file with a subclass of `Process`, and a line in
`postures`.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np
from numpy.random import Generator

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.compensation.settings import CompensatorSettings
from elastocal.planning.surface import Surface
from elastocal.results import brief_repr

_PERIODS = (1.0, 2.3, 5.1)
"""Periods of three sines, in s; no two of them keep step."""


@dataclass(frozen=True)
class Ripple:
    """A force that swings about its mean, too quick for the arm: teeth that pass, run-out."""

    frequency: float
    """In Hz."""
    share: float
    """Amplitude over the mean force."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Course:
    """A stretch of path from the first contact to the last."""

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
    normal: FloatArray | None = None
    """Unit normal of the surface, out of the part, in base, shape (row, 3); none where only the
    tool's axis is known."""

    @property
    def outward(self) -> FloatArray:
        """Unit vectors away from the part, in base, shape (row, 3): a force reacts along them."""
        return -self.T_base_tcp[:, :3, 2] if self.normal is None else self.normal

    def ripple_at(self, time: FloatArray) -> FloatArray:
        """Return the swing about the mean force at times in s, over that force, (time,)."""
        swing = np.zeros(len(time))
        for ripple in self.ripple:
            swing += ripple.share * np.sin(2.0 * np.pi * ripple.frequency * time)
        return swing


@dataclass(frozen=True)
class Landing:
    """How a course begins where its offset is read: a press, then light contact.

    The tool lands with the force of the process along the surface's normal, which brings the
    friction of the gears where every course begins, and lets go to light contact. There marker and
    controller are read.
    """

    light: float
    """Force of the light contact, in N."""
    ramp: float
    """Rate at which force is put on and taken off, in N/s."""
    settle: float
    """Time in light contact before it is read, in s."""
    average: float
    """Time over which it is read, in s."""
    visits: int = 4
    """Readings in the air, when the path was taught, that the reference is the mean of."""

    @classmethod
    def of(cls, cell: Cell) -> "Landing":
        """Return the landing by a cell's contact force, ramp, dwell and average."""
        own = cell.file.procedure
        return cls(own.contact_force, own.ramp, own.dwell, own.average)

    def seconds(self, course: Course) -> float:
        """Return the time that it takes a course, in s."""
        return float(self._corners(course)[0][-1])

    def forces(self, course: Course) -> FloatArray:
        """Return the force along the normal at the steps of a course, shape (row,), in N."""
        time, force = self._corners(course)
        forces: FloatArray = np.interp(np.arange(course.step, time[-1], course.step), time, force)
        return forces

    def _corners(self, course: Course) -> tuple[FloatArray, FloatArray]:
        """Return time in s and force in N at the corners of the landing, shape (4,)."""
        along = np.einsum("rk,rk->r", course.force, course.outward)
        press = max(float(along.max()), self.light)
        passed = press / self.ramp, (press - self.light) / self.ramp, self.settle + self.average
        return np.cumsum([0.0, *passed]), np.array([0.0, press, self.light, self.light])


@dataclass(frozen=True)
class Process(ABC):
    """A process on a surface: how its courses run, and what forces act on them."""

    count: int = 5
    """Number of courses."""
    compensator: ClassVar[CompensatorSettings] = CompensatorSettings()
    """Settings of the compensator that suit its forces."""
    direction: ClassVar[str] = "lateral"
    """The component of the deviation that counts, in a word."""

    @abstractmethod
    def courses(self, surface: Surface, rng: Generator) -> tuple[Course, ...]:
        """Return courses without joints.

        Parameters
        ----------
        surface : Surface
            In base.
        rng : Generator
            Seeded source of randomness, for the forces.

        Raises
        ------
        CompensationError
            If the surface is too small.
        """


def at_load(course: Course, load: float) -> Course:
    """Return a course under a share of its force; below 0 with the lateral force reversed.

    The part of the force along the surface's normal keeps its sign, since a roller or cutter that
    presses cannot pull: -1 is the same pressure with the force aside and against the feed turned.

    Parameters
    ----------
    course : Course
        As programmed.
    load : float
        Share, not 0.
    """
    normal = course.outward
    along = np.einsum("rk,rk->r", course.force, normal)[:, None] * normal
    return replace(course, force=abs(load) * along + load * (course.force - along))


def evenly_spaced(points: FloatArray, speed: float, step: float) -> FloatArray:
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
    length = arc_length(points[:, :3])
    wanted = np.arange(0.0, length[-1], speed * step)
    return np.stack([np.interp(wanted, length, column) for column in points.T], axis=1)


def arc_length(points: FloatArray) -> FloatArray:
    """Return the length of a polyline up to each of its points, shape (point,), in m."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def unit_tangents(points: FloatArray) -> FloatArray:
    """Return unit vectors along a path, shape (row, 3)."""
    slope = np.gradient(points, axis=0)
    result: FloatArray = slope / np.linalg.norm(slope, axis=1, keepdims=True)
    return result


def tool_frames(position: FloatArray, x: FloatArray, z: FloatArray) -> FloatArray:
    """Return T_base_tcp, z as given and x as near to ``x`` as that allows, shape (row, 4, 4)."""
    y = np.cross(z, x)
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    T = np.zeros((len(position), 4, 4))
    T[:, :3, 0], T[:, :3, 1], T[:, :3, 2] = np.cross(y, z), y, z
    T[:, :3, 3], T[:, 3, 3] = position, 1.0
    return T


def swing(time: FloatArray, rng: Generator) -> FloatArray:
    """Return a slow swing between -1 and 1, shape (row,): three sines of random phase."""
    phase = rng.uniform(0.0, 2.0 * np.pi, len(_PERIODS))
    sines = [
        np.sin(2.0 * np.pi * time / period + p) for period, p in zip(_PERIODS, phase, strict=True)
    ]
    mean: FloatArray = np.mean(sines, axis=0)
    return mean


def engaged(time: FloatArray, rise: float) -> FloatArray:
    """Return the acting share of the force along the course, from 0 over 1 to 0, shape (row,).

    Parameters
    ----------
    time : ndarray, shape (row,)
        In s.
    rise : float
        Time from none to all of it, and back at the end, in s; a half cosine.
    """
    inward = np.minimum(time - time[0], time[-1] - time) / rise
    share: FloatArray = 0.5 - 0.5 * np.cos(np.pi * np.clip(inward, 0.0, 1.0))
    return share
