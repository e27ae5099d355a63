"""One pose, reduced to its readings: the unloaded reference, the loads, what came after them."""

from dataclasses import dataclass

from elastocal.procedure.averaging import Reading, average
from elastocal.procedure.pose_log import PoseLog
from elastocal.procedure.streams import Streams


@dataclass(frozen=True, eq=False)
class PoseReadings:
    """Readings of a committed pose."""

    log: PoseLog
    reference: Reading | None
    """The first unloaded window; None when there is none."""
    loads: tuple[Reading, ...]
    """One a load case, in the order in which they were applied."""
    released: Reading | None
    """A later unloaded window, after the loads; None when there is none."""

    @property
    def pose(self) -> int:
        """Id in the plan."""
        return self.log.pose


def reduce_pose(log: PoseLog, streams: Streams) -> PoseReadings:
    """Return the readings of a pose.

    Parameters
    ----------
    log : PoseLog
        Its windows.
    streams : Streams
        Its raw streams.
    """
    readings = [average(streams, window) for window in log.windows]
    unloaded = [reading for reading in readings if reading.window.load_case is None]
    return PoseReadings(
        log,
        unloaded[0] if unloaded else None,
        tuple(reading for reading in readings if reading.window.load_case is not None),
        unloaded[-1] if len(unloaded) > 1 else None,
    )
