"""The time stamps of a device, translated to the clock of the rig.

A sample never arrives before it was taken, so

    arrival - stamp = offset + drift (stamp - first stamp) + latency,    latency >= 0.

The minimum over a window of time has hardly any latency. The drift is the median of the slopes
between these minima (P. K. Sen, J. Am. Stat. Assoc. 63, 1968), so that a window in which everything
came late does not tilt it. The line then is the highest one that no sample lies below: a translated
time is never later than the arrival. The offset contains the shortest latency from the device.
"""

import math
from collections import deque

import numpy as np

from elastocal.errors import DeviceError, present

_WINDOW = 2.0
"""Length of a window, in s of arrival."""
_WINDOWS = 60
"""So many of the newest are looked at: two minutes, over which a quartz runs straight."""
_LEAST_WINDOWS = 5
"""Before so many the drift counts as none."""
MOST_DRIFT = 500e-6
"""Largest drift that is taken for one: quartz clocks are within 100 ppm."""
_NO_CLOCK = 0.02
"""Rate beyond which the stamps are no seconds."""
_MOST_AHEAD = 1.0
"""Largest lead of a stamp over its arrival, in s; beyond it the stamp belongs to another time."""


class DeviceClock:
    """Translates the stamps of one device; offset and drift are estimated as samples come.

    Parameters
    ----------
    source : str
        The device, for messages.
    """

    def __init__(self, source: str) -> None:
        self._source = source
        self._least: deque[tuple[float, float]] = deque(maxlen=_WINDOWS)
        self._window: tuple[float, float] | None = None
        self._window_end = self._first = self._newest = 0.0
        self._arrived = self._told = -np.inf
        self.offset = 0.0
        """Rig time less stamp at the first stamp, in s."""
        self.drift = 0.0
        """Rate of the rig's clock relative to the device's, minus 1, dimensionless; within
        `MOST_DRIFT`."""

    def against_the_pc(self) -> tuple[float, float | None] | tuple[None, None]:
        """Return the device's time less the rig's, in s, and how much faster its clock runs.

        None before the first stamp; the drift is None where it is not known yet.
        """
        if self._window is None:
            return None, None
        passed = self._newest - self._first
        drift = -self.drift if len(self._least) >= _LEAST_WINDOWS else None
        return -(self.offset + self.drift * passed), drift

    def rig_time(self, stamp: float, arrival: float) -> float:
        """Return the time of a sample by the rig's clock, in s; later than those before it.

        Parameters
        ----------
        stamp : float
            By the device's clock, in s.
        arrival : float
            When it came, by the rig's clock, in s.

        Raises
        ------
        DeviceError
            If the device's clock goes back, leaps, or does not count seconds.
        """
        if not math.isfinite(stamp):
            raise DeviceError(f"{self._source}: its time is {stamp}")
        if self._window is None:
            self._first = self._newest = stamp
            self._begin(stamp, arrival)
            self.offset = arrival - stamp
        self._require_going_on(stamp, arrival)
        self._newest, self._arrived = stamp, arrival
        self._window = min(present(self._window, "window"), (arrival - stamp, stamp))
        self.offset = min(self.offset, arrival - stamp - self.drift * (stamp - self._first))
        if arrival >= self._window_end:
            self._least.append(self._window)
            self._begin(stamp, arrival)
            self._fit()
        time = stamp + self.offset + self.drift * (stamp - self._first)
        # An estimate that gets better may not turn the order of the samples round.
        self._told = max(min(time, arrival), float(np.nextafter(self._told, np.inf)))
        return self._told

    def _begin(self, stamp: float, arrival: float) -> None:
        self._window, self._window_end = (arrival - stamp, stamp), arrival + _WINDOW

    def _require_going_on(self, stamp: float, arrival: float) -> None:
        ahead = stamp + self.offset + self.drift * (stamp - self._first) - arrival
        # A device may begin with what it has kept: only after a window is it known how late it is.
        is_known = len(self._least) > 0
        if stamp < self._newest or (is_known and not ahead <= _MOST_AHEAD):
            passed = max(arrival - self._arrived, 0.0)
            raise DeviceError(
                f"{self._source}: its time went from {self._newest:.3f} s to {stamp:.3f} s within"
                f" {passed:.3f} s: it was started anew or its clock set, and its frame may be"
                " another one; or the unit of its time is not the one that is stated"
            )

    def _fit(self) -> None:
        if len(self._least) < _LEAST_WINDOWS:
            return
        least, stamp = np.array(self._least).T
        i, j = np.triu_indices(len(stamp), 1)
        apart = stamp[j] - stamp[i]
        if not np.all(apart > 0.0):
            return
        slope = float(np.median((least[j] - least[i]) / apart))
        if not abs(slope) <= _NO_CLOCK:
            raise DeviceError(
                f"{self._source}: its clock passes {1.0 / (1.0 + slope):.4g} s in a second: the"
                " unit of its time is not the one that is stated"
            )
        self.drift = float(np.clip(slope, -MOST_DRIFT, MOST_DRIFT))
        self.offset = float(np.min(least - self.drift * (stamp - self._first)))
