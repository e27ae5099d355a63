"""When the contact disk engages cleanly with the surface (paper 2.2)."""

import math
from typing import Any

from pydantic import field_validator

from elastocal.cell.description.quantities import Distance, PositiveAngle, PositiveLength
from elastocal.records import StrictModel


class Engagement(StrictModel):
    """Contact disk, and the way to it."""

    disk_radius: PositiveLength
    """In m."""
    normal_tolerance: PositiveAngle = math.radians(3.0)
    """Largest angle between the disk's axis and the surface's normal under it, in rad."""
    edge_margin: Distance = 5e-3
    """Least distance from the rim of the disk to an edge of the surface, in m."""
    near_contact: PositiveLength = 3e-3
    """Distance from the surface at which the unloaded readings are taken, in m."""
    approach_distance: PositiveLength = 0.1
    """Distance of the approach pose A_i from the surface, along the normal, in m."""

    @field_validator("approach_distance")
    @classmethod
    def _behind_near_contact(cls, value: float, info: Any) -> float:
        near = info.data.get("near_contact", 0.0)
        if not value > near:
            raise ValueError(f"must be above near_contact ({near:g} m)")
        return value
