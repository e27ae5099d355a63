"""What the readings tell of a finished codec beyond its errors."""

from dataclasses import dataclass

from numpy.typing import ArrayLike

from elastocal.codec.again import trainees_of
from elastocal.codec.data import CodecData
from elastocal.codec.index_correlation import Correlation, correlate
from elastocal.codec.indices import IndexValues, index_values
from elastocal.codec.observed import Observed, observed
from elastocal.dataset import Readings
from elastocal.robot import Robot


@dataclass(frozen=True, eq=False)
class Insight:
    """Of every variant, in order."""

    seen: tuple[Observed, ...]
    """Which springs its training sets tell apart."""
    indices: tuple[IndexValues, ...] = ()
    """Indices of its training sets; empty where they were not asked for."""
    correlations: tuple[Correlation, ...] = ()
    """How those correlate with accuracy."""


def look_into(
    robot: Robot,
    readings: Readings,
    data: CodecData,
    *,
    marker_offset: ArrayLike | None = None,
    with_indices: bool = False,
) -> Insight:
    """Return what the readings tell of a codec.

    Parameters
    ----------
    robot, readings, marker_offset : Robot, Readings, array_like
        Those that the codec was made with.
    data : CodecData
        The codec.
    with_indices : bool
        Whether indices are wanted; they take about a second a variant.

    Raises
    ------
    CodecError
        If readings or layouts are not those of the codec.
    """
    trainees = trainees_of(robot, readings, data, marker_offset)
    seen = observed(robot, data, trainees)
    if not with_indices:
        return Insight(seen)
    indices = tuple(index_values(data, each) for each in trainees)
    return Insight(seen, indices, tuple(one for each in indices for one in correlate(data, each)))
