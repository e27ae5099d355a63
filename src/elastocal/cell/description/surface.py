"""The tooling surface: which mesh, where it stands, which part of it is used."""

import math
from typing import Annotated, Any, Self

import numpy as np
from pydantic import AfterValidator, Field, field_validator, model_validator

from elastocal.arrays import BoolArray, FloatArray
from elastocal.cell.description.pose import IDENTITY, Pose
from elastocal.cell.description.quantities import (
    Length,
    Point,
    PositiveAngle,
    Travel,
    check_exactly_one,
)
from elastocal.cell.description.shapes import MeshFile
from elastocal.records import StrictModel


class RegionBox(StrictModel):
    """All points between two corners."""

    min: Point
    max: Point

    @field_validator("max")
    @classmethod
    def _above_min(cls, value: Any, info: Any) -> Any:
        lower = info.data.get("min", (-math.inf,) * 3)
        if not all(low < high for low, high in zip(lower, value, strict=True)):
            raise ValueError("every coordinate must be above that of min")
        return value


Corner = tuple[Length, Length]


def _encloses(corners: tuple[Corner, ...]) -> tuple[Corner, ...]:
    x, y = np.array(corners).T
    area = 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    if not abs(area) > 0.0:
        raise ValueError("the polygon encloses no area")
    return corners


class RegionPolygon(StrictModel):
    """All points over or under a polygon in the x-y plane."""

    corners: Annotated[tuple[Corner, ...], Field(min_length=3), AfterValidator(_encloses)]
    """In order, either way round; the last is joined to the first."""
    height: Travel | None = None
    """Lowest and highest z; all by default."""


class RegionEntry(StrictModel):
    """A box or a polygon that bounds where poses may be."""

    pose: Pose = IDENTITY
    """Of the box or polygon in the frame of the mesh."""
    box: RegionBox | None = None
    polygon: RegionPolygon | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        check_exactly_one(box=self.box, polygon=self.polygon)
        return self

    def contains(self, points_surface: FloatArray) -> BoolArray:
        """Return whether points lie in the region, shape (point,).

        Parameters
        ----------
        points_surface : ndarray, shape (point, 3)
            In the frame of the mesh, in m.
        """
        T = self.pose.T
        own = (np.asarray(points_surface, dtype=float) - T[:3, 3]) @ T[:3, :3]
        if self.box is not None:
            inside = (own >= self.box.min) & (own <= self.box.max)
            return np.asarray(inside.all(axis=1))
        assert self.polygon is not None
        low, high = self.polygon.height or (-math.inf, math.inf)
        between = (own[:, 2] >= low) & (own[:, 2] <= high)
        return between & _in_polygon(own[:, :2], np.array(self.polygon.corners))


class SurfaceEntry(MeshFile):
    """The surface that the robot presses on."""

    pose: Pose = IDENTITY
    """Frame of the mesh in base."""
    region: RegionEntry | None = None
    flip_normals: bool = False
    """Turn the normals round; they must point to the robot's side."""
    crease_angle: PositiveAngle = math.radians(30.0)
    """Neighbouring faces that differ by more meet in an edge that the disk must not hang over."""

    @property
    def T_base_surface(self) -> FloatArray:
        """Frame of the mesh in base, shape (4, 4)."""
        return self.pose.T


def _in_polygon(points: FloatArray, corners: FloatArray) -> BoolArray:
    """Return whether a ray from each point along x crosses the polygon an odd number of times.

    Source: M. Shimrat, "Algorithm 112: Position of point relative to polygon", Communications
    of the ACM 5(8), 1962.
    """
    inside = np.zeros(len(points), dtype=bool)
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if y0 == y1:
            continue
        spans = (points[:, 1] < y0) != (points[:, 1] < y1)
        crossing = x0 + (points[:, 1] - y0) * (x1 - x0) / (y1 - y0)
        inside ^= spans & (points[:, 0] < crossing)
    return inside
