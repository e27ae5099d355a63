"""The loop of a live compensation: the arm in a cycle, the newest wrench, a correction.

`LiveLoop.correction` runs in the thread of the arm's line, within the cycle: no file, no lock, no
array that could be done without. It is soft real time: a stock kernel may call it late. What no
kernel changes is what it answers: without a wrench the correction is held, then fades; in no cycle
does it move farther than the rate allows.
"""

import math
import threading
from collections.abc import Callable, Sequence
from enum import Enum
from typing import NamedTuple

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import (
    ForceSensor,
    PathCycle,
    SensorLoad,
    SensorStatus,
    Shift,
    WrenchFeed,
)
from elastocal.compensation.kernel import Function
from elastocal.compensation.online.compensator import Compensator
from elastocal.compensation.online.state import Reading, Status, Triple
from elastocal.errors import ElastocalError
from elastocal.records import record
from elastocal.units import impossible

_TARE_READINGS = 125
"""Readings in a row that the bias is taken from: half a second at 4 ms."""
_STILL_FORCE, _STILL_MOMENT = 5.0, 1.0
"""Standard deviation of a component over them above which something touches or shakes the tool, in
N and N·m."""
_ZEROED = 20.0
"""Largest force that a sensor shows which was zeroed in the air with its tool, in N."""


class LivePhase(Enum):
    """State of the loop."""

    WAITING = "waiting for the controller"
    TARING = "taking the sensor's bias in the air"
    CORRECTING = "correcting"
    ENDING = "fading out"
    OVER = "over"


class LiveSample(NamedTuple):
    """A wrench as the sensor measures it, in plain floats."""

    time: float
    """In s of the clock."""
    force: Triple
    """Raw, sensor frame, in N."""
    moment: Triple
    """Raw, sensor frame, about its origin, in N·m."""
    ok: bool


class LiveCycle(NamedTuple):
    """Readings and answer of one cycle, for the log."""

    time: float
    """In s of the clock."""
    q: Sequence[float]
    sample: LiveSample | None
    """The last that was read; None before the first."""
    wrench: tuple[float, ...]
    """Conditioned, on the robot, tcp frame: force in N, moment in N·m."""
    deflection: Triple
    half_width: float
    correction: Triple
    status: int


@record()
class LiveCounts:
    """Counts of the cycles of a live compensation, by what was in them."""

    cycles: int
    corrected: int
    """Cycles with a usable wrench."""
    held: int
    faded: int
    limited: int
    """Cycles in which the deflection asks for more than the largest correction."""
    rate_limited: int
    uncertain: int
    stale: int
    saturated: int
    """Cycles with a wrench beyond the sensor's range."""
    invalid: int
    refused: int
    """Cycles with a wrench that the sensor calls bad, or refuses."""
    restarts: int
    """Number of times that the correction began from zero, the first included."""
    largest_correction: float
    """In m."""
    largest_step: float
    """Largest change of the correction from one answer to the next, in m; from zero where a
    program begins."""
    largest_half_width: float
    """Half the widest 95 % interval of a predicted deflection, in m."""
    courses: int = 0
    """Number of courses whose offset was taken."""
    offsets_refused: int = 0
    """Number of readings of an offset that were not taken."""
    largest_offset: float = 0.0
    """In m."""


_FLAGS = {
    "held": Status.HELD,
    "faded": Status.FADED,
    "limited": Status.LIMITED,
    "rate_limited": Status.RATE,
    "uncertain": Status.UNCERTAIN,
    "stale": Status.STALE,
    "saturated": Status.SATURATED,
    "invalid": Status.INVALID,
    "refused": Status.SENSOR,
}


def newest_sample(feed: WrenchFeed) -> Callable[[], Sequence[LiveSample]]:
    """Return the reader of a cycle's newest wrench: where the filters have the cycle's rate."""

    def read() -> Sequence[LiveSample]:
        found = feed.newest()
        if found is None:
            return ()
        (x, y, z), (a, b, c) = found.force.tolist(), found.moment.tolist()
        ok = found.status is SensorStatus.OK
        return (LiveSample(found.time, (x, y, z), (a, b, c), ok),)

    return read


def every_sample(sensor: ForceSensor) -> Callable[[], Sequence[LiveSample]]:
    """Return the reader of all wrenches since the last cycle: for filters at the sensor's rate."""

    def read() -> Sequence[LiveSample]:
        block = sensor.read()
        ok = block.status is SensorStatus.OK
        rows = zip(block.time.tolist(), block.force.tolist(), block.moment.tolist(), strict=True)
        return [LiveSample(t, (x, y, z), (a, b, c), ok) for t, (x, y, z), (a, b, c) in rows]

    return read


class Tare:
    """The bias of a sensor, where no tool file says it: readings in the air less the tool's weight.

    Parameters
    ----------
    load : SensorLoad
        The tool, as the cell file has it; without bias and matrix.
    orientation : Function
        R_base_tcp at joints, by rows; of the model.
    largest : float
        Force beyond the tool's weight from which the tool is not free, in N.
    """

    def __init__(self, load: SensorLoad, orientation: Function, largest: float = math.inf) -> None:
        self._load, self._orientation, self._largest = load, orientation, largest
        self._rows: list[FloatArray] = []
        self._time = -math.inf
        self.bias: tuple[float, ...] | None = None
        """In N and N·m, six numbers; None as long as it is not known."""
        self.scatter: tuple[float, float] | None = None
        """Largest standard deviation of a component in the last window, in N and N·m."""
        self.refusal = ""
        """Why the last window gave no bias although it was quiet; empty: it was not quiet."""

    def take(self, q: Sequence[float], sample: LiveSample) -> None:
        """Take a reading; the bias is known after half a second in which nothing has changed."""
        if not sample.ok or self.bias is not None or not sample.time > self._time:
            return
        self._time = sample.time
        T = np.eye(4)
        T[:3, :3] = np.reshape(self._orientation(q), (3, 3))
        weight = self._load.weight(self._load.R_base_sensor(T))
        self._rows.append(np.array([*sample.force, *sample.moment]) - weight)
        if len(self._rows) < _TARE_READINGS:
            return
        rows, self._rows = np.array(self._rows), []
        spread = rows.std(axis=0)
        self.scatter = float(spread[:3].max()), float(spread[3:].max())
        mean = rows.mean(axis=0)
        known = impossible("force", *mean[:3].tolist()) or impossible("moment", *mean[3:].tolist())
        quiet = self.scatter[0] <= _STILL_FORCE and self.scatter[1] <= _STILL_MOMENT
        # A press that was taken for a bias would be corrected the other way when the tool is free.
        size, shown = math.hypot(*mean[:3].tolist()), math.hypot(*sample.force)
        pressed = not (size <= self._largest or shown <= _ZEROED)
        self.refusal = (
            f"{size:.0f} N beyond the tool's weight, at most {self._largest:.0f} N can be the bias:"
            " the tool must be free, or a tool file state the bias"
            if quiet and pressed
            else ""
        )
        if known is None and quiet and not self.refusal:
            self.bias = tuple(mean.tolist())


class LiveLoop:
    """Corrects a path, cycle by cycle; see `elastocal.cell.PathSource`.

    Parameters
    ----------
    compensator : Compensator
        Conditions and corrects.
    samples : callable
        Returns the wrenches since the last cycle, oldest first; may raise `ElastocalError`.
    tare : Tare, optional
        Where the bias is to be taken first; nothing is corrected before that.
    log : callable, optional
        Takes a cycle, at once.
    begin : callable, optional
        Called once, in the thread of the loop, before its first cycle.
    """

    def __init__(
        self,
        compensator: Compensator,
        samples: Callable[[], Sequence[LiveSample]],
        tare: Tare | None = None,
        log: Callable[[LiveCycle], None] | None = None,
        begin: Callable[[], None] | None = None,
    ) -> None:
        self._compensator, self._samples, self._tare = compensator, samples, tare
        self._log, self._begin = log, begin
        self._hold = compensator.design.settings.hold_cycles
        self._state = compensator.start()
        self._bias: tuple[float, ...] = (0.0,) * 6
        self._ending = False
        self._statuses: dict[int, int] = {}
        self._restarts = self._courses = self._not_taken = 0
        self._largest_offset = 0.0
        self._begins: Triple | None = None
        self._ends = False
        self._longest = self._farthest = self._widest = 0.0
        self.phase = LivePhase.WAITING
        self.over = threading.Event()
        """Set when the correction has faded to zero after `finish`."""
        self.refusal = ""
        """Why the sensor gives nothing to correct by; empty as long as it does."""
        self.last: LiveCycle | None = None
        """The newest cycle; None before the first."""

    def finish(self) -> None:
        """Fade out from now on; from any thread, any number of times."""
        self._ending = True

    def begin_course(self, beyond: Triple) -> None:
        """Take the offset of a course in the next cycle with a reading, from any thread.

        Parameters
        ----------
        beyond : tuple of float
            What marker and controller showed beyond the deflection that was predicted then, in
            base, in m; see `Compensator.begin_course`.
        """
        self._begins = beyond

    def end_course(self) -> None:
        """Let the offset of a course go from the next cycle on, from any thread."""
        self._ends = True

    def correction(self, cycle: PathCycle) -> Shift | None:
        """Return the correction of a cycle; None once it has faded out."""
        if self.phase is LivePhase.WAITING and self._begin is not None:
            self._begin()
            self._begin = None
        if cycle.begins:
            self._state = self._compensator.start()
            self._begins, self._ends = None, False
            self._restarts += 1
        if cycle.effect is not None:
            # Answers get lost: the ramp goes on from what the controller holds.
            self._state = self._state._replace(correction=cycle.effect)
        sample = self._read(cycle.q)
        if self.phase is LivePhase.OVER:
            return None
        if self._ending:
            return self._faded(cycle, sample)
        if self._tare is not None and self._tare.bias is None:
            self.phase = LivePhase.TARING
            return self._answer(cycle, sample)
        self.phase = LivePhase.CORRECTING
        return self._answer(cycle, sample)

    def _read(self, q: Sequence[float]) -> LiveSample | None:
        """Condition what the sensor gives; return the last of it."""
        state, condition, sample = self._state, self._compensator.condition, None
        try:
            samples = self._samples()
        except ElastocalError as error:
            self.refusal = str(error)
            self._state = state._replace(fresh=False, problem=Status.SENSOR.value)
            return None
        self.refusal = "" if not samples or samples[-1].ok else "it calls its newest sample bad"
        if self._tare is not None and self._tare.bias is None:
            for sample in samples:
                self._tare.take(q, sample)
            if self._tare.bias is not None:
                self._bias = self._tare.bias
            self.refusal = self.refusal or self._tare.refusal
            return sample
        bx, by, bz, ba, bb, bc = self._bias
        for sample in samples:
            (x, y, z), (a, b, c) = sample.force, sample.moment
            reading = Reading(
                sample.time, q, (x - bx, y - by, z - bz), (a - ba, b - bb, c - bc), sample.ok
            )
            state = condition(state, reading)
        self._state = state
        return sample

    def _answer(self, cycle: PathCycle, sample: LiveSample | None) -> Triple:
        """Return the correction of the state, and note it."""
        here = self._state.correction
        before = here if self.last is None or cycle.begins else self.last.correction
        self._state, answer = self._compensator.correct(self._state, cycle.q)
        if self._ends or self._begins is not None:
            self._take_course(cycle.q, bool(answer.status & Status.HELD.value))
        correction, status = here if cycle.holds else answer.correction, answer.status
        self._statuses[status] = self._statuses.get(status, 0) + 1
        self._farthest = max(self._farthest, math.dist(before, correction))
        self._longest = max(self._longest, math.hypot(*correction))
        self._widest = max(self._widest, answer.half_width)
        self.last = LiveCycle(
            cycle.time,
            cycle.q,
            sample,
            self._state.wrench,
            answer.deflection,
            answer.half_width,
            correction,
            status,
        )
        if self._log is not None:
            self._log(self.last)
        return correction

    def _take_course(self, q: Sequence[float], holds: bool) -> None:
        """Begin or end a course, as another thread has asked."""
        if self._ends:
            self._ends = False
            self._state = self._compensator.end_course(self._state)
        if self._begins is None or holds:
            # Between two readings of the sensor the present load is not known.
            return
        # The load may have changed since the tracker was read.
        (x, y, z), (dx, dy, dz) = self._begins, self._state.deflection
        self._begins = None
        self._state = self._compensator.begin_course(self._state, q, (x + dx, y + dy, z + dz))
        self._courses += not self._state.refused
        self._not_taken += bool(self._state.refused)
        self._largest_offset = max(self._largest_offset, math.hypot(*self._state.offset))

    def _faded(self, cycle: PathCycle, sample: LiveSample | None) -> Triple:
        self.phase = LivePhase.ENDING
        # As without a reading, and the hold over: at the rate of the fade, to zero.
        self._state = self._state._replace(fresh=False, missed=self._hold)
        correction = self._answer(cycle, sample)
        if correction == (0.0, 0.0, 0.0):
            self.phase = LivePhase.OVER
            self.over.set()
        return correction

    def counts(self) -> LiveCounts:
        """Return the counts so far."""
        statuses = self._statuses.copy()
        found = {
            name: sum(times for status, times in statuses.items() if status & flag)
            for name, flag in _FLAGS.items()
        }
        without = Status.HELD | Status.FADED
        return LiveCounts(
            cycles=sum(statuses.values()),
            corrected=sum(times for status, times in statuses.items() if not status & without),
            **found,
            restarts=self._restarts,
            largest_correction=self._longest,
            largest_step=self._farthest,
            largest_half_width=self._widest,
            courses=self._courses,
            offsets_refused=self._not_taken,
            largest_offset=self._largest_offset,
        )
