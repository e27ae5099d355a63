"""The way off the surface: in order, after a fault, and after a crash."""

from collections.abc import Callable
from enum import Enum

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell.devices import Motion
from elastocal.errors import DeviceError
from elastocal.procedure.attempt import Attempt
from elastocal.procedure.entries import Action
from elastocal.procedure.faults import Ends, FaultError
from elastocal.procedure.line import Line
from elastocal.procedure.off_surface import STRAIGHT_ARRIVED
from elastocal.procedure.steps import OFF_APPROACH, TOUCHING, Outcome, Step
from elastocal.procedure.supervisor import Supervisor
from elastocal.procedure.watch import Guard, Seen


class Stand(Enum):
    """Where the arm stands when a run or an attempt is over."""

    HOME = "at HOME"
    WAY = "on its way between poses, off every surface"
    NEAR = "off the surface, before contact"
    APPROACH = "retracted to the approach pose"
    SURFACE = "AT THE SURFACE: it could not retract and may still press"


def release(a: Attempt) -> Outcome:
    """Ramp the force to zero; the arm then is in position control."""
    s = a.supervisor
    with s.actuation(Action.RELEASE):
        s.devices.arm.release(a.settings.procedure.ramp)
        s.wait(a.guard(beam=False), _idle, _release_time(s), "the release")
    a.in_force_control = False
    return Outcome.GOOD


def retract(a: Attempt) -> Outcome:
    """Go straight back to the approach pose."""
    retreat(a.supervisor, a.line, a.guard(beam=False))
    return Outcome.GOOD


def retreat(supervisor: Supervisor, line: Line, guard: Guard) -> None:
    """Go along a line's normal until the approach distance.

    Raises
    ------
    FaultError
        See `Supervisor.wait`.
    """
    start = supervisor.cycle(guard).arm.T_base_tcp
    distance = supervisor.settings.approach_distance - line.height(start)
    if distance <= 0.0:
        return
    speed = supervisor.settings.procedure.approach_speed
    with supervisor.actuation(Action.RETRACT, (distance,)):
        supervisor.devices.arm.retract(line.normal, distance, speed)
        supervisor.wait(
            guard,
            lambda seen: _has_gone(seen, start[:3, 3], distance),
            _retract_time(supervisor, distance),
            "the retract",
        )


def let_go(supervisor: Supervisor) -> None:
    """Take the arm out of force control, in which a program that died may have left it.

    Raises
    ------
    FaultError
        If that takes too long.
    """
    arm = supervisor.devices.arm
    if arm.state().motion not in (Motion.HOLDING, Motion.RELEASING):
        return
    with supervisor.actuation(Action.RELEASE):
        if arm.state().motion is Motion.HOLDING:
            arm.release(supervisor.settings.procedure.ramp)
        supervisor.wait(Guard(), _idle, _release_time(supervisor), "the release")


def back_off(a: Attempt, ends: Ends) -> Stand:
    """Make the cell safe after a fault: no force, off the surface, stopped.

    Devices are no longer trusted here and their faults change nothing any more. What the arm
    refuses is left out; the stop at the end is always sent.

    Parameters
    ----------
    a : Attempt
        The attempt, in the state in which the fault was seen.
    ends : Ends
        What the fault ends. An attempt that may be tried again retracts in any case.

    Returns
    -------
    Stand
        Where the arm is left.
    """
    s = a.supervisor
    s.logbook.must_write = False
    try:
        stand = _off_the_surface(a, ends)
        halt(s)
    finally:
        s.logbook.must_write = True
    return stand


def halt(supervisor: Supervisor) -> None:
    """Stop the arm; one that does not answer any more cannot be helped from here."""
    supervisor.logbook.must_write, before = False, supervisor.logbook.must_write
    try:
        with supervisor.actuation(Action.STOP):
            supervisor.devices.arm.stop()
    except DeviceError:
        pass
    finally:
        supervisor.logbook.must_write = before


def _off_the_surface(a: Attempt, ends: Ends) -> Stand:
    if a.step not in OFF_APPROACH:
        return Stand.WAY if a.step is Step.MOVE else Stand.APPROACH
    touching = a.step in TOUCHING or _says_contact(a.supervisor)
    if not touching and ends is Ends.RUN:
        return Stand.NEAR
    if a.in_force_control and _try(a.supervisor, Action.RELEASE, lambda: _release_blindly(a)):
        a.in_force_control = False
    if _try(a.supervisor, Action.RETRACT, lambda: _retract_blindly(a)):
        return Stand.APPROACH
    return Stand.SURFACE if touching else Stand.NEAR


def _try(supervisor: Supervisor, action: Action, do: Callable[[], bool]) -> bool:
    """Do something that the arm may refuse or never finish; return whether it did it."""
    try:
        with supervisor.actuation(action):
            return do()
    except (DeviceError, FaultError):
        return False


def _release_blindly(a: Attempt) -> bool:
    s = a.supervisor
    if s.devices.arm.state().motion is not Motion.RELEASING:
        s.devices.arm.release(a.settings.procedure.ramp)
    return _wait_blindly(s, _idle, _release_time(s))


def _retract_blindly(a: Attempt) -> bool:
    s = a.supervisor
    if s.devices.arm.state().motion in (Motion.APPROACHING, Motion.RETRACTING):
        # An arm need not take a command while it carries out another; it always takes a stop.
        s.devices.arm.stop()
        s.look_blindly()
        s.devices.arm.enable()
    start = s.devices.arm.state().T_base_tcp
    distance = a.settings.approach_distance - a.line.height(start)
    if distance <= 0.0:
        return True
    s.devices.arm.retract(a.line.normal, distance, a.settings.procedure.approach_speed)
    done: Callable[[Seen], bool] = lambda seen: _has_gone(seen, start[:3, 3], distance)  # noqa: E731
    return _wait_blindly(s, done, _retract_time(s, distance))


def _wait_blindly(supervisor: Supervisor, done: Callable[[Seen], bool], limit: float) -> bool:
    # Counted in cycles, as the clock may be what is out of order.
    for _ in range(int(limit / supervisor.settings.procedure.cycle) + 1):
        seen = supervisor.look_blindly()
        if done(seen):
            return True
        if seen.arm.motion in (Motion.STOPPED, Motion.DISARMED):
            return False
    return False


def _says_contact(supervisor: Supervisor) -> bool:
    try:
        return supervisor.devices.arm.state().in_contact
    except DeviceError:
        return True


def _idle(seen: Seen) -> bool:
    return seen.arm.motion is Motion.IDLE


def _has_gone(seen: Seen, start: FloatArray, distance: float) -> bool:
    gone = float(np.linalg.norm(seen.arm.T_base_tcp[:3, 3] - start))
    return _idle(seen) and gone > distance - STRAIGHT_ARRIVED


def _release_time(supervisor: Supervisor) -> float:
    settings = supervisor.settings
    return 2.0 * settings.force_limit / settings.procedure.ramp + settings.procedure.timeout


def _retract_time(supervisor: Supervisor, distance: float) -> float:
    procedure = supervisor.settings.procedure
    return 2.0 * distance / procedure.approach_speed + procedure.timeout
