"""Sampling of the simulated instruments: a grid of time, samples kept, noise without history.

Every generator of random numbers is made from the seed and from words that say what it is for: the
posture that the arm was sent to, the device, the number of the block. A pose that is done again,
in the same process or another, meets the same noise.
"""

import hashlib
from collections.abc import Callable

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.sim.workcell._timeline import MICROSECONDS

NEWEST = 500
"""Samples that are kept for a caller that does not look; older ones are lost."""
BLOCK = 512
"""Samples that are drawn at once."""


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


class NoiseStream:
    """Noise by the number of the sample, whichever samples are asked for."""

    def __init__(self, draw: Callable[[np.random.Generator], FloatArray], seed: int) -> None:
        """Draw blocks of shape (`BLOCK`, axis) by ``draw``."""
        self._draw, self._seed = draw, seed
        self._words: tuple[object, ...] = ()
        self._number, self._block = -1, np.empty((0, 0))

    def restart(self, *words: object) -> None:
        """Begin anew with sample 0, for the purpose that the words say."""
        self._words, self._number = words, -1

    def take(self, first: int, last: int) -> FloatArray:
        """Return samples ``first`` to before ``last``, shape (sample, axis)."""
        number = first // BLOCK
        if number == (last - 1) // BLOCK:
            block = self._load(number)
            return block[first - number * BLOCK : last - number * BLOCK]
        border = (number + 1) * BLOCK
        return np.concatenate([self.take(first, border), self.take(border, last)])

    def _load(self, number: int) -> FloatArray:
        if number != self._number:
            self._block = self._draw(generator(self._seed, *self._words, number))
            self._number = number
        return self._block


def generator(seed: int, *words: object) -> np.random.Generator:
    """Return the generator of some purpose.

    Parameters
    ----------
    seed : int
        Of the simulated cell.
    *words : object
        What it is for; objects with distinct `repr`.
    """
    digest = hashlib.sha256(repr((seed, *words)).encode()).digest()
    return np.random.default_rng(np.frombuffer(digest, dtype=np.uint32))


def posture_key(q: FloatArray) -> str:
    """Return what stands for a posture: its joint positions to a nanoradian.

    Parameters
    ----------
    q : ndarray, shape (joint,)
        In rad or m.
    """
    return ",".join(f"{value + 0.0:.9f}" for value in np.round(q, 9))
