"""Run one attempt at a pose state after state, and make the cell safe when a state fails.

The way back is always the same, and its order matters. First the force is ramped to zero while the
tool still rests on the surface: a stop at once would leave it pressing, and only position control,
in which the release ends, can retract. Then the tool goes straight off along the normal, the one
direction that the approach has shown to be free. The stop comes last, and always: it is the one
command that an arm takes in every state.
"""

import contextlib
from collections.abc import Callable

from elastocal.cell import ArmState, Motion
from elastocal.procedure.record import Action
from elastocal.procedure.run import _press
from elastocal.procedure.run._attempt import (
    Attempt,
    has_gone,
    is_idle,
    release_limit,
    retract_limit,
)
from elastocal.procedure.run._supervisor import DEVICE_ERRORS, Supervisor
from elastocal.procedure.run.steps import (
    EXPECTED_ERRORS,
    MAY_TOUCH,
    ON_APPROACH_LINE,
    ArmLocation,
    BackOffResult,
    Fault,
    FaultError,
    Step,
    StepResult,
    as_fault,
    next_step,
)

StepAction = Callable[[Attempt], StepResult]

ACTIONS: dict[Step, StepAction] = {
    Step.MOVE: _press.move,
    Step.AIM: _press.aim,
    Step.NEAR: _press.near,
    Step.UNLOADED: _press.unloaded,
    Step.ENGAGE: _press.engage,
    Step.LOAD: _press.load,
    Step.SETTLE: _press.settle,
    Step.AVERAGE: _press.average,
    Step.RELEASE: _press.release,
    Step.LIFT: _press.lift,
    Step.RELEASED: _press.released,
    Step.RETRACT: _press.retract,
}


class AttemptFailedError(FaultError):
    """An attempt that ended with a fault; the arm has been made safe."""

    def __init__(self, cause: FaultError, place: str, left: BackOffResult) -> None:
        super().__init__(cause.fault)
        stuck = left.location is ArmLocation.AT_SURFACE and left.reason != str(cause)
        more = f"; no retract: {left.reason}" if stuck and left.reason else ""
        self.args = (f"{place}: {cause}{more}",)
        self.location = left.location


def run_attempt(a: Attempt, enter: Callable[[Attempt], None], commit: StepAction) -> None:
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
            result = actions[a.step](a)
            a.step = next_step(a.step, result, a.loads_left)
    except EXPECTED_ERRORS as error:
        fault, place = as_fault(error), _place(a)
        a.supervisor.tell_fault(f"{place}: {fault}")
        raise AttemptFailedError(fault, place, _back_off(a)) from error
    except BaseException:
        # A mistake in the program, while a tonne of robot may press on the tooling.
        a.location = _back_off(a).location
        raise


def halt(supervisor: Supervisor) -> None:
    """Stop the arm; one that does not answer any more cannot be helped from here."""
    _send(supervisor, Action.STOP, supervisor.devices.arm.stop)


def disarm(supervisor: Supervisor) -> None:
    """Take the release for motion back, as `halt` does."""
    _send(supervisor, Action.DISABLE, supervisor.devices.arm.disable)


def _place(a: Attempt) -> str:
    load_case = f" {a.load_case}" if a.load_case else ""
    return f"pose {a.pose.id}, attempt {a.number}, {a.step.value}{load_case}"


def between_poses(supervisor: Supervisor) -> ArmLocation:
    """Return what the force on the tool says of a tool between two poses."""
    free = supervisor.feels_free()
    return ArmLocation.BETWEEN_POSES if free else ArmLocation.NOT_KNOWN


def _back_off(a: Attempt) -> BackOffResult:
    """Make the cell safe after a fault: no force, off the surface, stopped.

    Devices are no longer trusted here and their faults change nothing any more: only the arm is
    asked, and one that does not answer is still told. What it refuses is left out; the stop at
    the end is always sent.

    Parameters
    ----------
    a : Attempt
        The attempt, in the state in which the fault was seen.

    Returns
    -------
    BackOffResult
        Where the arm is left, and why if that is at the surface.
    """
    s = a.supervisor
    # A full disk must not keep the tool at the surface.
    s.logbook.must_write = False
    try:
        left = _leave_surface(a)
        halt(s)
    finally:
        s.logbook.must_write = True
    return left


def _leave_surface(a: Attempt) -> BackOffResult:
    if a.step not in ON_APPROACH_LINE:
        return _location_between_surfaces(a)
    # The force first; the retract is tried even when the release was refused.
    if a.in_force_control and not _attempt(a.supervisor, Action.RELEASE, lambda: _release(a)):
        a.in_force_control = False
    reason = _attempt(a.supervisor, Action.RETRACT, lambda: _retract(a))
    if not reason:
        return BackOffResult(ArmLocation.APPROACH_POSE)
    return BackOffResult(_location_without_retract(a), reason)


def _location_without_retract(a: Attempt) -> ArmLocation:
    """Return where the tool is by the arm's own joints; one that does not answer may press."""
    arm = a.supervisor.arm_state()
    if arm is not None:
        high = a.line.height(arm.T_base_tcp) > a.settings.procedure.travel_limit
        if high or (a.step not in MAY_TOUCH and arm.in_contact is False):
            return ArmLocation.NEAR_CONTACT
    return ArmLocation.AT_SURFACE


def _location_between_surfaces(a: Attempt) -> BackOffResult:
    arm = a.supervisor.arm
    if arm is not None and arm.in_contact:
        reason = f"{arm.source} says that it is in contact, nobody knows where"
        return BackOffResult(ArmLocation.AT_SURFACE, reason)
    if a.step is not Step.MOVE:
        return BackOffResult(ArmLocation.APPROACH_POSE)
    return BackOffResult(between_poses(a.supervisor))


def _attempt(supervisor: Supervisor, action: Action, motion: Callable[[], None]) -> str:
    """Make a motion that the arm may refuse or never finish; return why not, empty: it did."""
    try:
        with supervisor.actuation(action):
            motion()
    except DEVICE_ERRORS as error:
        return str(error) or type(error).__name__
    return ""


def _release(a: Attempt) -> None:
    """Ramp the force to zero; nothing but the arm is asked whether it is."""
    s = a.supervisor
    arm = s.arm_state()
    if arm is None or arm.motion is not Motion.RELEASING:
        s.devices.arm.release(a.settings.procedure.ramp)
    _wait(s, is_idle, release_limit(a.settings))


def _retract(a: Attempt) -> None:
    """Go straight back to the approach pose; nothing but the arm is asked whether it did."""
    s = a.supervisor
    arm = s.arm_state()
    if arm is not None and arm.motion in (Motion.APPROACHING, Motion.RETRACTING):
        # An arm need not take a command while it carries out another; it always takes a stop.
        s.devices.arm.stop()
        s.arm_cycle()
        s.devices.arm.enable()
    last = s.arm
    if last is None:
        raise FaultError(Fault.ARM_STALE, "it has never said where it is")
    start = last.T_base_tcp
    distance = a.settings.approach_distance - a.line.height(start)
    if distance <= 0.0:
        return
    s.devices.arm.retract(a.line.normal, distance, a.settings.procedure.approach_speed)
    limit = retract_limit(a.settings, distance)
    _wait(s, lambda arm: has_gone(arm, start[:3, 3], distance), limit)


def _wait(supervisor: Supervisor, done: Callable[[ArmState], bool], limit: float) -> None:
    """Let cycles pass until the arm says that it is done; no other device is watched.

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
        arm = supervisor.arm_cycle()
        if arm is None:
            patience -= 1
            if not patience:
                raise FaultError(Fault.ARM_STALE, "it does not answer")
            continue
        if done(arm):
            return
        if arm.motion in (Motion.STOPPED, Motion.DISARMED):
            reason = arm.fault or f"it is {arm.motion.value}"
            raise FaultError(Fault.ARM_STOPPED, f"{arm.source} says: {reason}")
    raise FaultError(Fault.TIME_LIMIT, f"not done after {limit:.1f} s")


def _send(supervisor: Supervisor, action: Action, command: Callable[[], None]) -> None:
    """Send a last command, once, whatever else is out of order."""
    logbook = supervisor.logbook
    logbook.must_write, before = False, logbook.must_write
    sent = False
    try:
        with contextlib.suppress(*DEVICE_ERRORS), supervisor.actuation(action):
            sent = True
            command()
        if not sent:  # The journal's time is the clock's: it may be that which failed.
            with contextlib.suppress(*DEVICE_ERRORS):
                command()
    finally:
        logbook.must_write = before
