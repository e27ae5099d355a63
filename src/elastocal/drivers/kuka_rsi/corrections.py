"""The last look at every correction before it is sent: speed, size, and whether it is followed."""

import math
from collections import deque
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.drivers.kuka_rsi.link import Arrival
from elastocal.drivers.kuka_rsi.messages import NO_CORRECTION, Order, RobMessage, SenMessage, Six
from elastocal.drivers.kuka_rsi.settings import FASTEST, Bounds
from elastocal.errors import DeviceError
from elastocal.results import brief_repr

_STRAYS = 1e-3
"""How far RIst less RSol may be from every place that was commanded of late, in m."""
_PATIENCE = 5
"""Cycles in a row for which it has to be, before the correction counts as not followed."""
_MEMORY = 0.1
"""Time beyond twice the delay for which commanded places are remembered, in s."""
_STILL = 1e-6
"""Change of the commanded place that is none, in m."""


class CorrectionGuard:
    """Bounds relative corrections, and infers from RIst less RSol whether POSCORR clamps them.

    POSCORR clamps without a word, and cannot report it over the same line.

    Parameters
    ----------
    bounds : Bounds
        Limits.
    cycle, delay : float
        Of the controller, and from command to motion, in s.
    """

    def __init__(self, bounds: Bounds, cycle: float, delay: float) -> None:
        self._bounds, self._cycle = bounds, cycle
        self._recent: deque[FloatArray] = deque(maxlen=1 + math.ceil((2 * delay + _MEMORY) / cycle))
        self._astray = 0
        self.saturated = 0
        """Cycles in which the arm was short of every place that was commanded of late."""

    def restart(self, offset: FloatArray) -> None:
        """Begin at the correction that is in effect, base, shape (3,), in m; the arm stands."""
        self._recent.clear()
        self._recent.append(offset)
        self._astray = 0

    def bounded(self, shift: FloatArray, offset: FloatArray) -> FloatArray:
        """Return the piece of a correction that may be sent.

        Parameters
        ----------
        shift : ndarray, shape (3,)
            Wanted until the next cycle, base, in m.
        offset : ndarray, shape (3,)
            Correction that is in effect, base, in m.

        Raises
        ------
        DeviceError
            If the piece is too large, leads beyond the largest correction, or the controller does
            not follow.
        """
        self._require_followed(offset)
        most = min(self._bounds.speed, FASTEST) * self._cycle
        size = float(np.linalg.norm(shift))
        if not size <= most * (1.0 + 1e-9):
            raise DeviceError(
                f"correction of {1e3 * size:.3g} mm in one cycle: at most {1e3 * most:.3g} mm"
            )
        at = self._recent[-1] + shift
        self._require_within(at, grows=float(at @ shift) > 0.0)
        self._recent.append(at)
        return shift

    def _require_within(self, at: FloatArray, grows: bool) -> None:
        far, limit = float(np.linalg.norm(at)), self._bounds.correction
        if grows and not far <= limit * (1.0 + 1e-9):
            raise DeviceError(
                f"correction of {1e3 * far:.2f} mm from the programmed place: the largest is"
                f" {1e3 * limit:g} mm"
            )

    def _require_followed(self, offset: FloatArray) -> None:
        recent = np.array(self._recent)
        low, high = recent.min(axis=0), recent.max(axis=0)
        stray = float(np.maximum(low - offset, offset - high).max())
        if not stray > _STRAYS:
            self._astray = 0
            if len(recent) == self._recent.maxlen and float((high - low).max()) < _STILL:
                # Answers that were lost took their pieces with them: it counts from here again.
                self.restart(offset)
            return
        self._astray += 1
        self.saturated += 1
        if self._astray >= _PATIENCE:
            raise DeviceError(
                f"correction saturated: the arm is {1e3 * stray:.2f} mm short of it (RIst - RSol ="
                f" {np.round(1e3 * offset, 2).tolist()} mm): POSCORR clamps, or answers are lost"
            )


class CorrectionSource(Protocol):
    """Computes corrections of a path in the loop."""

    def correction(self, message: RobMessage, now: float) -> FloatArray:
        """Return the whole correction in the axes of ``RefCorrSys``, shape (3,), in m, at once."""


@brief_repr
@dataclass
class PathCorrections:
    """Handler of a link that corrects a programmed path: absolute corrections, superposed on LIN.

    What the source wants is clamped to the largest correction, and approached at the fastest speed;
    what is not finite counts as the correction before. Fading when readings fail is the source's
    part: see `elastocal.compensation.online`.
    """

    source: CorrectionSource
    bounds: Bounds
    cycle: float
    sentype: str = "elastocal"
    clamped: int = 0
    """Cycles in which the source wanted more than the largest correction."""
    held: int = 0
    """Cycles in which it wanted what is not finite."""
    _sent: FloatArray | None = None

    def step(self, message: RobMessage, arrival: Arrival, now: float) -> SenMessage | None:
        """Return the answer; see `elastocal.drivers.kuka_rsi.Handler`."""
        before = self._sent
        if before is None or arrival is Arrival.JUMPED:
            # A program that was started anew begins without correction.
            before = np.zeros(3)
        wanted = self.source.correction(message, now)
        if not np.isfinite(wanted).all():
            self.held, wanted = self.held + 1, before
        size = float(np.linalg.norm(wanted))
        if size > self.bounds.correction:
            self.clamped, wanted = self.clamped + 1, wanted * (self.bounds.correction / size)
        way = wanted - before
        length, most = float(np.linalg.norm(way)), self.bounds.speed * self.cycle
        self._sent = wanted if length <= most else before + way * (most / length)
        return SenMessage(as_millimetres(self._sent), Order.GUIDE, sentype=self.sentype)


def as_millimetres(shift: FloatArray) -> Six:
    """Return a translation in m as RKorr has it, without turn."""
    x, y, z = (1e3 * shift).tolist()
    return (x, y, z, *NO_CORRECTION[3:])
