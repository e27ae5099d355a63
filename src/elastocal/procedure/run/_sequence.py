"""The way off the surface: in order, after a fault, and after a crash."""

import contextlib
from collections.abc import Callable

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell.devices import ArmState, Motion
from elastocal.procedure.record.journal import Action
from elastocal.procedure.run._attempt import Attempt
from elastocal.procedure.run._press import (
    STRAIGHT_ARRIVED,
    aim,
    average,
    engage,
    load,
    move,
    near,
    released,
    settle,
    unloaded,
)
from elastocal.procedure.run._supervisor import BROKEN, Supervisor
from elastocal.procedure.run._watchdog import Guard
from elastocal.procedure.run.faults import CAUGHT, Ends, Fault, FaultError, as_fault
from elastocal.procedure.run.routes import Line
from elastocal.procedure.run.steps import (
    OFF_APPROACH,
    TOUCHING,
    Left,
    Outcome,
    Stand,
    Step,
    following,
)


def release(a: Attempt) -> Outcome:
    """Ramp the force to zero; the arm then is in position control."""
    s = a.supervisor
    with s.actuation(Action.RELEASE):
        s.devices.arm.release(a.settings.procedure.ramp)
        s.wait(a.guard(beam=False), lambda seen: _idle(seen.arm), _release_time(s), "the release")
    a.in_force_control = False
    return Outcome.GOOD


def lift(a: Attempt) -> Outcome:
    """Go straight back until near contact."""
    retreat(a.supervisor, a.line, a.guard(beam=False), a.settings.near_contact)
    return Outcome.GOOD


def retract(a: Attempt) -> Outcome:
    """Go straight back to the approach pose."""
    retreat(a.supervisor, a.line, a.guard(beam=False), a.settings.approach_distance)
    return Outcome.GOOD


def retreat(supervisor: Supervisor, line: Line, guard: Guard, height: float) -> None:
    """Go along a line's normal until a height above the expected contact, in m.

    Raises
    ------
    FaultError
        See `Supervisor.wait`.
    """
    start = supervisor.cycle(guard).arm.T_base_tcp
    distance = height - line.height(start)
    if distance <= 0.0:
        return
    speed = supervisor.settings.procedure.approach_speed
    with supervisor.actuation(Action.RETRACT, (distance,)):
        supervisor.devices.arm.retract(line.normal, distance, speed)
        supervisor.wait(
            guard,
            lambda seen: _has_gone(seen.arm, start[:3, 3], distance),
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
        limit = _release_time(supervisor)
        supervisor.wait(Guard(), lambda seen: _idle(seen.arm), limit, "the release")


def back_off(a: Attempt, ends: Ends) -> Left:
    """Make the cell safe after a fault: no force, off the surface, stopped.

    Devices are no longer trusted here and their faults change nothing any more: only the arm is
    asked, and one that does not answer is still told. What it refuses is left out; the stop at
    the end is always sent.

    Parameters
    ----------
    a : Attempt
        The attempt, in the state in which the fault was seen.
    ends : Ends
        What the fault ends. An attempt that may be tried again retracts in any case.

    Returns
    -------
    Left
        Where the arm is left, and why if that is at the surface.
    """
    s = a.supervisor
    s.logbook.must_write = False
    try:
        left = _off_the_surface(a, ends)
        halt(s)
    finally:
        s.logbook.must_write = True
    return left


def halt(supervisor: Supervisor) -> None:
    """Stop the arm; one that does not answer any more cannot be helped from here."""
    _send(supervisor, Action.STOP, supervisor.devices.arm.stop)


def disarm(supervisor: Supervisor) -> None:
    """Take the release for motion back, as `halt` does."""
    _send(supervisor, Action.DISABLE, supervisor.devices.arm.disable)


def _send(supervisor: Supervisor, action: Action, command: Callable[[], None]) -> None:
    """Send a last command, once, whatever else is out of order."""
    logbook = supervisor.logbook
    logbook.must_write, before = False, logbook.must_write
    sent = False
    try:
        with contextlib.suppress(*BROKEN), supervisor.actuation(action):
            sent = True
            command()
        if not sent:  # The journal's time is the clock's: it may be that which failed.
            with contextlib.suppress(*BROKEN):
                command()
    finally:
        logbook.must_write = before


def _off_the_surface(a: Attempt, ends: Ends) -> Left:
    if a.step not in OFF_APPROACH:
        return _between_surfaces(a)
    touching = a.step in TOUCHING or _says_contact(a.supervisor)
    if not touching and ends is Ends.RUN:
        return Left(Stand.NEAR)
    if a.in_force_control and not _try(a.supervisor, Action.RELEASE, lambda: _release_blindly(a)):
        a.in_force_control = False
    why = _try(a.supervisor, Action.RETRACT, lambda: _retract_blindly(a))
    if not why:
        return Left(Stand.APPROACH)
    return Left(Stand.SURFACE if touching else Stand.NEAR, why)


def _between_surfaces(a: Attempt) -> Left:
    said = a.supervisor.arm
    if said is not None and said.in_contact:
        return Left(Stand.SURFACE, f"{said.source} says that it is in contact, nobody knows where")
    return Left(Stand.WAY if a.step is Step.MOVE else Stand.APPROACH)


def _try(supervisor: Supervisor, action: Action, do: Callable[[], None]) -> str:
    """Do something that the arm may refuse or never finish; return why not, empty: it did."""
    try:
        with supervisor.actuation(action):
            do()
    except BROKEN as error:
        return str(error) or type(error).__name__
    return ""


def _release_blindly(a: Attempt) -> None:
    s = a.supervisor
    said = s.ask_arm()
    if said is None or said.motion is not Motion.RELEASING:
        s.devices.arm.release(a.settings.procedure.ramp)
    _wait_blindly(s, _idle, _release_time(s))


def _retract_blindly(a: Attempt) -> None:
    s = a.supervisor
    said = s.ask_arm()
    if said is not None and said.motion in (Motion.APPROACHING, Motion.RETRACTING):
        # An arm need not take a command while it carries out another; it always takes a stop.
        s.devices.arm.stop()
        s.look_at_arm()
        s.devices.arm.enable()
    last = s.arm
    if last is None:
        raise FaultError(Fault.ARM_STALE, "it has never said where it is")
    start = last.T_base_tcp
    distance = a.settings.approach_distance - a.line.height(start)
    if distance <= 0.0:
        return
    s.devices.arm.retract(a.line.normal, distance, a.settings.procedure.approach_speed)
    done: Callable[[ArmState], bool] = lambda arm: _has_gone(arm, start[:3, 3], distance)  # noqa: E731
    _wait_blindly(s, done, _retract_time(s, distance))


def _wait_blindly(supervisor: Supervisor, done: Callable[[ArmState], bool], limit: float) -> None:
    """Let cycles pass until the arm says that it is done.

    Raises
    ------
    FaultError
        If it stops, or does not say so in time.
    """
    procedure = supervisor.settings.procedure
    # Counted in cycles, as the clock may be what is out of order. An arm that does not answer may
    # still do what it was told: it is given the time that this takes.
    patience = int((limit - procedure.timeout) / procedure.cycle) + 1
    for _ in range(int(limit / procedure.cycle) + 1):
        arm = supervisor.look_at_arm()
        if arm is None:
            patience -= 1
            if not patience:
                raise FaultError(Fault.ARM_STALE, "it does not answer")
            continue
        if done(arm):
            return
        if arm.motion in (Motion.STOPPED, Motion.DISARMED):
            said = arm.fault or f"it is {arm.motion.value}"
            raise FaultError(Fault.ARM_STOPPED, f"{arm.source} says: {said}")
    raise FaultError(Fault.TIME_LIMIT, f"not done after {limit:.1f} s")


def _says_contact(supervisor: Supervisor) -> bool:
    said = supervisor.ask_arm()
    return said is None or said.in_contact


def _idle(arm: ArmState) -> bool:
    return arm.motion is Motion.IDLE


def _has_gone(arm: ArmState, start: FloatArray, distance: float) -> bool:
    gone = float(np.linalg.norm(arm.T_base_tcp[:3, 3] - start))
    return _idle(arm) and gone > distance - STRAIGHT_ARRIVED


def _release_time(supervisor: Supervisor) -> float:
    settings = supervisor.settings
    return 2.0 * settings.force_limit / settings.procedure.ramp + settings.procedure.timeout


def _retract_time(supervisor: Supervisor, distance: float) -> float:
    procedure = supervisor.settings.procedure
    return 2.0 * distance / procedure.approach_speed + procedure.timeout


Action = Callable[[Attempt], Outcome]

ACTIONS: dict[Step, Action] = {
    Step.MOVE: move,
    Step.AIM: aim,
    Step.NEAR: near,
    Step.UNLOADED: unloaded,
    Step.ENGAGE: engage,
    Step.LOAD: load,
    Step.SETTLE: settle,
    Step.AVERAGE: average,
    Step.RELEASE: release,
    Step.LIFT: lift,
    Step.RELEASED: released,
    Step.RETRACT: retract,
}


class AttemptFailedError(FaultError):
    """An attempt that ended with a fault; the arm has been made safe."""

    def __init__(self, cause: FaultError, place: str, left: Left) -> None:
        super().__init__(cause.fault)
        more = left.why if left.stand is Stand.SURFACE and left.why != str(cause) else ""
        self.args = (f"{place}: {cause}" + (f"; no retract: {more}" if more else ""),)
        self.stand = left.stand


def run_attempt(a: Attempt, enter: Callable[[Attempt], None], commit: Action) -> None:
    """Run one attempt to its end.

    Parameters
    ----------
    a : Attempt
        In its first state.
    enter : callable
        Called with the attempt at the beginning of each state.
    commit : callable
        The action of COMMIT.

    Raises
    ------
    AttemptFailedError
        If it failed; force, contact and motion have been taken care of.
    """
    actions = {**ACTIONS, Step.COMMIT: commit}
    try:
        while a.step is not Step.DONE:
            enter(a)
            outcome = actions[a.step](a)
            a.step = following(a.step, outcome, a.loads_left)
    except CAUGHT as error:
        fault = as_fault(error)
        place = _place(a)
        raise AttemptFailedError(fault, place, back_off(a, fault.fault.ends)) from error
    except BaseException:
        # A mistake in the program, while a tonne of robot may press on the tooling.
        a.stand = back_off(a, Ends.RUN).stand
        raise


def _place(a: Attempt) -> str:
    load_case = f" {a.load_case}" if a.load_case else ""
    return f"pose {a.pose.id}, attempt {a.number}, {a.step.value}{load_case}"
