"""Rigid solids for collision (coal), ray casts (trimesh) and figures.

A straight line is inside a convex solid between two distances, which slabs and quadratics give in
closed form (Ericson, Real-Time Collision Detection, 2005, section 5.3); a mesh is tested by rays.

A new kind of solid is one class here, a line in `solid_of` and an entry in ``tests/shapes``.
"""

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import coal
import numpy as np
import trimesh

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.results import brief_repr

Span = tuple[FloatArray, FloatArray]
"""Distances along each beam between which its line is inside, in m; the first is the larger one
where the line stays outside."""

_PARALLEL = 1e-30
"""Substitute for a direction without a component across a face, so that its line meets it at
infinity."""


@brief_repr
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


class Solid(ABC):
    """A rigid solid in its own frame, lengths in m."""

    @property
    @abstractmethod
    def geometry(self) -> coal.CollisionGeometry:
        """The solid for collision checks."""

    @abstractmethod
    def triangulated(self, sections: int = 32) -> trimesh.Trimesh:
        """Return the solid as triangles, wound outward.

        Parameters
        ----------
        sections : int
            Number of sides that a round solid gets.
        """


class SightSolid(Solid):
    """A solid of which it is known where beams are inside; points and beams in its frame."""

    @abstractmethod
    def depth(self, point: FloatArray) -> float:
        """Return the depth of a point, shape (3,), in m; not positive outside."""

    @abstractmethod
    def crosses(self, beams: Beams, seat: float) -> BoolArray:
        """Return which beams are inside somewhere beyond ``seat`` (in m) from their start."""

    @abstractmethod
    def crosses_again(self, beams: Beams) -> BoolArray:
        """Return which beams enter the solid after they have left it."""


@dataclass(frozen=True, eq=False)
class OtherSolid(Solid):
    """A collision geometry of a rare kind, as a URDF may hold: drawn as its bounding box."""

    shape: coal.CollisionGeometry

    @property
    def geometry(self) -> coal.CollisionGeometry:
        """The solid for collision checks."""
        return self.shape

    def triangulated(self, sections: int = 32) -> trimesh.Trimesh:  # noqa: ARG002 - no sides are round
        """Return the box about the solid."""
        low, high = box_corners(self.shape)[[0, -1]]
        box: trimesh.Trimesh = trimesh.creation.box(high - low)
        box.apply_translation(self.shape.aabb_center)
        return box


@brief_repr
@dataclass(frozen=True, eq=False)
class Body:
    """A solid with its name and its place."""

    name: str
    solid: Solid
    T_frame_body: FloatArray
    """Place of the solid in its frame (base for obstacles, tcp for tool parts), shape (4, 4)."""

    def triangulated(self) -> trimesh.Trimesh:
        """Return the solid as triangles in its frame."""
        placed = self.solid.triangulated().copy()
        placed.apply_transform(self.T_frame_body)
        return placed


def box_corners(geometry: coal.CollisionGeometry) -> FloatArray:
    """Return the corners of the box about a collision geometry, shape (8, 3), lowest first."""
    geometry.computeLocalAABB()
    box = geometry.aabb_local
    return np.array(list(itertools.product(*zip(box.min_, box.max_, strict=True))))


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
        """Return that no beam crosses again."""
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
        """Return two triangles for each face."""
        mesh: trimesh.Trimesh = trimesh.creation.box((self.x, self.y, self.z))
        return mesh

    @property
    def _half(self) -> FloatArray:
        return 0.5 * np.array([self.x, self.y, self.z])

    def depth(self, point: FloatArray) -> float:
        """Return the distance below the nearest face, in m."""
        return float((self._half - np.abs(point)).min())

    def span(self, beams: Beams) -> Span:
        """Return the interval of each line between all three pairs of faces."""
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
        """Return the interval with |p + t d| <= radius."""
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
        """Return the interval of each line inside the wall and between the ends."""
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
        """Return the interval of each line in the cylinder or in one of the balls."""
        ends = [np.array([0.0, 0.0, side * 0.5 * self.length]) for side in (-1.0, 1.0)]
        spans = [Cylinder(self.radius, self.length).span(beams)]
        spans += [_within(beams.start - end, beams.direction, self.radius) for end in ends]
        inside = [enters < leaves for enters, leaves in spans]
        enters = [np.where(k, span[0], np.inf) for k, span in zip(inside, spans, strict=True)]
        leaves = [np.where(k, span[1], -np.inf) for k, span in zip(inside, spans, strict=True)]
        return np.min(enters, axis=0), np.max(leaves, axis=0)


def _between(beams: Beams, axis: int, half: float) -> Span:
    """Return the interval of each line between the planes -half and +half of an axis."""
    along = beams.direction[:, axis]
    along = np.where(np.abs(along) < _PARALLEL, _PARALLEL, along)
    ways = (np.array([[-half], [half]]) - beams.start[:, axis]) / along
    return ways.min(axis=0), ways.max(axis=0)


def _within(start: FloatArray, direction: FloatArray, radius: float) -> Span:
    """Return the interval with |p + t d|² <= r², a quadratic in t; shapes (beam, 2 or 3)."""
    a = np.maximum(np.sum(direction**2, axis=1), _PARALLEL)
    b = np.sum(start * direction, axis=1)
    c = np.sum(start**2, axis=1) - radius**2
    inside = b**2 - a * c
    root = np.sqrt(np.maximum(inside, 0.0))
    out = inside < 0.0
    return np.where(out, np.inf, (-b - root) / a), np.where(out, -np.inf, (-b + root) / a)


def _shared(*spans: Span) -> Span:
    """Return the common interval of each line."""
    enters, leaves = zip(*spans, strict=True)
    return np.max(enters, axis=0), np.min(leaves, axis=0)


_closest_point: Callable[[FloatArray, FloatArray], FloatArray] = trimesh.triangles.closest_point
"""Return the point of each triangle nearest to its point; trimesh gives it no types."""


@dataclass(frozen=True, eq=False)
class Mesh(SightSolid):
    """A triangle mesh. Only a closed one with outward faces has an inside."""

    mesh: trimesh.Trimesh

    @staticmethod
    def of(vertices: FloatArray, faces: IndexArray) -> "Mesh":
        """Return the mesh of vertices, shape (vertex, 3), in m, and faces, shape (face, 3)."""
        return Mesh(trimesh.Trimesh(vertices, faces, process=False))

    @cached_property
    def geometry(self) -> coal.CollisionGeometry:
        """The triangles for collision checks, in a hierarchy of bounding volumes."""
        points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
        for vertex in np.asarray(self.mesh.vertices, dtype=float):
            points.append(vertex)
        for a, b, c in np.asarray(self.mesh.faces):
            triangles.append(coal.Triangle(int(a), int(b), int(c)))
        geometry = coal.BVHModelOBBRSS()
        geometry.beginModel(len(triangles), len(points))
        geometry.addSubModel(points, triangles)
        geometry.endModel()
        return geometry

    def triangulated(self, sections: int = 32) -> trimesh.Trimesh:  # noqa: ARG002 - it is as it is
        """Return the triangles."""
        return self.mesh

    @cached_property
    def _welded(self) -> trimesh.Trimesh:
        """The mesh with equal vertices made one, so that a closed mesh is found closed."""
        return trimesh.Trimesh(self.mesh.vertices, self.mesh.faces, process=True)

    def depth(self, point: FloatArray) -> float:
        """Return the distance to the nearest triangle, in m; 0 outside."""
        if not (self._welded.is_volume and self._welded.contains(point[None])[0]):
            return 0.0
        triangles = self._welded.triangles
        nearest = _closest_point(triangles, np.tile(point, (len(triangles), 1)))
        return float(np.linalg.norm(nearest - point, axis=1).min())

    def crosses(self, beams: Beams, seat: float) -> BoolArray:
        """Return which beams meet a triangle beyond ``seat`` (in m) from their start."""
        start = beams.start + seat * beams.direction
        return self._meets(Beams(start, beams.direction, beams.length - seat), into=False)

    def crosses_again(self, beams: Beams) -> BoolArray:
        """Return which beams meet a triangle from its outer side."""
        return self._meets(beams, into=True)

    def _meets(self, beams: Beams, into: bool) -> BoolArray:
        met = np.zeros(len(beams), dtype=bool)
        if not len(beams):
            return met
        rays = self.mesh.ray
        where, beam, face = rays.intersects_location(beams.start, beams.direction, into)
        near = np.linalg.norm(where - beams.start[beam], axis=1) < beams.length[beam]
        if into:
            outward = self.mesh.face_normals[face]
            near &= np.sum(outward * beams.direction[beam], axis=1) < 0.0
        met[beam[near]] = True
        return met


def solid_of(geometry: coal.CollisionGeometry) -> Solid:
    """Return a collision geometry, such as a URDF's, as a solid."""
    if isinstance(geometry, coal.Box):
        return Box(*(2.0 * np.array(geometry.halfSide)).tolist())
    if isinstance(geometry, coal.Sphere):
        return Sphere(float(geometry.radius))
    if isinstance(geometry, coal.Cylinder):
        return Cylinder(float(geometry.radius), 2.0 * float(geometry.halfLength))
    if isinstance(geometry, coal.Capsule):
        return Capsule(float(geometry.radius), 2.0 * float(geometry.halfLength))
    if isinstance(geometry, coal.BVHModelBase):
        # A coal triangle is no sequence: it has no end.
        triangles = map(geometry.tri_indices, range(geometry.num_tris))
        faces = [(corners[0], corners[1], corners[2]) for corners in triangles]
        return Mesh.of(np.array(geometry.vertices()), np.array(faces, dtype=np.intp).reshape(-1, 3))
    return OtherSolid(geometry)
