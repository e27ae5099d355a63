"""Straight beams against boxes, balls, cylinders and capsules, in the frame of the solid.

These are convex: a line is inside them between two distances, which slabs and quadratics give in
closed form (Ericson, Real-Time Collision Detection, 2005, section 5.3).
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from elastocal.arrays import BoolArray, FloatArray

Span = tuple[FloatArray, FloatArray]
"""Distances along each beam between which its line is inside, in m; the first is the larger one
where the line stays outside."""

_PARALLEL = 1e-30
"""Put for a direction that has no part across a face, so that its line meets it at infinity."""


@dataclass(frozen=True, eq=False)
class Beams:
    """Straight lines of sight from markers to a station."""

    start: FloatArray
    """Markers, shape (beam, 3), in m."""
    direction: FloatArray
    """Unit vectors towards the station, shape (beam, 3)."""
    length: FloatArray
    """Distances of the station, shape (beam,), in m."""

    def __len__(self) -> int:
        return len(self.length)

    def take(self, index: BoolArray) -> "Beams":
        """Return some of the beams."""
        return Beams(self.start[index], self.direction[index], self.length[index])

    def seen_from(self, T: FloatArray) -> "Beams":
        """Return the same beams in other frames, given by their poses, shape (beam, 4, 4)."""
        start = np.einsum("nji,nj->ni", T[:, :3, :3], self.start - T[:, :3, 3])
        return Beams(start, np.einsum("nji,nj->ni", T[:, :3, :3], self.direction), self.length)


class Solid(Protocol):
    """A solid that may stand in the way of beams; both in the frame of the solid."""

    def depth(self, point: FloatArray) -> float:
        """Return how far a point, shape (3,), is under the surface, in m; not positive outside."""

    def crosses(self, beams: Beams, seat: float) -> BoolArray:
        """Return which beams are inside somewhere beyond ``seat`` (in m) from their start."""

    def crosses_again(self, beams: Beams) -> BoolArray:
        """Return which beams enter the solid after they have left it."""


class Convex(ABC):
    """A solid without hollows."""

    @abstractmethod
    def depth(self, point: FloatArray) -> float:
        """Return how far a point, shape (3,), is under the surface, in m; not positive outside."""

    @abstractmethod
    def span(self, beams: Beams) -> Span:
        """Return between which distances each beam's line is inside, in m."""

    def crosses(self, beams: Beams, seat: float) -> BoolArray:
        """Return which beams are inside somewhere beyond ``seat`` (in m) from their start."""
        enters, leaves = self.span(beams)
        return (enters < leaves) & (enters < beams.length) & (leaves > seat)

    def crosses_again(self, beams: Beams) -> BoolArray:
        """Return that no beam does."""
        return np.zeros(len(beams), dtype=bool)


@dataclass(frozen=True, eq=False)
class Box(Convex):
    """A box about its centre."""

    half: FloatArray
    """Half of the edges along x, y, z, shape (3,), in m."""

    def depth(self, point: FloatArray) -> float:
        """Return the distance under the nearest face, in m."""
        return float((self.half - np.abs(point)).min())

    def span(self, beams: Beams) -> Span:
        """Return where each line is between all three pairs of faces."""
        return _shared(*(_between(beams, axis, half) for axis, half in enumerate(self.half)))


@dataclass(frozen=True, eq=False)
class Sphere(Convex):
    """A ball about its centre."""

    radius: float
    """In m."""

    def depth(self, point: FloatArray) -> float:
        """Return the distance under the surface, in m."""
        return self.radius - float(np.linalg.norm(point))

    def span(self, beams: Beams) -> Span:
        """Return where |p + t d| <= radius."""
        return _within(beams.start, beams.direction, self.radius)


@dataclass(frozen=True, eq=False)
class Cylinder(Convex):
    """A cylinder about its centre, along z."""

    radius: float
    """In m."""
    half_length: float
    """In m."""

    def depth(self, point: FloatArray) -> float:
        """Return the distance under wall or end, in m."""
        wall = self.radius - float(np.hypot(point[0], point[1]))
        return min(wall, self.half_length - abs(float(point[2])))

    def span(self, beams: Beams) -> Span:
        """Return where each line is inside the wall and between the ends."""
        wall = _within(beams.start[:, :2], beams.direction[:, :2], self.radius)
        return _shared(wall, _between(beams, 2, self.half_length))


@dataclass(frozen=True, eq=False)
class Capsule(Convex):
    """A cylinder along z with a half ball on each end."""

    radius: float
    """In m."""
    half_length: float
    """Of the cylinder, without the half balls, in m."""

    def depth(self, point: FloatArray) -> float:
        """Return the distance under the surface, in m."""
        nearest = np.clip(point[2], -self.half_length, self.half_length)
        return self.radius - float(np.linalg.norm(point - [0.0, 0.0, nearest]))

    def span(self, beams: Beams) -> Span:
        """Return where each line is in the cylinder or in one of the balls."""
        ends = [np.array([0.0, 0.0, side * self.half_length]) for side in (-1.0, 1.0)]
        spans = [Cylinder(self.radius, self.half_length).span(beams)]
        spans += [_within(beams.start - end, beams.direction, self.radius) for end in ends]
        inside = [enters < leaves for enters, leaves in spans]
        enters = [np.where(k, span[0], np.inf) for k, span in zip(inside, spans, strict=True)]
        leaves = [np.where(k, span[1], -np.inf) for k, span in zip(inside, spans, strict=True)]
        return np.min(enters, axis=0), np.max(leaves, axis=0)


def _between(beams: Beams, axis: int, half: float) -> Span:
    """Return where each line is between the planes -half and +half of an axis."""
    along = beams.direction[:, axis]
    along = np.where(np.abs(along) < _PARALLEL, _PARALLEL, along)
    ways = (np.array([[-half], [half]]) - beams.start[:, axis]) / along
    return ways.min(axis=0), ways.max(axis=0)


def _within(start: FloatArray, direction: FloatArray, radius: float) -> Span:
    """Return where |p + t d|² <= r², a quadratic in t; shapes (beam, 2 or 3)."""
    a = np.maximum(np.sum(direction**2, axis=1), _PARALLEL)
    b = np.sum(start * direction, axis=1)
    c = np.sum(start**2, axis=1) - radius**2
    inside = b**2 - a * c
    root = np.sqrt(np.maximum(inside, 0.0))
    out = inside < 0.0
    return np.where(out, np.inf, (-b - root) / a), np.where(out, -np.inf, (-b + root) / a)


def _shared(*spans: Span) -> Span:
    """Return where each line is inside all."""
    enters, leaves = zip(*spans, strict=True)
    return np.max(enters, axis=0), np.min(leaves, axis=0)
