"""Check ``engagement``: the whole contact disk lies on the surface (spec section 2)."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.planning.checks.check import PointCheck
from elastocal.planning.surface import DiskFit
from elastocal.results import brief_repr


@brief_repr
@dataclass(frozen=True, eq=False)
class EdgeCheck(PointCheck):
    """Distance from the contact point to the nearest edge, less disk radius and margin."""

    edge_distance: FloatArray
    """Distance of each sampled point from the edge, shape (point,), in m."""
    radius: float
    """Radius of the contact disk in m."""
    keep: float
    """Distance to keep between disk and edge, in m."""
    name: str = "edge"
    unit: str = "m"
    advice: str = "use a smaller disk or edge margin: so many points are too near to an edge"

    @property
    def at_points(self) -> FloatArray:
        """Margin of each sampled point, shape (point,), in m."""
        return np.asarray(self.edge_distance - self.radius - self.keep)


@dataclass(frozen=True, eq=False)
class FlatnessCheck(PointCheck):
    """Tolerance of the normals under the disk, less the largest angle between them."""

    fit: DiskFit
    """How a disk lies at each sampled point."""
    tolerance: float
    """Largest angle between the normal at the centre and under the disk, in rad."""
    name: str = "flatness"
    unit: str = "rad"
    advice: str = "use a smaller disk, or allow a larger angle: the surface is too curved"

    @property
    def at_points(self) -> FloatArray:
        """Margin of each sampled point, shape (point,), in rad."""
        return np.asarray(self.tolerance - np.where(self.fit.supported, self.fit.angle, np.pi))
