"""The stream of a Net F/T box as a force sensor: numbering, loss, stall, status."""

import threading
from collections import deque

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import (
    Clock,
    DeviceReading,
    LineCounts,
    SensorStatus,
    WrenchBlock,
    WrenchSample,
    three,
)
from elastocal.drivers.net_ft.protocol import (
    CountScale,
    RdtRecord,
    parse_records,
    status_names,
    status_of,
)
from elastocal.errors import DeviceError, present

_NEWEST = 1000
"""Samples that are kept for a caller that does not look; older ones are lost."""
_LATE = 64
"""A record that comes so many places after a later one is dropped; beyond, the count restarted."""
_WINDOW = 1000
"""Records over which the share that is lost is judged."""
_MOST_LOST = 0.1
_STANDING = 100
"""Records without progress of the box's own counter after which it counts as stalled."""
_MOST_STATES = 16
"""Words of status that are remembered."""
_MOST_MALFORMED = 10
"""Datagrams in a row that are no records."""
_FOLLOWS = 1e-3
"""How fast the way from the box to here may grow, in s a second: beyond is a slower quartz."""
_LONGEST_WAY = 0.05
"""In s: a sample is never taken for older."""
_SILENT = 0.5
"""Age of the newest record from which on none comes any more, in s."""
_WRAP = 1 << 32
_BACK = 1 << 31


class NetFtSensor:
    """Samples of one box; see `elastocal.cell.devices.ForceSensor` and `elastocal.cell.WrenchFeed`.

    Datagrams come in by `received`, from whatever thread. What is wrong with the stream is raised
    at the next `read`, and ever after: forces that nobody can trust end a run. `newest` refuses
    only a stream that cannot be trusted again (`fail`: the box was started anew, or its counts mean
    something else); a bad status is a bad sample, and nonsense and repetitions are none
    (`leave_hole`).

    Parameters
    ----------
    clock : Clock
        Of the rig. Samples are as far apart as the box says, and have the time of arrival of those
        that came quickest.
    scale : CountScale
        As the box states it.
    rate : float
        Records a second, as the box states it.
    source : str
        The box, for messages.
    """

    def __init__(self, clock: Clock, scale: CountScale, rate: float, source: str) -> None:
        self.rate = rate
        self.source = source
        self.lost = self.late = self.malformed = 0
        """Records that never came; that came after later ones; datagrams that were none."""
        self.taken = self.saturated = 0
        """Records that were taken; those of them beyond a range."""
        self._states: set[int] = set()
        self._clock, self._scale = clock, scale
        self._lock = threading.Lock()
        self._rows: deque[tuple[float, tuple[int, ...]]] = deque(maxlen=_NEWEST)
        self._saturated = False
        self._newest: tuple[float, tuple[int, ...], SensorStatus] | None = None
        self._failure: str | None = None
        self.hole = ""
        """Why samples are missing, or bad; empty as long as none are."""
        self._last: RdtRecord | None = None
        self._time = self._arrived = -np.inf
        self._count = 0
        """Place of the last record in the stream, wraps of its number undone."""
        self._offset = np.inf
        """Time of arrival less place over rate, of those that came quickest."""
        self._standing = self._malformed_now = 0
        self._window = self._window_lost = 0

    def received(self, datagram: bytes) -> None:
        """Take a datagram; never raises."""
        now = self._clock.now()
        try:
            records = parse_records(datagram)
        except DeviceError as error:
            self.malformed += 1
            self._malformed_now += 1
            if self._malformed_now > _MOST_MALFORMED:
                self.leave_hole(f"what it sends are no RDT records: {error}")
            return
        self._malformed_now = 0
        for record in records:
            self._take(record, now)

    def fail(self, why: str) -> None:
        """Refuse every further `read` and `newest`; the first reason stands."""
        with self._lock:
            self._failure = self._failure or why

    def leave_hole(self, why: str) -> None:
        """Refuse the next `read`: samples are missing in the stream, or bad.

        `newest` goes on. Its time says how old it is; where the stream comes again by itself, who
        corrects a process goes on, whereas the readings of a procedure end with the refusal.
        """
        with self._lock:
            self.hole = self.hole or why

    @property
    def failed(self) -> bool:
        """Whether something has gone wrong."""
        return self._failure is not None

    def _take(self, record: RdtRecord, now: float) -> None:
        last, self._last = self._last, record
        if last is not None and not self._goes_on(last, record):
            return
        status = status_of(record.status)
        self.taken += 1
        if record.status not in (0, *self._states) and len(self._states) < _MOST_STATES:
            self._states.add(record.status)
        self._time = self._time_of(now)
        if status is SensorStatus.FAULT:
            self.leave_hole(f"status {status_names(record.status)}")
            self._newest = self._time, record.counts, status
            return
        with self._lock:
            self._rows.append((self._time, record.counts))
            self._saturated |= status is SensorStatus.SATURATED
            self.saturated += status is SensorStatus.SATURATED
            self._newest = self._time, record.counts, status

    def _goes_on(self, last: RdtRecord, record: RdtRecord) -> bool:
        """Judge the numbers of a record by the one before it; False: it is to be dropped."""
        step = (record.rdt_sequence - last.rdt_sequence) % _WRAP
        if step == 0 or step >= _WRAP - _LATE:
            self.late += 1
            self._last = last
            return False
        if step >= _BACK:
            self.fail(
                f"its count of records went from {last.rdt_sequence} back to"
                f" {record.rdt_sequence}: it was started anew, or another client asked for it"
            )
            return False
        ahead = (record.ft_sequence - last.ft_sequence) % _WRAP
        if ahead >= _BACK:
            self.fail(
                f"its count of samples went from {last.ft_sequence} back to {record.ft_sequence}:"
                " it was started anew, and a bias that it had is gone"
            )
            return False
        self._standing = 0 if ahead else self._standing + 1
        if self._standing >= _STANDING:
            self.leave_hole(f"it repeats sample {record.ft_sequence}: it has stalled")
            return False
        self._count += step
        self._count_lost(step - 1)
        return True

    def _time_of(self, now: float) -> float:
        """Return when a record was measured; records that wait for one another come in bunches."""
        since = self._count / self.rate
        if self._offset < np.inf:
            self._offset += _FOLLOWS * (now - self._arrived)
        self._offset, self._arrived = min(self._offset, now - since), now
        time = min(max(since + self._offset, now - _LONGEST_WAY), now)
        return max(time, float(np.nextafter(self._time, np.inf)))

    def _count_lost(self, lost: int) -> None:
        self.lost += lost
        self._window, self._window_lost = self._window + lost + 1, self._window_lost + lost
        # Not at the end of the window only: of a stream that thins out it is said at once.
        if self._window_lost > _MOST_LOST * _WINDOW:
            self.leave_hole(f"{self._window_lost} of {self._window} records were lost on the way")
        if self._window >= _WINDOW or self._window_lost > _MOST_LOST * _WINDOW:
            self._window = self._window_lost = 0

    def _wrenches(self, counts: FloatArray) -> tuple[FloatArray, FloatArray]:
        return self._scale.force * counts[:, :3], self._scale.moment * counts[:, 3:]

    def newest(self) -> WrenchSample | None:
        """Return the newest sample; None before the first.

        Raises
        ------
        DeviceError
            If the stream cannot be trusted.
        """
        self._require()
        if self._newest is None:
            return None
        time, counts, status = self._newest
        force, moment = self._wrenches(np.array([counts], dtype=float))
        return WrenchSample(time, force[0], moment[0], status)

    def read(self) -> WrenchBlock:
        """Return the samples since the last call; the newest `_NEWEST` when there are more.

        Raises
        ------
        DeviceError
            If the stream cannot be trusted: why. A hole in it is told once, and what was measured
            before its end is forgotten.
        """
        self._require()
        with self._lock:
            hole, self.hole = self.hole, ""
            if hole:
                self._rows.clear()
                raise DeviceError(f"{self.source}: {hole}")
            rows, saturated = list(self._rows), self._saturated
            self._rows.clear()
            self._saturated = False
        counts = np.array([counts for _, counts in rows], dtype=float).reshape(-1, 6)
        force, moment = self._wrenches(counts)
        return WrenchBlock(
            time=np.array([time for time, _ in rows]),
            force=force,
            moment=moment,
            force_sigma=np.nan,
            moment_sigma=np.nan,
            status=SensorStatus.SATURATED if saturated else SensorStatus.OK,
            source=self.source,
        )

    def reading(self) -> DeviceReading:
        """Return what the stream shows; without a state where no record comes.

        Raises
        ------
        DeviceError
            If the stream cannot be trusted.
        """
        newest, (counts,) = self.newest(), self.lines()
        silent = newest is None or not self._clock.now() - newest.time <= _SILENT
        state, problem = "", ""
        if newest is not None and not silent:
            state = f"status {status_names(present(self._last, 'last record').status)}"
            if newest.status is not SensorStatus.OK:
                state, problem = "not to be trusted", state
            elif self.hole:
                state = f"{state}; a run would have ended: {self.hole}"
        return DeviceReading(
            kind="sensor",
            device=self.source,
            heard=newest is not None,
            problem=problem,
            state=state,
            counts=counts,
            force=None if newest is None else three(newest.force),
            moment=None if newest is None else three(newest.moment),
        )

    def lines(self) -> tuple[LineCounts, ...]:
        """Return what was counted on the stream."""
        counts = LineCounts(
            device=self.source,
            received=self.taken,
            lost=self.lost,
            late=self.late,
            malformed=self.malformed,
            saturated=self.saturated,
            status=tuple(status_names(state) for state in sorted(self._states)),
        )
        return (counts,)

    def _require(self) -> None:
        if self._failure is not None:
            raise DeviceError(f"{self.source}: {self._failure}")
