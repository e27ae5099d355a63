"""What a link to a controller has counted: messages, refusals, and times of its answers."""

import math
import re
from collections import deque
from dataclasses import dataclass, field

import numpy as np

from elastocal.cell import AnswerTimes, LineCounts
from elastocal.records import record

_KEPT = 20_000
"""Messages whose distances are kept for the statistics."""


@record()
class LinkStatistics:
    """Counts of a link since it was opened, and times of its answers."""

    received: int
    answered: int
    lost: int
    """Messages that never came, by the gaps of IPOC."""
    skipped: int
    """Messages that were not answered, because a newer one had come."""
    out_of_order: int
    jumps: int
    late: int
    """Answers that took longer than seven eighths of a cycle."""
    malformed: int
    foreign: int
    """Datagrams of others than the controller; they are neither read nor answered."""
    overtures: int
    """Short first messages of RSI 2."""
    controller_delay: int | None
    """Largest Delay D that the controller has reported; None when it does not send it."""
    answer_median: float
    """From datagram in to datagram out, in s; NaN before the first."""
    answer_p99: float
    answer_longest: float
    jitter: float
    """Standard deviation of the time between messages, in s."""
    first_refused: str = ""
    """Why the first malformed message was refused; empty: none was."""
    last_refused: str = ""
    """Why the last one was."""

    @property
    def refused(self) -> str:
        """Why messages were refused, in words: the first reason, and the last if it is another."""
        first, last = self.first_refused, self.last_refused
        return first if _kind(first) == _kind(last) else f"first {first}, last {last}"

    def counts(self, saturated: int, device: str) -> LineCounts:
        """Return the counts as the record of a run has them.

        Parameters
        ----------
        saturated : int
            Cycles in which the controller clamped.
        device : str
            Name with address.
        """
        times = (self.answer_median, self.answer_p99, self.answer_longest)
        return LineCounts(
            device=device,
            received=self.received,
            lost=self.lost + self.skipped,
            late=self.late,
            out_of_order=self.out_of_order,
            jumps=self.jumps,
            malformed=self.malformed,
            foreign=self.foreign,
            saturated=saturated,
            answer=times if self.answered else None,
            refused=self.refused,
        )

    def sentence(self) -> str:
        """Return the counts in words."""
        times = f"{1e3 * self.answer_median:.2f} / {1e3 * self.answer_p99:.2f}"
        return (
            f"{self.answered} of {self.received} messages answered in {times} /"
            f" {1e3 * self.answer_longest:.2f} ms (median, 99 %, longest); {self.lost} lost,"
            f" {self.skipped} skipped, {self.late} late, {self.out_of_order} out of order,"
            f" {self.jumps} IPOC jumps, {self.malformed} malformed"
            f"{f' ({self.refused})' if self.refused else ''}, {self.foreign} foreign"
        )


@dataclass
class LinkCounts:
    """The counts of a link as they grow, in its thread."""

    received: int = 0
    answered: int = 0
    skipped: int = 0
    out_of_order: int = 0
    jumps: int = 0
    late: int = 0
    malformed: int = 0
    foreign: int = 0
    overtures: int = 0
    first_refused: str = ""
    last_refused: str = ""
    controller_delay: int | None = None
    took: AnswerTimes = field(default_factory=AnswerTimes)
    between: deque[float] = field(default_factory=lambda: deque(maxlen=_KEPT))

    def refuse(self, reason: str) -> None:
        """Count a message that was refused."""
        self.malformed += 1
        self.first_refused, self.last_refused = self.first_refused or reason, reason

    def statistics(self, lost: int) -> LinkStatistics:
        """Return the counts so far.

        Parameters
        ----------
        lost : int
            Messages that never came.
        """
        median, p99 = self.took.quantile(0.5), self.took.quantile(0.99)
        between = list(self.between)
        return LinkStatistics(
            received=self.received,
            answered=self.answered,
            lost=lost,
            skipped=self.skipped,
            out_of_order=self.out_of_order,
            jumps=self.jumps,
            late=self.late,
            malformed=self.malformed,
            foreign=self.foreign,
            overtures=self.overtures,
            controller_delay=self.controller_delay,
            answer_median=math.nan if median is None else median,
            answer_p99=math.nan if p99 is None else p99,
            answer_longest=self.took.longest if self.took.count else math.nan,
            jitter=float(np.std(between)) if between else float("nan"),
            first_refused=self.first_refused,
            last_refused=self.last_refused,
        )


def _kind(reason: str) -> str:
    """Return a reason without what it quotes: the same fault names other numbers each time."""
    return re.sub(r"'[^']*'", "", reason)
