"""The base of all solids: what collision checks, the line of sight and pictures ask of them."""

import itertools
from abc import ABC, abstractmethod
from dataclasses import dataclass

import coal
import numpy as np
import trimesh

from elastocal.arrays import BoolArray, FloatArray
from elastocal.results import brief_repr


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

    @property
    def corners(self) -> FloatArray:
        """Corners of the box about the solid, along its axes, shape (8, 3), in m."""
        return box_corners(self.geometry)


class SightSolid(Solid):
    """A solid of which it is known where beams are inside; points and beams in its frame."""

    @abstractmethod
    def depth(self, point: FloatArray) -> float:
        """Return how far a point, shape (3,), is under the surface, in m; not positive outside."""

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
        low, high = self.corners[0], self.corners[-1]
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
