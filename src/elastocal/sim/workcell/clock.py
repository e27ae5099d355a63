"""Simulated time in whole microseconds, so that time differences are exact."""

import math
from collections.abc import Callable

from elastocal.errors import DeviceError

MICROSECONDS = 1_000_000


def to_microseconds(seconds: float) -> int:
    """Return a time rounded to whole microseconds.

    >>> to_microseconds(0.04)
    40000
    """
    return round(seconds * MICROSECONDS)


class SimClock:
    """A clock that stands until somebody sleeps; see `elastocal.cell.devices.Clock`."""

    def __init__(self, start: float = 0.0) -> None:
        """Let the clock show ``start`` s."""
        if not 0.0 <= start < 1e9:
            raise DeviceError(f"start of the simulated clock is {start!r} s: must be 0 to 1e9")
        self._now = to_microseconds(start)
        self._woken: list[Callable[[int], None]] = []

    @property
    def microseconds(self) -> int:
        """The time in µs."""
        return self._now

    def now(self) -> float:
        """Return the time in s."""
        return self._now / MICROSECONDS

    def sleep(self, seconds: float) -> None:
        """Let time pass; simulated devices do what was due meanwhile.

        Raises
        ------
        DeviceError
            If the time is negative or not finite.
        """
        if not 0.0 <= seconds < math.inf:
            raise DeviceError(f"sleep of {seconds!r} s: must be 0 or more, and finite")
        self._now += to_microseconds(seconds)
        for wake in self._woken:
            wake(self._now)

    def on_wake(self, wake: Callable[[int], None]) -> None:
        """Have a function called with the time in µs after every sleep."""
        self._woken.append(wake)
