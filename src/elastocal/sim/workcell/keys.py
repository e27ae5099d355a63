"""Random numbers that do not depend on what happened before.

Every generator is made from the seed and from words that say what it is for: the posture that the
arm was sent to, the device, the number of the block. A pose that is done again, in the same
process or another, meets the same noise.
"""

import hashlib
from collections.abc import Callable

import numpy as np

from elastocal.arrays import FloatArray

BLOCK = 512
"""Samples that are drawn at once."""


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
