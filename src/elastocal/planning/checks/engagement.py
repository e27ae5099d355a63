"""Checks ``edge`` and ``flatness``: the whole contact disk lies on the surface, and flat.

The paper's section 2.2: only where the disk engages is the load case what it says.
"""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.planning.checks.check import PointCheck
from elastocal.planning.surface import (
    DiskFit,
    Surface,
    SurfacePoints,
    distance_to_boundary,
    fit_disk,
)
from elastocal.results import brief_repr
from elastocal.wording import phrase


@brief_repr
@dataclass(frozen=True, eq=False)
class EdgeCheck(PointCheck):
    """Distance from the contact point to the nearest edge, less disk radius and margin."""

    edge_distance: FloatArray
    """Distance of each sampled point from the edge, shape (point,), in m."""
    radius: float
    """Radius of the contact disk in m."""
    edge_margin: float
    """Least distance between disk and edge, in m."""
    name: str = "edge"
    unit: str = "m"
    advice: str = phrase("use a smaller disk or edge margin: points near an edge are refused")
    order: ClassVar[int] = 10

    @classmethod
    def of(cls, cell: Cell, surface: Surface, points: SurfacePoints) -> Self:
        """Return the check of some points of the surface."""
        engagement = cell.file.engagement
        distance = distance_to_boundary(surface, points)
        return cls(distance, engagement.disk_radius, engagement.edge_margin)

    @property
    def at_points(self) -> FloatArray:
        """Margin of each sampled point, shape (point,), in m."""
        return np.asarray(self.edge_distance - self.radius - self.edge_margin)


@dataclass(frozen=True, eq=False)
class FlatnessCheck(PointCheck):
    """Tolerance of the normals under the disk, less the largest angle between them."""

    fit: DiskFit
    """Fit of a disk at each sampled point."""
    normal_tolerance: float
    """Largest angle between the normal at the centre and under the disk, in rad."""
    name: str = "flatness"
    unit: str = "rad"
    advice: str = phrase("use a smaller disk, or allow a larger angle: the surface is too curved")
    order: ClassVar[int] = 20

    @classmethod
    def of(cls, cell: Cell, surface: Surface, points: SurfacePoints) -> Self:
        """Return the check of some points of the surface."""
        engagement = cell.file.engagement
        return cls(fit_disk(surface, points, engagement.disk_radius), engagement.normal_tolerance)

    @property
    def at_points(self) -> FloatArray:
        """Margin of each sampled point, shape (point,), in rad."""
        return np.asarray(
            self.normal_tolerance - np.where(self.fit.supported, self.fit.angle, np.pi)
        )
