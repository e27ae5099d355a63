"""The delay from command to motion: excitation, estimate, and record.

The arm is in free space and follows a chirp of some tenths of a millimetre; the command is compared
with RIst minus RSol. The response is modelled as gain, dead time and a first-order lag,

    y(t) = a x_lagged(t - T) + b,   tau dx_lagged/dt = x - x_lagged,

and fitted by least squares (L. Ljung, "System Identification", 2nd ed., Prentice Hall 1999, chapter
7). The delay of the loop is ``T + tau``: at the frequencies of force control a lag is a delay. It
counts from the message whose answer holds the command to the message that shows the motion, so it
includes the transport to and from the PC. A tracker would also show the elasticity of the arm.
"""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.drivers.kuka_rsi.link import LinkStatistics
from elastocal.errors import DeviceError, SchemaError
from elastocal.records import record
from elastocal.results import brief_repr

_SLOWEST, _QUICKEST = 0.5, 6.0
"""Frequencies between which the chirp runs, in Hz."""
_RAMP = 0.25
"""Part of the chirp over which it grows, and falls again."""
_LONGEST = 0.5
"""Longest dead time that is looked for, in s."""
_LONGEST_DELAY = 1.0
"""Longest delay from command to motion that is taken for one, in s."""
_LEAST_GAIN, _MOST_UNEXPLAINED = 0.5, 0.2
"""Least gain and largest unexplained part of the motion at which a response is accepted."""


@record()
class DelayEstimate:
    """Response of an arm to one chirp."""

    dead_time: float
    """In s."""
    lag: float
    """Time constant, in s."""
    gain: float
    """Motion over command; 1 where the arm follows."""
    unexplained: float
    """Root mean square of what is left over that of the motion."""

    @property
    def delay(self) -> float:
        """Delay of slow movements, in s."""
        return self.dead_time + self.lag


@brief_repr
@record("elastocal.commissioning/1")
class CommissioningRecord:
    """Measurements from the commissioning of a cell; runs and sign-off sheets refer to it."""

    cell: str
    robot: str
    controller: str
    """Address."""
    made: str
    """When, ISO 8601."""
    cycle: float
    """In s."""
    delay: float
    """From command to motion, the largest of the chirps, in s."""
    amplitude: float
    """Amplitude of the chirps, in m."""
    chirps: tuple[DelayEstimate, ...]
    """One along each axis of base."""
    link: LinkStatistics
    """Statistics of the line meanwhile."""

    def __post_init__(self) -> None:
        # The gain of force control follows from it: of a delay below 0 the arm would push harder.
        if not 0.0 < self.delay <= _LONGEST_DELAY:
            raise SchemaError(
                f"delay is {self.delay:g} s: must be above 0, at most {_LONGEST_DELAY:g} s"
            )


@brief_repr
@dataclass(frozen=True, eq=False)
class Excitation:
    """A chirp and the arm's answer, cycle by cycle."""

    cycle: float
    """In s."""
    commanded: FloatArray
    """Shape (cycle,), in m."""
    measured: FloatArray
    """Shape (cycle,), in m; the first one answers nothing yet."""


class AnswerRecorder:
    """Collects the answer to places that an arm follows.

    Parameters
    ----------
    places : ndarray, shape (cycle, 3)
        On a line through their origin, base, in m.
    start : ndarray, shape (3,)
        Correction that was in effect before, base, in m.
    cycle : float
        In s.
    """

    def __init__(self, places: FloatArray, start: FloatArray, cycle: float) -> None:
        self._places, self._cycle = places, cycle
        self._offsets = [start]

    def hear(self, offset: FloatArray) -> None:
        """Record the correction in effect in the cycle after a position was sent."""
        self._offsets.append(offset)

    def excitation(self) -> Excitation | None:
        """Return command and answer along the line; None while it is not over."""
        if len(self._offsets) <= len(self._places):
            return None
        farthest = self._places[int(np.argmax(np.linalg.norm(self._places, axis=1)))]
        axis = farthest / np.linalg.norm(farthest)
        measured = np.array(self._offsets[:-1]) - self._offsets[0]
        return Excitation(self._cycle, self._places @ axis, measured @ axis)


def chirp(amplitude: float, duration: float, cycle: float) -> FloatArray:
    """Return places along a line that begin and end at rest at zero, shape (cycle,), in m.

    Parameters
    ----------
    amplitude : float
        In m.
    duration, cycle : float
        In s.
    """
    t = cycle * np.arange(round(duration / cycle))
    rise = (_QUICKEST - _SLOWEST) / duration
    phase = 2.0 * np.pi * (_SLOWEST * t + 0.5 * rise * t**2)
    share = np.clip(np.minimum(t, duration - t) / (_RAMP * duration), 0.0, 1.0)
    places: FloatArray = amplitude * share**2 * (3.0 - 2.0 * share) * np.sin(phase)
    places[-1] = 0.0
    return places


def estimate_delay(excitation: Excitation) -> DelayEstimate:
    """Return delay, lag and gain of the answer to a chirp.

    Raises
    ------
    DeviceError
        If the arm did not follow, or moved by something else.
    """
    from scipy.optimize import least_squares  # slow to import, and no run needs it

    x, y, cycle = excitation.commanded, excitation.measured, excitation.cycle
    y = y - y.mean()
    start = _best_shift(x, y, cycle)

    def residual(parameters: FloatArray) -> FloatArray:
        dead_time, lag = parameters
        model = _answer(x, dead_time, lag, cycle)
        gain, offset = _line(model, y)
        rest: FloatArray = gain * model + offset - y
        return 1e3 * rest

    fit = least_squares(
        residual,
        [start, 0.25 * cycle],
        bounds=([0.0, 0.0], [_LONGEST, _LONGEST]),
        x_scale=[cycle, cycle],
        diff_step=[1e-3, 1e-3],
    )
    dead_time, lag = (float(value) for value in fit.x)
    gain, _ = _line(_answer(x, dead_time, lag, cycle), y)
    moved = float(np.sqrt(np.mean(y**2)))
    unexplained = 1e-3 * float(np.sqrt(np.mean(fit.fun**2))) / max(moved, 1e-12)
    if not (gain >= _LEAST_GAIN and unexplained <= _MOST_UNEXPLAINED):
        raise DeviceError(
            f"the arm did not follow the chirp: gain {gain:.2f} (at least {_LEAST_GAIN:g}),"
            f" {unexplained:.0%} of the motion unexplained (at most {_MOST_UNEXPLAINED:.0%})"
        )
    return DelayEstimate(dead_time, lag, gain, unexplained)


def _best_shift(x: FloatArray, y: FloatArray, cycle: float) -> float:
    """Return the shift in whole cycles at which command and motion look most alike, in s."""
    most = min(round(_LONGEST / cycle), len(x) - 1)
    alike = [float(x[: len(x) - k] @ y[k:]) for k in range(most)]
    return cycle * int(np.argmax(alike))


def _answer(x: FloatArray, dead_time: float, lag: float, cycle: float) -> FloatArray:
    """Return a command behind a dead time and a lag, shape (cycle,)."""
    from scipy.signal import lfilter

    t = cycle * np.arange(len(x))
    late: FloatArray = np.interp(t - dead_time, t, x, left=0.0)
    if lag < 1e-3 * cycle:
        return late
    # Exact for a command that is straight between the cycles.
    share = np.exp(-cycle / lag)
    ahead = 1.0 - lag / cycle * (1.0 - share)
    lagged: FloatArray = lfilter([ahead, 1.0 - share - ahead], [1.0, -share], late)
    return lagged


def _line(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Return slope and offset of the straight line through points."""
    spread = x - x.mean()
    slope = float(spread @ y) / max(float(spread @ spread), 1e-30)
    return slope, float(y.mean() - slope * x.mean())
