"""A laser tracker, or anything else that measures where the marker is."""

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from elastocal.arrays import FloatArray


class BeamState(Enum):
    """Whether the instrument sees the marker."""

    LOCKED = "locked"
    BROKEN = "broken"


@dataclass(frozen=True, eq=False)
class PointBlock:
    """Marker positions since the last look, in the station's own frame."""

    time: FloatArray
    """Shape (sample,), in s of the clock, ascending."""
    position: FloatArray
    """Shape (sample, 3), in m, tracker frame."""
    sigma: FloatArray
    """Standard deviation of one sample along each axis of the tracker frame, shape (sample, 3),
    in m; NaN when the maker does not say."""
    beam: BeamState
    """At the end of the block."""
    station: str
    """Which station measures."""
    source: str

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.time)


class Metrology(Protocol):
    """One or several stations; at any time one of them measures."""

    @property
    def stations(self) -> tuple[str, ...]:
        """Names of the stations."""

    @property
    def rate(self) -> float:
        """Nominal number of samples a second."""

    def look(self, station: str) -> None:
        """Measure with this station from now on, and find the marker again if it was lost.

        Returns at once; `read` says whether it was found.
        """

    def read(self) -> PointBlock:
        """Return the positions since the last call, at once; none while the beam is broken."""
