"""Boxes, balls, cylinders and capsules, and where straight beams are inside them.

A line is inside a convex solid between two distances, which slabs and quadratics give in closed
form (Ericson, Real-Time Collision Detection, 2005, section 5.3).
"""

import math
from abc import abstractmethod
from dataclasses import dataclass

import coal
import numpy as np
import trimesh

from elastocal.arrays import BoolArray, FloatArray
from elastocal.shapes.solid import Beams, SightSolid

Span = tuple[FloatArray, FloatArray]
"""Distances along each beam between which its line is inside, in m; the first is the larger one
where the line stays outside."""

_PARALLEL = 1e-30
"""Put for a direction that has no part across a face, so that its line meets it at infinity."""


class Convex(SightSolid):
    """A solid without hollows."""

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
    """A box about its centre, by the lengths of its edges in m."""

    x: float
    y: float
    z: float

    @property
    def geometry(self) -> coal.CollisionGeometry:
        """The box for collision checks."""
        return coal.Box(self.x, self.y, self.z)

    def triangulated(self, sections: int = 32) -> trimesh.Trimesh:  # noqa: ARG002 - no sides are round
        """Return two triangles a face."""
        mesh: trimesh.Trimesh = trimesh.creation.box((self.x, self.y, self.z))
        return mesh

    @property
    def _half(self) -> FloatArray:
        return 0.5 * np.array([self.x, self.y, self.z])

    def depth(self, point: FloatArray) -> float:
        """Return the distance under the nearest face, in m."""
        return float((self._half - np.abs(point)).min())

    def span(self, beams: Beams) -> Span:
        """Return where each line is between all three pairs of faces."""
        return _shared(*(_between(beams, axis, half) for axis, half in enumerate(self._half)))


@dataclass(frozen=True, eq=False)
class Sphere(Convex):
    """A ball about its centre."""

    radius: float
    """In m."""

    @property
    def geometry(self) -> coal.CollisionGeometry:
        """The ball for collision checks."""
        return coal.Sphere(self.radius)

    def triangulated(self, sections: int = 32) -> trimesh.Trimesh:
        """Return an icosphere: n times halved, it has about 5 · 2^n sides along an equator."""
        mesh: trimesh.Trimesh = trimesh.creation.icosphere(
            round(math.log2(sections / 5.0)), self.radius
        )
        return mesh

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
    length: float
    """In m."""

    @property
    def geometry(self) -> coal.CollisionGeometry:
        """The cylinder for collision checks."""
        return coal.Cylinder(self.radius, self.length)

    def triangulated(self, sections: int = 32) -> trimesh.Trimesh:
        """Return a prism with as many sides."""
        mesh: trimesh.Trimesh = trimesh.creation.cylinder(
            self.radius, self.length, sections=sections
        )
        return mesh

    def depth(self, point: FloatArray) -> float:
        """Return the distance under wall or end, in m."""
        wall = self.radius - float(np.hypot(point[0], point[1]))
        return min(wall, 0.5 * self.length - abs(float(point[2])))

    def span(self, beams: Beams) -> Span:
        """Return where each line is inside the wall and between the ends."""
        wall = _within(beams.start[:, :2], beams.direction[:, :2], self.radius)
        return _shared(wall, _between(beams, 2, 0.5 * self.length))


@dataclass(frozen=True, eq=False)
class Capsule(Convex):
    """A cylinder along z with a half ball on each end."""

    radius: float
    """In m."""
    length: float
    """Length of the cylinder, without the half balls, in m."""

    @property
    def geometry(self) -> coal.CollisionGeometry:
        """The capsule for collision checks."""
        return coal.Capsule(self.radius, self.length)

    def triangulated(self, sections: int = 32) -> trimesh.Trimesh:  # noqa: ARG002 - always alike fine
        """Return trimesh's capsule."""
        return trimesh.creation.capsule(self.length, self.radius)

    def depth(self, point: FloatArray) -> float:
        """Return the distance under the surface, in m."""
        half = 0.5 * self.length
        nearest = np.clip(point[2], -half, half)
        return self.radius - float(np.linalg.norm(point - [0.0, 0.0, nearest]))

    def span(self, beams: Beams) -> Span:
        """Return where each line is in the cylinder or in one of the balls."""
        ends = [np.array([0.0, 0.0, side * 0.5 * self.length]) for side in (-1.0, 1.0)]
        spans = [Cylinder(self.radius, self.length).span(beams)]
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
