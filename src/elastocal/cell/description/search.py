"""How poses are searched for."""

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from elastocal.cell.description.quantities import PositiveLength
from elastocal.records import StrictModel

DEFAULT_POSES = 31
"""Number of poses of the paper's first case study."""


MOST_CANDIDATES = 10_000_000
"""Largest pool; with more, no memory would hold the candidates."""


class Search(StrictModel):
    """Pool and technique; ends at ``poses`` or at ``d_max``, whichever comes first."""

    technique: str = "cover"
    """Name of a search technique (`elastocal.planning.search`)."""
    metric: Literal["euclidean", "geodesic"] = "euclidean"
    """How COVER measures the distance between contact points."""
    poses: Annotated[int, Field(ge=1, le=MOST_CANDIDATES)] | None = None
    """Largest number of poses N."""
    d_max: PositiveLength | None = None
    """Cover distance at which COVER may stop, in m."""
    pool: Annotated[int, Field(ge=1, le=MOST_CANDIDATES)] = 3000
    """Number of candidates."""
    sampling: Literal["blue_noise", "uniform"] = "blue_noise"
    """How candidate points are spread: keeping their distance, or each by itself."""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 0
    """Of everything random."""

    @field_validator("pool")
    @classmethod
    def _holds_the_poses(cls, pool: int, info: Any) -> int:
        poses = info.data.get("poses")
        if poses is not None and not poses <= pool:
            raise ValueError(f"must be at least the {poses} poses that are to be chosen")
        return pool

    @property
    def most(self) -> int | None:
        """Largest number of poses; None when only ``d_max`` ends the search."""
        if self.poses is None and self.d_max is None:
            return DEFAULT_POSES
        return self.poses
