"""Final limits on every correction before it is sent: speed, size, and whether it is followed.

The module also holds the arm whose programmed path is corrected.

The correction that a controller has taken is inferred from its messages, since answers may be lost.

An absolute correction stays at the controller where no answer comes (``HOLDON`` 1), so that the
next answer moves the arm by its distance from the last answer that was *taken*. The messages show
which one that was:

* ``Delay D`` has grown, or messages are missing: the last answer was not taken, or may not have
  been. The one before it is sent again: it is within a step of whatever is held. The correction
  continues when two consecutive messages show that answers arrive.
* IPOC has jumped, or nothing came for longer than ``Timeout``: the program may have been restarted,
  without correction. RIst minus RSol shows what is in effect. Where it is nearer to what was sent
  within the delay of the motion, by a factor of two, the correction continues; where it is nearer
  to zero, it begins at zero; in between there is no answer, and the controller holds what it has,
  or stops by its ``Timeout``.
"""

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell, CycleStatistics, PathCycle, PathSource, RigContext, Shift
from elastocal.drivers.kuka_rsi.link import LinkAddress, RsiLink
from elastocal.drivers.kuka_rsi.messages import (
    NO_CORRECTION,
    Arrival,
    Order,
    RobMessage,
    SenMessage,
    Six,
)
from elastocal.drivers.kuka_rsi.posture import PostureReader
from elastocal.drivers.kuka_rsi.settings import FASTEST, LATE_DELAY, Bounds, RsiSettings, bounds_of
from elastocal.errors import DeviceError
from elastocal.results import brief_repr

_NONE: Shift = (0.0, 0.0, 0.0)
_CLEARLY = 2.0
"""Factor by which the other correction must be farther to decide which one is in effect."""

_ROUNDED = 1.0 + 1e-9
"""A correction of one step may be longer by a rounding."""


class Effect(NamedTuple):
    """The correction that is in effect when a cycle begins."""

    shift: Shift
    """In m; the next answer is within a step of it."""
    begins: bool
    """Whether the program begins without correction: it is new, or was restarted."""
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
        """Whether the controller has stopped, as inferred from its silence; None: not in
        question."""
        self._answered = False

    def look(self, message: RobMessage, arrival: Arrival, now: float) -> Effect | None:
        """Return the corrections in effect; None where they are unknown, and no answer is safe.

        Parameters
        ----------
        message : RobMessage
            Message of this cycle.
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
        # A controller might report an answer a cycle later, so one more message is awaited.
        advances, self._taken = self._taken, True
        return Effect(self._last, begins=False, advances=advances)

    def note(self, shift: Shift) -> None:
        """Take down the correction of an answer."""
        self._before, self._last, self._answered = self._last, shift, True
        self._recent.append(shift)

    def _decide(self, message: RobMessage, stopped: bool) -> Effect | None:
        """Return the corrections in effect after a jump or a silence."""
        offset, held = offset_of(message), self._before
        small = math.hypot(*held) <= self._step * _ROUNDED
        if not self._answered:
            self._require_none(offset)
            begins = True
        elif offset is None:
            # A program cannot be restarted within its own Timeout.
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


_STRAYS = 1e-3
"""Largest distance of RIst minus RSol from every recently commanded position, in m."""
_PATIENCE = 5
"""Consecutive cycles beyond that distance after which the correction counts as not followed."""
_MEMORY = 0.1
"""Time beyond twice the delay for which commanded places are remembered, in s."""
_STILL = 1e-6
"""Change of the commanded position that counts as none, in m."""


class CorrectionGuard:
    """Bounds relative corrections, and infers from RIst less RSol whether POSCORR clamps them.

    POSCORR clamps without a word, and cannot report it over the same line.

    Parameters
    ----------
    bounds : Bounds
        Limits.
    cycle, delay : float
        Cycle and delay of the controller, and from command to motion, in s.
    """

    def __init__(self, bounds: Bounds, cycle: float, delay: float) -> None:
        self._bounds, self._cycle = bounds, cycle
        self._recent: deque[FloatArray] = deque(maxlen=1 + math.ceil((2 * delay + _MEMORY) / cycle))
        self._astray = 0
        self.saturated = 0
        """Cycles in which the arm was short of every place that was commanded of late."""

    def restart(self, offset: FloatArray) -> None:
        """Restart at the correction in effect, base, shape (3,), in m; the arm stands still."""
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

    def correction(self, message: RobMessage, now: float, effect: Effect) -> Shift | None:
        """Return the whole correction in the axes of ``RefCorrSys``, in m, at once; None: no more.

        Parameters
        ----------
        message : RobMessage
            Message of this cycle.
        now : float
            When it came, in s of the clock.
        effect : Effect
            The correction that it goes on from.
        """


@brief_repr
@dataclass
class PathCorrections:
    """Handler of a link that corrects a programmed path: absolute corrections, superposed on LIN.

    The requested correction is clamped to the largest one and approached from the present one at
    the largest speed; a request that is not finite leaves the present one. Fading when readings
    fail is the task of the source: see `elastocal.compensation.online`.
    """

    source: CorrectionSource
    bounds: Bounds
    cycle: float
    sentype: str = "elastocal"
    timeout: int = 10
    """Timeout of the controller's ETHERNET object: after more silent cycles it may have stopped and
    restart without correction."""
    delay: float = LATE_DELAY
    """Largest time from a correction to its motion, in s."""
    clamped: int = 0
    """Cycles in which the source wanted more than the largest correction."""
    held: int = 0
    """Cycles in which the requested correction was not finite."""
    withheld: int = 0
    """Cycles without an answer because the correction in effect was unknown."""
    largest_step: float = 0.0
    """Largest change from one answer to the next, in m; from zero where a program begins."""

    def __post_init__(self) -> None:
        """Begin without correction."""
        self._step, self._sent = self.bounds.speed * self.cycle, (0.0, 0.0, 0.0)
        cycles = math.ceil(self.delay / self.cycle)
        self._controller = HeldCorrection(self._step, self.timeout * self.cycle, cycles)

    def step(self, message: RobMessage, arrival: Arrival, now: float) -> SenMessage | None:
        """Return the answer; see `elastocal.drivers.kuka_rsi.Handler`."""
        effect = self._controller.look(message, arrival, now)
        if effect is None:
            self.withheld += 1
            return None
        wanted = self.source.correction(message, now, effect)
        # Over: STOP rises, and what is left of the correction is taken back at the same speed.
        order = Order.HOLD if wanted is None else Order.GUIDE
        shift = effect.shift
        if effect.advances:
            shift = self._bounded((0.0, 0.0, 0.0) if wanted is None else wanted, shift)
        before, self._sent = effect.shift if effect.begins else self._sent, shift
        self.largest_step = max(self.largest_step, math.dist(before, shift))
        self._controller.note(shift)
        return SenMessage(as_millimetres(shift), order, sentype=self.sentype)

    def _bounded(self, wanted: Shift, before: Shift) -> Shift:
        # Plain floats: arrays of three would take longer than the whole of it.
        x, y, z = wanted
        size = math.sqrt(x * x + y * y + z * z)
        if not size < math.inf:
            self.held += 1
            return before
        # A source with the same limit may exceed it by a rounding.
        if size > self.bounds.correction * (1.0 + 1e-9):
            self.clamped += 1
            share = self.bounds.correction / size
            x, y, z = share * x, share * y, share * z
        x0, y0, z0 = before
        dx, dy, dz = x - x0, y - y0, z - z0
        length, most = math.sqrt(dx * dx + dy * dy + dz * dz), self._step
        if length <= most:
            return x, y, z
        share = most / length
        return x0 + share * dx, y0 + share * dy, z0 + share * dz


def as_millimetres(shift: Iterable[float]) -> Six:
    """Return a translation in m as RKorr has it, without turn."""
    x, y, z = shift
    return (1e3 * x, 1e3 * y, 1e3 * z, *NO_CORRECTION[3:])


class CorrectedKuka:
    """A KUKA on its own program, corrected; see `elastocal.cell.CorrectedArm`.

    Parameters
    ----------
    settings : RsiSettings
        Settings of its arm, in mode ``compensation``.
    context : RigContext
        Context of the rig.
    source : PathSource
        Computes the corrections.
    """

    def __init__(
        self, cell: Cell, settings: RsiSettings, context: RigContext, source: PathSource
    ) -> None:
        context.arming.require(cell)
        self._settings, self._source = settings, source
        self._reader = PostureReader(cell.robot, settings.signs)
        bounds = bounds_of(cell, settings)
        self._corrections = PathCorrections(
            self,
            bounds,
            settings.cycle,
            settings.sentype,
            settings.timeout,
            settings.motion_delay(cell),
        )
        place = LinkAddress(settings.address, settings.port, settings.robot, settings.cycle)
        (port,) = settings.own_ports()
        self._link = RsiLink(
            place, self._corrections, context.clock, listener=context.listener(port)
        )
        self._link.start()
        self.wait, self.require, self.close = self._link.wait, self._link.require, self._link.close
        self.port = self._link.port
        """The port that it listens at."""

    def correction(self, message: RobMessage, now: float, effect: Effect) -> Shift | None:
        """Return the wanted correction of the source; see `CorrectionSource`."""
        if effect.begins:
            # Once a program: tool, base and signs of the axes are those of the description.
            cycle = self._reader.read(message, now, "compensation")
            self._reader.require_model(cycle, self._settings.model_tolerance)
        joints, (shift, begins, advances) = self._reader.joints(message), effect
        return self._source.correction(PathCycle(now, joints, begins, shift, not advances))

    def statistics(self) -> CycleStatistics:
        """Return the counts so far."""
        counts, times = self._link.statistics(), self._link.times
        return CycleStatistics(
            received=counts.received,
            answered=counts.answered,
            lost=counts.lost,
            skipped=counts.skipped,
            out_of_order=counts.out_of_order,
            jumps=counts.jumps,
            malformed=counts.malformed,
            foreign=counts.foreign,
            late=counts.late,
            saturated=self._corrections.clamped,
            withheld=self._corrections.withheld,
            largest_step=self._corrections.largest_step,
            controller_delay=counts.controller_delay,
            answer_p50=times.quantile(0.5),
            answer_p99=times.quantile(0.99),
            answer_p999=times.quantile(0.999),
            answer_longest=times.longest if times.count else None,
            jitter=None if math.isnan(counts.jitter) else counts.jitter,
            refused=counts.refused,
        )
