"""Motions of the arm, cycle by cycle: free moves by the controller, straight moves by the PC.

A motion is a generator: it takes the state of each cycle and yields the request until the next. It
ends with the motion; a failure raises `DeviceError`. Straight moves are corrections that begin and
end at standstill. At their end the true motion, RIst minus RSol, is compared with the goal, since a
lost answer loses its part of the motion.
"""

import contextlib
import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.drivers.kuka_rsi.force_control import ForceLaw, ForceReader
from elastocal.drivers.kuka_rsi.link import (
    AMISS,
    ANSWERS,
    EXACT,
    Cycle,
    Motion,
    Pace,
    Phase,
    Step,
    does_not_answer,
    guided,
)
from elastocal.drivers.kuka_rsi.messages import MoveTarget, Order, ProgramState
from elastocal.errors import DeviceError
from elastocal.results import brief_repr

_TRIES = 4
_QUIET = 0.05
"""Time beyond the delay after which the arm counts as standing, in s."""
_AT_JOINTS = 2e-3
"""Largest distance of a joint from its target after a ``PTP``, in rad or m: RIst and AIPos may be
sent with one decimal of a degree."""
_RELEASED = 0.02
"""Part of the force that was held from which on a release is over."""
_LEAST_FORCE = 3.0
"""Force that counts as none at the end of a release, in N."""
_JUMP = 100.0
"""Change of the force, in N, that is looked into; noise and ramps are below it."""
_JUMP_SHARE = 0.25
"""The same as a part of the force: another unit changes the tool's weight too, which may take away
from what a load alone would show."""
_JUMP_CYCLES = 4
"""Cycles in which a force changes at once: a sample may be the mean of both sides of a jump."""
_RELEASE_SETTLINGS = 3.0
"""Settling times of the force control that a release waits for the last of the force."""


def free_move(cycle: Cycle, target: MoveTarget, q: FloatArray) -> Motion:
    """Yield the steps of a joint move: the controller's ``PTP``, with the correction at zero.

    Parameters
    ----------
    cycle : Cycle
        State at the beginning; without a correction.
    target : MoveTarget
        Target that is sent to the controller.
    q : ndarray, shape (joint,)
        The same in rad or m.
    """
    cycle = yield from guided(cycle)
    ordered = cycle.time
    while cycle.command != target.number or cycle.state not in _OVER:
        if cycle.state != ProgramState.MOVING and cycle.time - ordered > ANSWERS:
            raise does_not_answer("PTP", cycle)
        cycle = yield Step(order=Order.MOVE, target=target)
    if cycle.state == ProgramState.BRAKED:
        raise DeviceError("the program on the controller gave the PTP up on the way")
    away = float(np.abs(cycle.q - q).max())
    if not away <= _AT_JOINTS:
        raise DeviceError(f"the PTP ended {away:.3g} (rad or m) away from its target")
    yield from guided(cycle)


_OVER = (ProgramState.ARRIVED, ProgramState.BRAKED)


def approach(
    cycle: Cycle, way: FloatArray, speed: float, guard: "ContactGuard", pace: Pace
) -> Motion:
    """Yield the steps of a guarded straight move; `ContactGuard.felt` states how it ended.

    Parameters
    ----------
    cycle : Cycle
        State at the beginning.
    way : ndarray, shape (3,)
        Motion if there is no contact, base, in m.
    speed : float
        In m/s.
    guard : ContactGuard
        Detects the contact; its force is zeroed first.
    pace : Pace
        How.
    """
    cycle = yield from guided(cycle)
    cycle = yield from _zeroed(cycle, guard.reader)
    yield from _shift(cycle, cycle.offset + way, speed, pace, guard)


def _zeroed(cycle: Cycle, reader: ForceReader) -> Phase:
    """Stand still until the force is zeroed."""
    began = cycle.time
    reader.begin_zero(began)
    while not reader.is_zeroed(cycle.time):
        if cycle.time - began > ANSWERS:
            raise DeviceError(reader.problem() or "force sensor: too few samples for a zero")
        cycle = yield Step()
    return cycle


def retract(
    cycle: Cycle, way: FloatArray, speed: float, pace: Pace, guard: "LeavingGuard | None"
) -> Motion:
    """Yield the steps of a straight move away from a surface; see `approach`.

    Parameters
    ----------
    guard : LeavingGuard, optional
        Watches the force; None: there is no sensor.
    """
    cycle = yield from guided(cycle)
    steps = _shift(cycle, cycle.offset + way, speed, pace)
    step = next(steps)
    with contextlib.suppress(StopIteration):
        while True:
            cycle = yield step
            if guard is not None:
                guard.look()
            step = steps.send(cycle)


def take_back(cycle: Cycle, guard: "ContactGuard", speed: float, pace: Pace) -> Motion:
    """Yield the steps back to where the correction is zero, a place that is known to be free.

    Raises
    ------
    DeviceError
        If a contact is detected; the arm stops there.
    """
    cycle = yield from guided(cycle)
    cycle = yield from _zeroed(cycle, guard.reader)
    yield from _shift(cycle, np.zeros(3), speed, pace, guard)
    if guard.felt:
        felt = float(np.linalg.norm(guard.reader.quick_force_tcp))
        raise DeviceError(
            f"contact: {felt:.0f} N on the way back to where the last PTP ended, limit"
            f" {guard.contact_force:g} N"
        )


def play(cycle: Cycle, places: FloatArray, heard: Callable[[FloatArray], None]) -> Motion:
    """Yield the steps through given positions, one a cycle, from the tool's present one.

    Parameters
    ----------
    cycle : Cycle
        State at the beginning.
    places : ndarray, shape (cycle, 3)
        Places from the first one on, base, in m.
    heard : callable
        Takes the correction that is in effect in every cycle that follows a step.
    """
    cycle = yield from guided(cycle)
    for shift in np.diff(places, axis=0, prepend=np.zeros((1, 3))):
        cycle = yield Step(shift)
        heard(cycle.offset)


@brief_repr
@dataclass
class ContactGuard:
    """Ends a straight move where a force against it is felt."""

    reader: ForceReader
    direction: FloatArray | None
    """Direction of the move, base, shape (3,); None: a force in any direction ends it."""
    contact_force: float
    """In N; infinite: never."""
    force_limit: float
    """Force that faults, in N."""
    felt: bool = False

    def look(self, cycle: Cycle) -> bool:
        """Return whether the move must end here.

        Raises
        ------
        DeviceError
            If the force is too large or cannot be trusted.
        """
        require_force(self.reader, self.force_limit)
        force_base = cycle.T_base_tcp[:3, :3] @ self.reader.quick_force_tcp
        if self.direction is None:
            against = float(np.linalg.norm(force_base))
        else:
            against = float(-force_base @ self.direction)
        self.felt |= against >= self.contact_force
        return self.felt


@brief_repr
@dataclass(frozen=True, eq=False)
class LeavingGuard:
    """Ends a retract that presses: against something else, or the other way.

    Without a force the tool must be able to leave, so that only a force that is known counts.
    """

    reader: ForceReader
    most: float
    """Force that ends it, in N."""

    @classmethod
    def of(cls, reader: ForceReader, limit: float, growth: float) -> "LeavingGuard":
        """Return the guard of a retract that begins now, with the force of the press.

        Parameters
        ----------
        reader : ForceReader
            The force.
        limit : float
            Force limit, in N.
        growth : float
            By which a force beyond the limit may grow, in N.
        """
        return cls(reader, max(limit, float(np.linalg.norm(reader.quick_force_tcp)) + growth))

    def look(self) -> None:
        """Refuse a force that is too large.

        Raises
        ------
        DeviceError
            With both.
        """
        size = float(np.linalg.norm(self.reader.quick_force_tcp))
        if not (self.reader.hesitates or size <= self.most):
            raise DeviceError(
                f"{size:.0f} N press on the tool while it retracts, limit {self.most:.0f} N"
            )


@brief_repr
@dataclass(frozen=True, eq=False)
class Press:
    """A force to be built up and held."""

    reader: ForceReader
    law: ForceLaw
    wanted: FloatArray
    """Force on the robot, tcp frame, shape (3,), in N."""
    rate: float
    """Fastest change of the force, in N/s."""
    touched: FloatArray
    """Correction where the tool touched, base, shape (3,), in m."""
    travel_limit: float
    """Largest distance from there, in m."""
    force_limit: float
    """In N."""


def hold(cycle: Cycle, press: Press, pace: Pace) -> Motion:
    """Yield the steps of force control; it does not end."""
    cycle = yield from guided(cycle)
    yield from _controlled(cycle, press, pace, math.inf)


def release(cycle: Cycle, press: Press, pace: Pace, stiffness: float) -> Motion:
    """Yield the steps of force control until the force is gone."""
    cycle = yield from guided(cycle)
    size = float(np.linalg.norm(press.reader.force_tcp))
    slack = size / press.rate + _RELEASE_SETTLINGS * press.law.settling(stiffness)
    press = replace(press, wanted=np.zeros(3))
    yield from _controlled(cycle, press, pace, cycle.time + slack)


def _controlled(cycle: Cycle, press: Press, pace: Pace, ends: float) -> Phase:
    """Follow the wanted force; return once it is zero and reached, or at a time."""
    reader, reference = press.reader, press.reader.force_tcp
    releases = not np.any(press.wanted)
    gone = max(_RELEASED * float(np.linalg.norm(reference)), _LEAST_FORCE)
    recent = deque([reader.quick_force_tcp], maxlen=_JUMP_CYCLES)
    while cycle.time < ends:
        require_force(reader, press.force_limit)
        if not releases:  # A release ends with contact that is lost, at once where it was light.
            _require_steady(recent[0], reader.quick_force_tcp)
        recent.append(reader.quick_force_tcp)
        if reader.hesitates:
            if releases:
                break  # in position control, from where it can be retracted without a force
            cycle = yield Step()
            continue
        # The target starts at the present force and is ramped, so that force control begins without
        # a jump.
        reference = _toward(reference, press.wanted, press.rate * pace.cycle)
        velocity = press.law.speed(reader.force_tcp - reference)
        left = float(np.linalg.norm(reader.force_tcp))
        if releases and not np.any(reference) and left <= gone:
            break
        went = float(np.linalg.norm(cycle.offset - press.touched))
        if not went <= press.travel_limit:
            raise DeviceError(
                f"force control gave up: the tool went {1e3 * went:.1f} mm from where it touched,"
                f" limit {1e3 * press.travel_limit:g} mm"
            )
        cycle = yield Step(pace.cycle * cycle.T_base_tcp[:3, :3] @ velocity)
    return cycle


def _require_steady(before: FloatArray, force: FloatArray) -> None:
    """Refuse a force of which much has left, or that much has joined, within some cycles, in N.

    Force control presses the harder the less it feels, and no ramp does that so quickly: contact
    is lost, or the sensor measures in another unit or from another zero than before.

    Raises
    ------
    DeviceError
        With both forces.
    """
    size, change = float(np.linalg.norm(before)), float(np.linalg.norm(force - before))
    if change > max(_JUMP, _JUMP_SHARE * size):
        raise DeviceError(
            f"the force changed by {change:.0f} N from {size:.0f} N at once: contact is"
            " lost, or the sensor's scale or zero has changed"
        )


def require_force(reader: ForceReader, limit: float) -> None:
    """Refuse to go on by a force that is too large or cannot be trusted.

    Raises
    ------
    DeviceError
        With what is wrong.
    """
    problem = reader.problem()
    if problem is not None:
        raise DeviceError(problem)
    size = float(np.linalg.norm(reader.quick_force_tcp))
    if not size <= limit:
        raise DeviceError(f"force limit exceeded: {size:.0f} N, limit {limit:.0f} N")


def _shift(
    cycle: Cycle,
    goal: FloatArray,
    speed: float,
    pace: Pace,
    guard: ContactGuard | None = None,
) -> Phase:
    """Move the correction straight to a goal, or until a guard ends the move; then stop."""
    missing = math.inf
    for _ in range(_TRIES):
        at, now = cycle.offset, 0.0
        while np.any(goal != at):
            if guard is not None and guard.reader.hesitates:
                # Without a force the arm stands still until the force returns or its silence is a
                # fault.
                now, cycle = 0.0, (yield Step())
                if guard.look(cycle):
                    break
                continue
            left = goal - at
            distance = float(np.linalg.norm(left))
            gains = pace.acceleration * pace.cycle
            # Fastest speed from which the tool still stops at the goal, but at least one step of
            # the ramp, or it would approach the goal ever more slowly.
            brakes = max(math.sqrt(2.0 * pace.acceleration * distance), gains)
            now = min(speed, now + gains, brakes)
            piece = left if distance <= now * pace.cycle else left * (now * pace.cycle / distance)
            at = goal if piece is left else at + piece
            cycle = yield Step(piece)
            if guard is not None and guard.look(cycle):
                break
        stands_at = cycle.time + pace.delay + _QUIET
        while cycle.time < stands_at:
            cycle = yield Step()
            if guard is not None:
                guard.look(cycle)
        # A lost answer has lost its part of the move, which the next try adds.
        missing = float(np.linalg.norm(goal - cycle.offset))
        if missing <= EXACT or (guard is not None and guard.felt):
            return cycle
    if missing > AMISS:
        raise DeviceError(
            f"correction not followed: the arm stands {1e3 * missing:.2f} mm from where it was"
            " corrected to: is POSCORR's limit below the one of the cell file?"
        )
    return cycle


def _toward(start: FloatArray, end: FloatArray, most: float) -> FloatArray:
    """Return the next value of a straight ramp."""
    way = end - start
    length = float(np.linalg.norm(way))
    return end if length <= most else start + way * (most / length)
