"""Force control on the PC: a bounded admittance law, and its stability.

The tool's commanded speed is proportional to the missing force, in the tcp frame, each axis alike:

    v = g (F - F_wanted),   |v| <= v_max

with ``F`` the force on the robot. Against a contact of stiffness ``K`` (arm, tool and tooling in
series) the force answers a commanded movement ``x`` with ``dF/dt = -K dx/dt`` after a delay ``T``:
the controller's delay from command to motion, and what sensor, filter and cycle add. The open loop
is ``g K exp(-s T) / s``, an integrator with delay, so that

    phase margin = 90° - g K T,   gain margin = pi / (2 g K T)

(K. J. Åström and R. M. Murray, "Feedback Systems", 2nd ed., Princeton 2021, sections 10.2, 10.3). A
product ``g K T`` of 1/e is the fastest without overshoot; here it is 0.25, for the stiffest contact
that is expected: 75.7° and 6.3. A softer contact has more of both and is slower.
"""

import math
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import SensorStatus, WrenchFeed
from elastocal.errors import DeviceError

_PRODUCT = 0.25
"""Gain times stiffness times delay."""
_FILTER = 0.01
"""Time constant of the force that is controlled, in s."""
_HESITATE = 0.03
"""Age of the newest force at which the arm stops, in s."""
SILENT = 1.0
"""Age of the newest force at which force control ends with a fault, in s; by then the supervisor
has had time to retract the arm."""
_TARE_SAMPLES = 10
_TARE_TIME = 0.2
"""Samples and time over which the zero of the force is taken, in s."""


@dataclass(frozen=True)
class ForceLaw:
    """The law, designed for a contact and a delay; make one with `design`."""

    gain: float
    """In m/s per N."""
    delay: float
    """Delay of the whole loop, in s."""
    largest_speed: float
    """In m/s."""
    stiffness: float
    """Stiffness of the stiffest contact that is expected, in N/m."""

    @classmethod
    def design(
        cls, stiffness: float, motion_delay: float, cycle: float, largest_speed: float
    ) -> "ForceLaw":
        """Return the law for the stiffest contact that is expected.

        Parameters
        ----------
        stiffness : float
            Stiffness of arm, tool and tooling in series, in N/m.
        motion_delay : float
            From command to motion, as it was measured, in s.
        cycle : float
            Of the controller, in s: a correction holds for one, and its force is as old as one.
        largest_speed : float
            In m/s.
        """
        # A first-order filter delays a slow signal by its time constant.
        delay = motion_delay + 2.0 * cycle + _FILTER
        return cls(_PRODUCT / (stiffness * delay), delay, largest_speed, stiffness)

    def phase_margin(self, stiffness: float) -> float:
        """Return the phase margin against a contact, in rad; 0 or less: unstable."""
        return 0.5 * math.pi - self.gain * stiffness * self.delay

    def gain_margin(self, stiffness: float) -> float:
        """Return by how much stiffer a contact may be before the loop is unstable."""
        return 0.5 * math.pi / (self.gain * stiffness * self.delay)

    def settling(self, stiffness: float) -> float:
        """Return the time in which a missing force falls to a hundredth, in s, without limits."""
        return self.delay + math.log(100.0) / (self.gain * stiffness)

    def speed(self, missing: FloatArray) -> FloatArray:
        """Return the speed of the tool, shape (3,), in m/s, tcp frame.

        Parameters
        ----------
        missing : ndarray, shape (3,)
            Force on the robot less the wanted one, tcp frame, in N.
        """
        wanted = self.gain * missing
        # The norm is limited, not each axis: the motion keeps the direction of the missing force.
        size = float(np.linalg.norm(wanted))
        return wanted if size <= self.largest_speed else wanted * (self.largest_speed / size)


def overshoot(speed: float, stiffness: float, delay: float) -> float:
    """Return by how much a guarded move presses more than the force at which it stops, in N.

    Parameters
    ----------
    speed : float
        In m/s.
    stiffness : float
        Stiffness of the contact, in N/m.
    delay : float
        From force to standstill, in s.
    """
    return speed * stiffness * delay


class ForceReader:
    """The force of a feed as force control wants it: in the tcp frame, zeroed, filtered.

    The tool keeps its orientation from the zero on, so that its weight and the sensor's bias are
    in the zero.
    """

    def __init__(self, feed: WrenchFeed, T_tcp_sensor: FloatArray, cycle: float) -> None:
        self._feed = feed
        self.R_tcp_sensor: FloatArray = T_tcp_sensor[:3, :3]
        """Axes of the sensor in the tcp frame, shape (3, 3)."""
        self._share = cycle / (_FILTER + cycle)
        self._zero, self._sums, self._count = np.zeros(3), np.zeros(3), 0
        self._since: float | None = None
        self._now = self._newest = self._good = -math.inf
        self._smooth: FloatArray | None = None
        self._status = SensorStatus.OK
        self._failure: str | None = None
        self.raw: FloatArray = np.zeros(3)
        """Newest force to be trusted, sensor frame, as measured, shape (3,), in N."""

    def look(self, now: float) -> None:
        """Take the newest sample, if it can be trusted; never raises.

        A sensor that fails must not end the thread that holds the arm: `problem` says why there is
        no force.
        """
        self._now = now
        try:
            sample, self._failure = self._feed.newest(), None
        except (DeviceError, OSError) as error:
            sample, self._failure = None, str(error) or type(error).__name__
        # The cycle is faster than many sensors: the same sample, taken twice, would count double in
        # filter and zero.
        if sample is None or sample.time == self._newest:
            return
        self._newest, self._status = sample.time, sample.status
        if sample.status is not SensorStatus.OK or not np.isfinite(sample.force).all():
            return
        self._good, self.raw = sample.time, sample.force
        # From the first reading on, not from zero: a raw sensor's bias may be many newtons, through
        # which the filter would otherwise have to rise.
        if self._smooth is None:
            self._smooth = sample.force
        self._smooth = self._smooth + self._share * (sample.force - self._smooth)
        if self._since is not None:
            self._sums, self._count = self._sums + sample.force, self._count + 1

    def begin_zero(self, now: float) -> None:
        """Start averaging the zero, while the tool is free."""
        self._sums, self._count, self._since = np.zeros(3), 0, now

    def is_zeroed(self, now: float) -> bool:
        """Return whether the zero is had; from then on the force counts from it."""
        if self._since is None:
            return True
        # Both are required: a fast sensor has enough samples within one vibration, a slow one
        # enough time with too few samples.
        if self._count < _TARE_SAMPLES or not now - self._since >= _TARE_TIME:
            return False
        self._zero, self._since = self._sums / self._count, None
        return True

    @property
    def force_tcp(self) -> FloatArray:
        """Force on the robot since the zero, filtered, tcp frame, shape (3,), in N."""
        return self._in_tcp(self.raw if self._smooth is None else self._smooth)

    @property
    def quick_force_tcp(self) -> FloatArray:
        """The same of the newest sample alone."""
        return self._in_tcp(self.raw)

    def _in_tcp(self, force: FloatArray) -> FloatArray:
        turned: FloatArray = self.R_tcp_sensor @ (force - self._zero)
        return turned

    @property
    def hesitates(self) -> bool:
        """Whether there is no force to move by at the moment."""
        return self._failure is not None or not self._now - self._good <= _HESITATE

    def problem(self, patience: float = SILENT) -> str | None:
        """Return why the force has been unreliable for a time in s; None if it is reliable."""
        if self._failure is not None:
            return self._failure
        if self._now - self._good <= patience:
            return None
        if math.isinf(self._newest):
            return "force sensor has sent nothing"
        silent = self._now - self._newest
        if silent > patience:
            return f"force sensor silent for {silent:.2f} s"
        bad = self._status is SensorStatus.OK
        return f"force sensor says {'NaN' if bad else self._status.value}"
