"""A force/torque sensor: a stream of raw wrenches with their times and states."""

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from elastocal.arrays import FloatArray


class SensorStatus(Enum):
    """State of the sensor over a block of samples; the worst of them."""

    OK = "ok"
    SATURATED = "saturated"
    """A gauge or the range of an axis is exceeded: the values are not to be used."""
    FAULT = "fault"
    """The device says that it cannot measure."""


@dataclass(frozen=True, eq=False)
class WrenchBlock:
    """Samples since the last look, as the sensor measures them.

    Raw: in the sensor's own frame, bias and tool weight still in. An empty block means that
    nothing has come.
    """

    time: FloatArray
    """Shape (sample,), in s of the clock, ascending."""
    force: FloatArray
    """Force on the tool side, shape (sample, 3), sensor frame, in N."""
    moment: FloatArray
    """Moment about the sensor's origin, shape (sample, 3), in N·m."""
    force_sigma: float
    """Standard deviation of one sample and axis, in N; NaN when the maker does not say."""
    moment_sigma: float
    """The same of the moment, in N·m."""
    status: SensorStatus
    source: str

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.time)


class ForceSensor(Protocol):
    """A six-axis sensor between flange and tool."""

    @property
    def rate(self) -> float:
        """Nominal number of samples a second."""

    def read(self) -> WrenchBlock:
        """Return the samples since the last call; the newest few hundred when there are more.

        Returns at once, empty when nothing has come.
        """
