"""Which correction a controller holds: seen from its messages, since answers get lost.

An absolute correction stays at the controller where no answer comes (``HOLDON`` 1), so that the
next answer moves the arm by its distance from the last answer that was *taken*. The messages tell
which one that was:

* ``Delay D`` has grown, or messages are missing: the last answer was not taken, or may not have
  been. The one before it is sent again: it is within a step of whatever is held. The correction
  goes on when two messages in a row tell that answers arrive.
* IPOC has jumped, or nothing came for longer than ``Timeout``: the program may have been started
  anew, without correction. RIst less RSol shows what is in effect. Where it is nearer to what was
  sent within the delay of the motion, by a factor of two, the correction goes on; where it is
  nearer to zero, it begins at zero; in between there is no answer, and the controller holds what it
  has, or stops by its ``Timeout``.
"""

import math
from collections import deque
from typing import NamedTuple

from elastocal.cell import Shift
from elastocal.drivers.kuka_rsi.messages import Arrival, RobMessage
from elastocal.errors import DeviceError

_NONE: Shift = (0.0, 0.0, 0.0)
_CLEARLY = 2.0
"""How much farther the other correction must be for one to be in effect."""

_ROUNDED = 1.0 + 1e-9
"""A correction of one step may be longer by a rounding."""


class Effect(NamedTuple):
    """The correction that is in effect when a cycle begins."""

    shift: Shift
    """In m; the next answer is within a step of it."""
    begins: bool
    """Whether the program begins without correction: it is new, or was started anew."""
    advances: bool
    """Whether the answer may be another one than `shift`."""


class HeldCorrection:
    """Follows which correction is in effect; `look` at each message, `note` each answer.

    Parameters
    ----------
    step : float
        Largest change of the correction in a cycle, in m.
    silence : float
        Time without a message after which the controller has stopped by its ``Timeout``, in s.
    delay : int
        Cycles from a correction to its motion, at most.
    """

    def __init__(self, step: float, silence: float, delay: int) -> None:
        self._step, self._silence = step, silence
        self._last = self._before = _NONE
        self._recent: deque[Shift] = deque(maxlen=1 + delay)
        self._came, self._delay = math.inf, 0
        self._taken = False
        self._stopped: bool | None = None
        """Whether the controller has stopped, as far as its silence tells; None: no question."""
        self._answered = False

    def look(self, message: RobMessage, arrival: Arrival, now: float) -> Effect | None:
        """Return what is in effect; None where it cannot be told, and no answer is safe.

        Parameters
        ----------
        message : RobMessage
            Of this cycle.
        arrival : Arrival
            How it follows.
        now : float
            When it came, in s.

        Raises
        ------
        DeviceError
            If a correction is in effect before the first answer.
        """
        silent = now - self._came > self._silence
        delay = message.delay or 0
        taken = arrival is Arrival.NEXT and delay <= self._delay
        self._came, self._delay = now, delay
        if silent or arrival is Arrival.JUMPED or not self._answered:
            self._stopped = silent or bool(self._stopped)
        if self._stopped is not None:
            return self._decide(message, self._stopped)
        if not taken:
            self._last, self._taken = self._before, False
            return Effect(self._last, begins=False, advances=False)
        # A controller might tell of an answer a cycle later: one message more is waited for.
        advances, self._taken = self._taken, True
        return Effect(self._last, begins=False, advances=advances)

    def note(self, shift: Shift) -> None:
        """Take down the correction of an answer."""
        self._before, self._last, self._answered = self._last, shift, True
        self._recent.append(shift)

    def _decide(self, message: RobMessage, stopped: bool) -> Effect | None:
        """Return what is in effect after a jump or a silence."""
        offset, held = offset_of(message), self._before
        small = math.hypot(*held) <= self._step * _ROUNDED
        if not self._answered:
            self._require_none(offset)
            begins = True
        elif offset is None:
            # A program cannot be started anew within its own Timeout.
            begins = stopped
        else:
            near = min(math.dist(offset, each) for each in (*self._recent, held))
            far = math.hypot(*offset)
            begins = far <= near
            if not small and _CLEARLY * min(near, far) >= max(near, far):
                self._recent.append(held)
                return None
        # What is smaller than a step is within one of zero too.
        shift = held if small or not begins else _NONE
        self._last = self._before = shift
        self._taken = begins and shift == _NONE
        self._stopped = None
        if begins:
            self._recent.clear()
            self._recent.append(_NONE)
        return Effect(shift, begins, self._taken)

    def _require_none(self, offset: Shift | None) -> None:
        if offset is not None and not math.hypot(*offset) <= _CLEARLY * self._step:
            raise DeviceError(
                f"RIst is {1e3 * math.hypot(*offset):.2f} mm from RSol before the first answer: a"
                " correction is in effect that is not of this program; start the controller's"
                " program anew"
            )


def offset_of(message: RobMessage) -> Shift | None:
    """Return RIst less RSol, base, in m; None where the controller does not send both."""
    actual, setpoint = message.actual, message.setpoint
    if actual is None or setpoint is None:
        return None
    return (
        1e-3 * (actual[0] - setpoint[0]),
        1e-3 * (actual[1] - setpoint[1]),
        1e-3 * (actual[2] - setpoint[2]),
    )
