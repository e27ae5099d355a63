"""What the simulated sensor and tracker have in common: samples on a grid of time."""

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.sim.workcell.clock import MICROSECONDS
from elastocal.sim.workcell.plant import Plant

NEWEST = 500
"""Samples that are kept for a caller that does not look; older ones are lost."""


class SampleGrid:
    """Times at which an instrument samples: every so many µs from its last restart on."""

    def __init__(self, rate: float, now: int) -> None:
        """Sample so often, in Hz, from now on, in µs."""
        self._period = round(MICROSECONDS / rate)
        self._begin, self._next = now, 1

    @property
    def begin(self) -> int:
        """When the count began, in µs."""
        return self._begin

    def restart(self, now: int) -> None:
        """Count from now on, in µs."""
        self._begin, self._next = now, 1

    def due(self, now: int) -> tuple[int, int]:
        """Return the numbers of the samples that are due, from the first to before the last."""
        first = self._next
        self._next = last = max(first, (now - self._begin) // self._period + 1)
        return max(first, last - NEWEST), last

    def times(self, first: int, last: int) -> IndexArray:
        """Return the times of samples in µs, shape (sample,)."""
        return self._begin + self._period * np.arange(first, last)


class Samples:
    """Samples that nobody has asked for yet: times and columns."""

    def __init__(self, columns: int) -> None:
        """Keep so many columns."""
        self._times: list[IndexArray] = []
        self._values: list[FloatArray] = []
        self._columns = columns

    def add(self, times: IndexArray, values: FloatArray) -> None:
        """Keep some more; forget blocks that are too old to be among the newest."""
        self._times.append(times)
        self._values.append(values)
        while len(self._times) > 1 and sum(map(len, self._times[1:])) >= NEWEST:
            del self._times[0], self._values[0]

    def drain(self) -> tuple[FloatArray, FloatArray]:
        """Return times in s and values of the newest samples, and forget them all."""
        if not self._times:
            return np.empty(0), np.empty((0, self._columns))
        if len(self._times) == 1:
            times, values = self._times[0], self._values[0]
        else:
            times, values = np.concatenate(self._times), np.concatenate(self._values)
        self._times, self._values = [], []
        return times[-NEWEST:] / MICROSECONDS, values[-NEWEST:]


def held(plant: Plant, kind: str, times: IndexArray, station: str | None = None) -> IndexArray:
    """Return which samples a span of some kind of fault covers, as indices.

    Parameters
    ----------
    plant : Plant
        The cell.
    kind : str
        Of the fault.
    times : ndarray of int, shape (sample,)
        In µs.
    station : str, optional
        Tracker station that measures.
    """
    covered = np.zeros(len(times), dtype=bool)
    for span in plant.schedule.spans(kind):
        if span.station in (None, station):
            covered |= (times >= span.begin) & (times < span.end)
    return np.flatnonzero(covered)
