"""An arm on a programmed path that takes corrections each cycle, and the protocol of its driver.

`elastocal live` needs no `RobotArm`: the controller's own program moves the arm and the PC adds
corrections. A driver that can do so is a `PathDriver` as well as a `Driver`; the layers above it
know no brand.
"""

from bisect import bisect_left
from collections.abc import Sequence
from itertools import accumulate
from typing import TYPE_CHECKING, NamedTuple, Protocol, runtime_checkable

from elastocal.cell.rig import DeviceSettings, Driver, RigContext
from elastocal.records import record

if TYPE_CHECKING:
    from elastocal.cell.cell import Cell

Shift = tuple[float, float, float]
"""A translation in m."""
_BIN = 5e-6
"""Resolution of the times of answers, in s."""
_BINS = 8000
"""The last bin counts what takes longer than 40 ms; the longest time is kept as it is."""


class PathCycle(NamedTuple):
    """The arm in one cycle of its controller. Plain floats: it is made 250 times a second."""

    time: float
    """When its message came, in s of the clock."""
    q: Sequence[float]
    """Joint positions of the controller, in rad or m, in the order of the robot's joints."""
    begins: bool
    """Whether the program begins without correction: in the first cycle or after a restart."""
    effect: Shift | None = None
    """Correction in effect, in m, that the answer goes on from; None: the last answer."""
    holds: bool = False
    """Whether the answer will be `effect`: the one before was lost, and what is lost must not add
    up."""


class PathSource(Protocol):
    """Computes the corrections of a path, in the loop of the arm's driver."""

    def correction(self, cycle: PathCycle) -> Shift | None:
        """Return the whole correction, at once, in the axes that `PathLimits.frame` names.

        None ends the corrections: the arm then has none, and its controller is sent the order to
        end.
        """


@record()
class PathLimits:
    """Limits of the corrections of a path, as the cell file states them; never defaults."""

    correction: float
    """Largest correction, in m."""
    rate: float
    """Fastest change of it, in m/s."""
    cycle: float
    """Cycle of the controller, in s."""
    frame: str
    """Axes that it takes corrections in: ``base`` or ``tcp``."""


@record()
class CycleStatistics:
    """Counts of the cycles of an arm's line, and times from datagram in to datagram out."""

    received: int
    answered: int
    lost: int
    """Messages that never came."""
    skipped: int
    """Messages that were not answered, because a newer one had come."""
    out_of_order: int
    jumps: int
    """Number of times that the controller's counter has jumped because its program was
    restarted."""
    malformed: int
    foreign: int
    """Datagrams of others than the controller."""
    late: int
    """Answers that took longer than seven eighths of a cycle."""
    saturated: int
    """Cycles in which more was wanted than the largest correction."""
    controller_delay: int | None
    """Most cycles without an answer that the controller has reported; none: it does not say."""
    answer_p50: float | None
    """Median of the times of answers, in s; none before the first."""
    answer_p99: float | None
    answer_p999: float | None
    answer_longest: float | None
    jitter: float | None
    """Standard deviation of the time between messages, in s."""
    largest_step: float = 0.0
    """Largest change of the correction from one answer to the next, in m; from zero where a program
    begins."""
    withheld: int = 0
    """Cycles that were not answered because the correction in effect was unknown."""
    refused: str = ""
    """Why malformed messages were refused; empty: none was, or the driver does not say."""

    @property
    def late_share(self) -> float:
        """Share of the answers that were late."""
        return self.late / self.answered if self.answered else 0.0

    def sentence(self) -> str:
        """Return times and counts in words."""
        times = (self.answer_p50, self.answer_p99, self.answer_p999, self.answer_longest)
        shown = " / ".join("-" if time is None else f"{1e3 * time:.2f}" for time in times)
        return (
            f"{self.answered} of {self.received} answered in {shown} ms (median, 99 %, 99.9 %,"
            f" longest); {self.late} late, {self.lost} lost, {self.skipped} skipped,"
            f" {self.out_of_order} out of order, {self.jumps} jumps of the count, {self.malformed}"
            f" malformed{f' ({self.refused})' if self.refused else ''}, {self.foreign} foreign"
        )


class AnswerTimes:
    """Times of answers, counted in bins: as quick after a day as in the first second."""

    def __init__(self) -> None:
        self._bins = [0] * _BINS
        self.count = 0
        self.longest = 0.0

    def add(self, time: float) -> None:
        """Count a time in s."""
        place = int(time / _BIN)
        self._bins[place if place < _BINS else _BINS - 1] += 1
        self.count += 1
        if time > self.longest:
            self.longest = time

    def quantile(self, share: float) -> float | None:
        """Return the time that a share of all is not above, in s, to 5 µs; None before the first.

        >>> times = AnswerTimes()
        >>> for k in range(10):
        ...     times.add(1e-6 * (100 * k + 1))
        >>> round(times.quantile(0.5), 9)
        0.000405
        """
        if not self.count:
            return None
        place = bisect_left(list(accumulate(self._bins)), share * self.count)
        return min(_BIN * (place + 1), self.longest)


class CorrectedArm(Protocol):
    """An arm that is corrected on its path; its driver calls the source each cycle, in a thread."""

    def wait(self, seconds: float) -> bool:
        """Return whether the controller has spoken, at the latest after a time of the wall."""

    def require(self) -> None:
        """Refuse to go on with a line that has failed.

        Raises
        ------
        DeviceError
            With why.
        """

    def statistics(self) -> CycleStatistics:
        """Return the counts so far."""

    def close(self) -> None:
        """Answer no more."""


@runtime_checkable
class PathDriver(Driver, Protocol):
    """A driver whose arm takes corrections of a path."""

    def path_limits(self, cell: "Cell", settings: DeviceSettings) -> PathLimits:
        """Return the limits that the cell file states.

        Raises
        ------
        DeviceError
            If it states none, or the arm is set up for something else.
        """

    def correct_path(
        self, cell: "Cell", settings: DeviceSettings, context: RigContext, source: PathSource
    ) -> CorrectedArm:
        """Listen to the controller, and answer with what the source computes, from now on.

        Raises
        ------
        DeviceError
            If the line is not available.
        """
