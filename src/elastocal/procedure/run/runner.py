"""Procedure 1 over all poses: visit each, commit it, go HOME (paper 2.2).

An attempt at a pose goes through states in the order of Procedure 1, one action each; where a state
fails, the cell is made safe. The order makes readings valid and the cell safe. The sensor is tared
in free air just before contact, so that its drift since the last pose and the weight of the tool do
not count as load; the reference of the tracker is taken there too, so that only changes between it
and the load count as deflection. With ``procedure.reference: light_contact`` that is read again, in
contact, as the first press or the second: no step is added, since its force is in the plan's list
of presses. Contact is made in position control, slowly and up to a small force; only then is force
control switched on. It is switched off, with the force ramped to zero, before the tool leaves the
surface: an arm in force control in free air would accelerate.

The retreat is always the same, and its order matters. First the force is ramped to zero while the
tool still rests on the surface: a stop at once would leave it pressing, and only position control,
in which the release ends, can retract. Then the tool moves straight off along the normal, the only
direction that the approach has shown to be free. The stop is always sent, last: it is the only
command that an arm accepts in every state.
"""

import contextlib
from collections.abc import Callable
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray, Triple, triple
from elastocal.cell import CONDITIONING, LIGHT_CONTACT, ArmState, Devices, Motion
from elastocal.errors import ProcedureError, present
from elastocal.planning import Joints, PoseRecord
from elastocal.procedure.record import (
    Action,
    Event,
    Journal,
    Logbook,
    ReadingStatus,
    StreamRecorder,
)
from elastocal.procedure.run._attempt import (
    Attempt,
    approach_by,
    drive,
    has_gone,
    is_idle,
    largest_force,
    leave_force_control,
    release_force,
    release_limit,
    require_tool_weight,
    retract_limit,
    retract_to,
)
from elastocal.procedure.run._supervisor import DEVICE_ERRORS, TIME_SLACK, Observers, Supervisor
from elastocal.procedure.run._watchdog import Guard, Snapshot
from elastocal.procedure.run.leaving import LeavingWatch
from elastocal.procedure.run.routes import (
    HOME_AT_START,
    ApproachLine,
    home_stop,
    remaining_times,
    route,
)
from elastocal.procedure.run.session import RunEnd, Session, SessionHooks, SessionResult
from elastocal.procedure.run.steps import (
    EXPECTED_ERRORS,
    LEAST_SAMPLES,
    MAY_TOUCH,
    ON_APPROACH_LINE,
    ArmLocation,
    BackOffResult,
    Fault,
    FaultError,
    FaultScope,
    Progress,
    RecentSamples,
    SlideDetector,
    SlipReference,
    Step,
    StepResult,
    as_fault,
    next_step,
    steadiness,
    why_off,
    why_shaking,
    why_unsteady,
)
from elastocal.wording import counted

_AGREES = 0.5
"""Smallest part of a force of the arm that its sensor must feel."""
_REACH_MARGIN = 1e-3
"""Distance before the travel limit from which the surface counts as missed, in m."""
_WINDOW_TRIES = 3
"""Windows of one load case that may be spoiled before it is given up."""


def move(a: Attempt) -> StepResult:
    """Move to the approach pose."""
    drive(a.supervisor, a.legs, a.guard(beam=False))
    return StepResult.GOOD


def aim(a: Attempt) -> StepResult:
    """Wait for the beam; take the sensor's reading and the marker's place at the approach pose."""
    s, procedure = a.supervisor, a.settings.procedure
    s.aim(a.station)
    s.ask(_what(a))
    # A station that measured the pose before may still deliver: its points are not ours.
    _wait_for_beam(a, a.station)
    forces, points = RecentSamples(), RecentSamples()
    for seen in s.stay(a.guard(), procedure.dwell):
        forces.add(seen.wrenches.time, seen.wrenches.force)
        points.add(seen.points.time, seen.points.position)
    _require_samples(a, forces, points)
    # Before the tare: it would hide a tool that is not the cell's, or a sensor in another frame.
    require_tool_weight(forces.values.mean(axis=0), a.settings)
    s.tare(forces.values.mean(axis=0))
    a.at_approach = points.values.mean(axis=0)
    return StepResult.GOOD


def near(a: Attempt) -> StepResult:
    """Move straight to near contact; a contact on the way is a fault."""
    procedure = a.settings.procedure
    seen = a.supervisor.cycle(a.guard())
    distance = a.line.height(seen.arm.T_base_tcp) - a.settings.near_contact
    most = procedure.contact_force + a.noise
    seen = approach_by(a, distance, procedure.approach_speed, most)
    if seen.arm.in_contact or not largest_force(seen) <= most:
        height = a.line.height(seen.arm.T_base_tcp)
        raise FaultError(Fault.CONTACT_EARLY, f"{height * 1e3:.1f} mm before the expected contact")
    return StepResult.GOOD


def unloaded(a: Attempt) -> StepResult:
    """Average tracker and sensor until both are quiet (p_i0^c, p_i0^m)."""
    s, procedure = a.supervisor, a.settings.procedure
    begin, noisy = s.now, ""
    _stand_still(a)
    if _ask(a):
        begin = s.now
    while s.now - begin <= procedure.timeout + TIME_SLACK:
        start, breaks, forces, points = s.now, s.watchdog.breaks, RecentSamples(), RecentSamples()
        for seen in s.stay(a.guard(), procedure.unloaded_average):
            forces.add(seen.wrenches.time, seen.wrenches.force)
            points.add(seen.points.time, seen.points.position)
            if s.watchdog.breaks > breaks:
                break
        if s.watchdog.breaks > breaks or not s.watchdog.sees:
            noisy = f"{a.station} loses the marker again and again"
            _wait_for_beam(a)
            continue
        _require_samples(a, forces, points)
        noisy = why_shaking(points.values, procedure.marker_sigma)
        noisy = noisy or why_unsteady(steadiness(forces.time, forces.values), procedure)
        if not noisy:
            # The last tare before contact: from here on the force is that of the press alone.
            s.tare(forces.values.mean(axis=0))
            a.slip_reference = SlipReference.of(a.at_approach, points.values.mean(axis=0))
            a.close_window(None, start)
            return StepResult.GOOD
    raise FaultError(Fault.UNLOADED_NOISY, noisy)


def engage(a: Attempt) -> StepResult:
    """Move on until the contact force is reached."""
    procedure = a.settings.procedure
    seen = a.supervisor.cycle(a.guard())
    # Less than the limit: a place that is noisy must not turn a miss into something worse.
    reach = max(procedure.travel_limit - _REACH_MARGIN, 0.5 * procedure.travel_limit)
    distance = a.line.height(seen.arm.T_base_tcp) + reach
    seen = approach_by(a, distance, procedure.contact_speed)
    if not seen.arm.in_contact:
        text = f"none within {reach * 1e3:g} mm beyond the expected one"
        raise FaultError(Fault.CONTACT_MISSED, text)
    # Before any load: an arm and a sensor that do not feel the same force must not press.
    _require_contact_felt(a, seen)
    return StepResult.GOOD


def load(a: Attempt) -> StepResult:
    """Ramp to the present load case."""
    s, (name, force) = a.supervisor, a.load
    ramp = a.settings.procedure.ramp
    felt = s.cycle(a.guard()).force_tcp
    change = force - felt[-1] if len(felt) else force
    # Set before the command, not after: if the command fails midway, the force is released.
    a.in_force_control = True
    reference = present(a.slip_reference, "slip reference")
    if s.settings.tracked:
        # Without a tracker: the controller travels under load by what the arm deflects.
        a.slide = SlideDetector(reference)
        a.jump = SlideDetector(reference, along=True)
    with s.actuation(Action.HOLD, name):
        s.devices.arm.hold(force, ramp)
        for seen in s.stay(a.guard(), float(np.linalg.norm(change)) / ramp):
            if a.slide is not None:
                a.slide.see(seen.points.position)
    return StepResult.GOOD


def settle(a: Attempt) -> StepResult:
    """Wait until the force is steady and the marker is seen."""
    s, (name, force), procedure = a.supervisor, a.load, a.settings.procedure
    samples, begin, why = RecentSamples(procedure.dwell), s.now, ""
    for seen in s.stay(a.guard(), procedure.timeout):
        _watch_hold(a, seen)
        samples.add(seen.wrenches.time, seen.force_tcp)
        if seen.time - begin < procedure.dwell - TIME_SLACK or len(samples) < LEAST_SAMPLES:
            continue
        found = steadiness(samples.time, samples.values)
        unsteady = why_unsteady(found, procedure)
        why = why_off(found, force, a.settings.force_tolerance) or unsteady
        if not why and s.watchdog.sees:
            return StepResult.GOOD
        # Steady, and yet not there: it is not a matter of waiting, arm and sensor disagree.
        if seen.time - begin > 2.0 * procedure.dwell and not unsteady:
            _require_force_followed(found.mean, force)
    note = f"not stable within {procedure.timeout:g} s: {why or 'the beam is broken'}"
    a.close_window(name, s.now, ReadingStatus.UNSTABLE, note)
    return StepResult.LOAD_CASE_LOST


def average(a: Attempt) -> StepResult:
    """Take one reading, or find that it cannot be taken."""
    s, (name, force), procedure = a.supervisor, a.load, a.settings.procedure
    _ask(a)
    start, breaks, forces, points = s.now, s.watchdog.breaks, RecentSamples(), RecentSamples()
    if a.jump is not None:
        a.jump.forget()
    for seen in s.stay(a.guard(), procedure.average):
        _watch_hold(a, seen)
        if a.jump is not None:
            a.jump.see(seen.points.position)
        forces.add(seen.wrenches.time, seen.force_tcp)
        points.add(seen.points.time, seen.points.position)
        if s.watchdog.breaks > breaks:
            note = f"{a.station} lost the marker in {_WINDOW_TRIES} windows"
            return _repeat(a, ReadingStatus.ABORTED, note)
    if len(forces) < LEAST_SAMPLES or len(points) < LEAST_SAMPLES:
        note = f"{len(forces)} samples of the force and {len(points)} of the marker"
        return _repeat(a, ReadingStatus.ABORTED, note)
    found = steadiness(forces.time, forces.values)
    why = why_off(found, force, a.settings.force_tolerance) or why_unsteady(found, procedure)
    why = why or why_shaking(points.values, procedure.marker_sigma)
    if why:
        note = f"not stable in {_WINDOW_TRIES} windows: {why}"
        return _repeat(a, ReadingStatus.UNSTABLE, note)
    slipped = _why_slipped(a, points.values, force)
    status = ReadingStatus.SLIPPED if slipped else ReadingStatus.OK
    a.close_window(name, start, status, slipped)
    return StepResult.GOOD


def release(a: Attempt) -> StepResult:
    """Ramp the force to zero; the arm then is in position control."""
    # From here on the beam may break: no reading depends on it, and the retreat must not.
    release_force(a.supervisor, a.guard(beam=False))
    a.in_force_control = False
    return StepResult.GOOD


def lift(a: Attempt) -> StepResult:
    """Move straight back to near contact."""
    retract_to(a.supervisor, a.line, a.guard(beam=False), a.settings.near_contact)
    return StepResult.GOOD


def released(a: Attempt) -> StepResult:
    """Average once more, after the loads: how far the sensor is from its tare then.

    Nothing depends on it but what the summary says of the drift, so it cannot fail.
    """
    s, procedure = a.supervisor, a.settings.procedure
    _stand_still(a, beam=False)
    start = s.now
    for _ in s.stay(a.guard(beam=False), procedure.unloaded_average):
        pass
    a.close_window(None, start)
    return StepResult.GOOD


def retract(a: Attempt) -> StepResult:
    """Move straight back to the approach pose."""
    retract_to(a.supervisor, a.line, a.guard(beam=False), a.settings.approach_distance)
    return StepResult.GOOD


def _wait_for_beam(a: Attempt, station: str | None = None) -> None:
    """Wait until the marker is seen; with a station, until it is this one that sees it."""

    def found(seen: Snapshot) -> bool:
        if a.in_force_control:
            _watch_hold(a, seen)
        ours = station is None or seen.points.station == station
        return a.supervisor.watchdog.sees and len(seen.points) > 0 and ours

    limit = a.settings.procedure.beam_timeout + 1.0
    a.supervisor.wait(a.guard(), found, limit, f"{a.station}: looking for the marker")


def _ask(a: Attempt) -> bool:
    """Request a measurement of the resting marker if a person makes it; return whether one does."""
    is_asked = a.supervisor.ask(_what(a))
    if is_asked:
        # The motion since the previous reading was not supervised, so it is no slide.
        if a.slide is not None:
            a.slide.forget()
        _wait_for_beam(a)
    return is_asked


def _what(a: Attempt) -> str:
    return f"pose {a.pose.id}, {a.load_case or a.step.value}"


def _stand_still(a: Attempt, *, beam: bool = True) -> None:
    """Wait until vibrations after a motion have decayed."""
    for _ in a.supervisor.stay(a.guard(beam=beam), a.settings.procedure.dwell):
        pass


def _watch_hold(a: Attempt, seen: Snapshot) -> None:
    """Refuse an arm that has left force control; look for slides."""
    if seen.arm.motion is not Motion.HOLDING:
        text = f"{seen.arm.source} is {seen.arm.motion.value} and holds no force"
        raise FaultError(Fault.CONTACT_LOST, text)
    if a.slide is not None:
        a.slide.see(seen.points.position)


def _repeat(a: Attempt, status: ReadingStatus, note: str) -> StepResult:
    """Repeat a spoiled window; after the last try the load case has a status instead."""
    a.window_tries += 1
    if a.window_tries < _WINDOW_TRIES:
        return StepResult.REPEAT
    a.close_window(a.load[0], a.supervisor.now, status, note)
    return StepResult.LOAD_CASE_LOST


def _why_slipped(a: Attempt, positions: FloatArray, force: FloatArray) -> str:
    """Return how the marker slipped during or before a window; empty: it did not."""
    reference, slide, jump, procedure = a.slip_reference, a.slide, a.jump, a.settings.procedure
    reference = present(reference, "reference")
    limit = procedure.slip_limit
    if slide is None or jump is None:
        # No tracker: a tip that slips takes the controller along while the force is held.
        length = reference.during(positions)
        text = f"tool slid {length * 1e3:.2f} mm during the window, limit {limit * 1e3:.2f} mm"
        return "" if length <= limit else text
    a.slip = reference.so_far(positions)
    if a.load[0] == LIGHT_CONTACT:
        # The zero is read here: displacements count from the marker's present position.
        a.slip_origin = a.slip
    moved = abs(a.slip - a.slip_origin)
    expected = procedure.contact_compliance * float(np.linalg.norm(force))
    for length, most, what in (
        (slide.largest, limit, "slid {} at once"),
        (reference.during(positions), limit, "slid {} during the window"),
        (jump.largest, limit, "jumped {} along the normal"),
        (moved, limit + expected, "is {} aside under this load"),
    ):
        if not length <= most:
            a.slip_origin = a.slip
            return f"marker {what.format(f'{length * 1e3:.2f} mm')}, limit {most * 1e3:.2f} mm"
    return ""


def _require_samples(a: Attempt, forces: RecentSamples, points: RecentSamples) -> None:
    """Refuse a window with hardly any samples in it; no watchdog saw a gap, so they are slow."""
    for samples, fault, name in (
        (forces, Fault.SENSOR_STALE, "the sensor"),
        (points, Fault.TRACKER_STALE, a.station),
    ):
        if len(samples) < LEAST_SAMPLES:
            raise FaultError(fault, f"{name} gave {len(samples)} samples in a window")


def _require_contact_felt(a: Attempt, seen: Snapshot) -> None:
    """Refuse a contact that the arm has felt and the sensor has not, within ``stale`` seconds."""
    s, procedure, largest = a.supervisor, a.settings.procedure, largest_force(seen)
    wanted = _AGREES * procedure.contact_force
    if largest >= wanted:
        return
    for later in s.stay(a.guard(), procedure.stale):
        largest = max(largest, largest_force(later))
        if largest >= wanted:
            return
    text = (
        f"{seen.arm.source} feels {procedure.contact_force:g} N of contact,"
        f" {seen.wrenches.source} at most {largest:.0f} N"
    )
    raise FaultError(Fault.DISAGREE, text)


def _require_force_followed(mean: FloatArray, force: FloatArray) -> None:
    """Refuse a force that is steady and has hardly come nearer to what was asked."""
    asked = float(np.linalg.norm(force))
    along = float(mean @ force) / asked
    if not along >= _AGREES * asked:
        text = f"{asked:.0f} N are asked for, the sensor feels {along:.0f} N in that direction"
        raise FaultError(Fault.DISAGREE, text)


StepAction = Callable[[Attempt], StepResult]

ACTIONS: dict[Step, StepAction] = {
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
    """Return the location of an arm between two poses, by the force on its tool."""
    free = supervisor.feels_free()
    return ArmLocation.BETWEEN_POSES if free else ArmLocation.NOT_KNOWN


def _back_off(a: Attempt) -> BackOffResult:
    """Make the cell safe after a fault: no force, off the surface, stopped.

    Devices are no longer trusted here and their faults are ignored: only the arm is read, and it is
    sent commands even if it does not answer. Refused commands are skipped; the stop at the end is
    always sent.

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
    """Return the tool's position by the arm's own joints; an arm that does not answer may press."""
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
    """Ramp the force to zero; only the arm is read."""
    s = a.supervisor
    arm = s.arm_state()
    if arm is None or arm.motion is not Motion.RELEASING:
        s.devices.arm.release(a.settings.procedure.ramp)
    _wait(s, is_idle, release_limit(a.settings))


def _retract(a: Attempt) -> None:
    """Move straight back to the approach pose; only the arm is read."""
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
    """Let cycles pass until the arm reports the end; no other device is supervised.

    Raises
    ------
    FaultError
        If it stops, or does not say so in time.
    """
    procedure = supervisor.settings.procedure
    # Counted in cycles, as the clock may be faulty. An arm that does not answer may still carry out
    # its command, so it is given the time for it.
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


_REPORT_EVERY = 5
"""Cycles between two reports of progress."""
_MOST_GIVEN_UP = 2
"""Number of consecutive failed poses that ends the run, since the cause is then not the pose."""


class Runner:
    """Carries a session out on devices.

    Parameters
    ----------
    session : Session
        What is to be done.
    journal : Journal
        Open, with its first entry written.
    hooks : SessionHooks
        Recorder, listener, interruption.
    """

    def __init__(
        self, session: Session, devices: Devices, journal: Journal, hooks: SessionHooks
    ) -> None:
        self._session, self._devices, self._hooks = session, devices, hooks
        self._plan, self._settings = session.plan, session.settings
        self._log = Logbook(journal, devices.clock)
        observers = Observers(self._report, hooks.interrupted, hooks.fault)
        self._supervisor = Supervisor(devices, session.settings, self._log, observers)
        self._left = remaining_times(session.plan, session.settings, session.order)
        self._number = {pose.id: place for place, pose in enumerate(session.visits, start=1)}
        self._enough = ""
        self._attempt: Attempt | None = None
        self._attempts = dict(session.attempts)
        self._given_up: list[int] = []
        self._failed, self._cycles, self._pose_start = 0, 0, 0.0
        self._location, self._stop = ArmLocation.BETWEEN_POSES, HOME_AT_START
        self._watched = True
        # A session that goes on does not know what an earlier one has left.
        self._disks: int | None = None if session.resumes and session.plan.doubled else 1

    def run(self) -> SessionResult:
        """Visit all poses that are not committed and return how it went.

        The arm is enabled here and disabled at the end, however that comes about.

        Raises
        ------
        ProcedureError
            If the arm is not the one of the plan; nothing has been enabled then.
        """
        self._check_joints()
        try:
            self._begin()
            self._visit_all()
            self._go_home()
            message = "; ".join(filter(None, (self._enough, self._given_up_message())))
            result = self._result(RunEnd.DONE, ArmLocation.HOME, message)
        except AttemptFailedError as error:
            result = self._failure(error, error.location)
        except EXPECTED_ERRORS as error:
            halt(self._supervisor)
            result = self._failure(as_fault(error), self._present_location())
        except BaseException as error:
            halt(self._supervisor)
            reason = f"mistake in the program: {type(error).__name__}"
            self._finish(self._result(RunEnd.STOPPED, self._present_location(), reason))
            raise
        self._finish(result)
        return result

    def _begin(self) -> None:
        """Bring the arm to HOME from the position in which an earlier session, or a crash, left it.

        Out of force control first, then straight off the surface, then along the plan's legs: a
        joint move that begins at the surface would drag the tool over it. A force on the tool is
        measured; a new run does not release it.
        """
        s = self._supervisor
        home, moving = self._session.home, (Motion.MOVING, Motion.APPROACHING, Motion.RETRACTING)
        s.start()
        state = self._devices.arm.state()
        # Said before anything is tried, so that it is right should the first command fail.
        touches = state.in_contact or home.retract_from is not None
        self._location = ArmLocation.AT_SURFACE if touches else ArmLocation.NOT_KNOWN
        self._require_free(state)
        if state.motion in moving:
            halt(s)
        self._enable()
        leave_force_control(s)
        if home.retract_from is not None:
            limit = self._settings.procedure.travel_limit
            height = self._settings.approach_distance
            line = ApproachLine.of_pose(home.retract_from, limit)
            leaving = LeavingWatch(
                self._settings.tool_load, line.normal, self._settings.collision_limit
            )
            retract_to(s, line, Guard(), height, leaving)
        self._location = ArmLocation.BETWEEN_POSES
        drive(s, home.legs, Guard(self._free_limit, free=True))

    def _require_free(self, state: ArmState) -> None:
        """Refuse to begin with a tool that presses, unless it is this run's and can be freed."""
        home, load = self._session.home, self._settings.tool_load
        remedy = "`elastocal release CELL --arm` frees it"
        if state.in_contact and home.retract_from is None:
            raise FaultError(
                Fault.IN_CONTACT, f"{state.source} says that it is, before no pose: {remedy}"
            )
        if home.retract_from is None or self._session.resumes:
            return
        beyond = self._supervisor.beyond_weight()
        pressing = 0.0 if beyond is None else float(np.linalg.norm(beyond))
        if not pressing <= load.tolerance:
            raise FaultError(
                Fault.IN_CONTACT,
                f"{pressing:.0f} N press on the tool beyond its weight, at most"
                f" {load.tolerance:.0f} N in free air: {remedy}",
            )

    def _present_location(self) -> ArmLocation:
        """Return the position of the arm; between poses the force shows a contact."""
        if self._location is ArmLocation.BETWEEN_POSES:
            return between_poses(self._supervisor)
        return self._location

    def _visit_all(self) -> None:
        in_a_row = 0
        for pose in self._session.visits:
            if pose.id in self._session.committed:
                continue
            failure = self._visit(pose)
            in_a_row = 0 if failure is None else in_a_row + 1
            if failure is None and self._has_enough():
                return
            if failure is not None and in_a_row == _MOST_GIVEN_UP:
                raise failure

    def _has_enough(self) -> bool:
        """Return whether the poses so far are enough, and write down why."""
        self._enough = self._hooks.enough(present(self._attempt, "attempt").log())
        # A look takes longer than a cycle; the arm stands at the approach pose meanwhile.
        self._supervisor.pause()
        if self._enough:
            self._log.write(Event.ENOUGH, text=self._enough)
        return bool(self._enough)

    def _visit(self, pose: PoseRecord) -> AttemptFailedError | None:
        """Commit a pose, or return why it was given up."""
        legs, failure = route(self._plan, self._stop, pose.id), None
        if pose.disks != self._disks:
            legs = self._stack(pose)
        for _ in range(1 + self._settings.procedure.retries):
            failure = self._try(pose, legs)
            self._stop, legs = pose.id, (pose.approach_joints,)
            if failure is None:
                return None
        self._given_up.append(pose.id)
        self._log.write(Event.GIVEN_UP, text=str(failure))
        return failure

    def _stack(self, pose: PoseRecord) -> tuple[Joints, ...]:
        """Have a person stack a pose's disks, the arm at HOME and disarmed; return the legs on.

        Raises
        ------
        FaultError
            If the arm does not say that it is disarmed, or the run is asked to stop before somebody
            says that the disks are stacked.
        """
        home, legs = self._plan.robot.home, route(self._plan, self._stop, pose.id)
        if home not in legs and self._stop != HOME_AT_START:
            # Straight from HOME to a leg of the way from pose to pose nothing was checked.
            end = home_stop(self._plan, self._stop)
            legs = (*route(self._plan, self._stop, end), *route(self._plan, end, pose.id))
        before = max((at for at, leg in enumerate(legs) if leg == home), default=-1) + 1
        # The first session begins at HOME, whichever end of the round the legs begin at.
        if self._stop != HOME_AT_START:
            self._enable()
            drive(self._supervisor, legs[:before], Guard(self._free_limit, free=True))
        self._location = ArmLocation.HOME
        disarm(self._supervisor)
        state = self._supervisor.arm_state()
        if state is None or state.motion is not Motion.DISARMED:
            raise FaultError(Fault.ARM_FAULT, "it does not say that it is disarmed: do not enter")
        self._log.pose = self._log.attempt = self._log.step = None
        self._log.write(Event.ASKED, text=f"for {counted(pose.disks, 'disk')}")
        self._supervisor.wait_for_person(self._hooks.stack(pose.disks))
        self._log.write(Event.HANDLED, text=counted(pose.disks, "disk"))
        self._devices.stack(pose.disks)
        self._disks = pose.disks
        self._supervisor.start()
        self._location = ArmLocation.BETWEEN_POSES
        return legs[before:]

    def _try(self, pose: PoseRecord, legs: tuple[Joints, ...]) -> AttemptFailedError | None:
        """Make one attempt; return its failure if it is one that may be tried again."""
        a = self._new_attempt(pose, legs)
        self._enable()
        recorder = self._supervisor.recorder = self._hooks.recorder()
        path = self._session.folder.streams / a.streams

        def commit(a: Attempt) -> StepResult:
            _require_settled_load_case(a)
            # The streams before the journal: an entry on the disk means that its streams are, too.
            digest = _save(recorder, path)
            # The arm is at the approach pose: the time of a disk access is not a device's fault.
            self._supervisor.pause()
            self._log.write(Event.COMMIT, log=a.log(), streams_sha256=digest)
            return StepResult.GOOD

        try:
            run_attempt(a, self._enter, commit)
        except AttemptFailedError as error:
            # First of all, so that a later failure does not change the recorded position of the
            # arm.
            self._location = error.location
            self._failed += error.fault is not Fault.INTERRUPTED
            self._keep(error, recorder, path)
            if (
                error.fault.scope is FaultScope.RUN
                or error.location is not ArmLocation.APPROACH_POSE
            ):
                raise
            return error
        except BaseException:
            self._location = a.location
            raise
        finally:
            self._supervisor.recorder = None
        return None

    def _keep(self, error: AttemptFailedError, recorder: StreamRecorder, path: Path) -> None:
        """Write down a fault and what led to it; a disk that fails as well must not hide it."""
        if error.fault is Fault.DISK:
            return
        self._log.must_write = False
        with contextlib.suppress(*EXPECTED_ERRORS):
            self._log.write(Event.FAULT, text=str(error))
        with contextlib.suppress(*EXPECTED_ERRORS):
            _save(recorder, path)
        self._log.must_write = True
        self._supervisor.pause()

    def _new_attempt(self, pose: PoseRecord, legs: tuple[Joints, ...]) -> Attempt:
        number = self._attempts.get(pose.id, 0) + 1
        # A journal that has lost its end does not know all recordings: none may be overwritten.
        while self._session.folder.stream(pose.id, number).exists():
            number += 1
        self._attempts[pose.id] = number
        self._log.pose, self._log.attempt = pose.id, number
        self._pose_start = self._supervisor.now
        streams, station = self._session.folder.stream(pose.id, number).name, pose.seen_by or ""
        self._attempt = Attempt(self._supervisor, pose, station, number, legs, streams)
        return self._attempt

    def _go_home(self) -> None:
        self._attempt, self._location = None, ArmLocation.BETWEEN_POSES
        self._log.pose = self._log.attempt = self._log.step = None
        if self._stop == HOME_AT_START:
            self._location = ArmLocation.HOME
            return
        self._enable()
        self._pose_start = self._supervisor.now
        guard = Guard(self._free_limit, free=True)
        end = home_stop(self._plan, self._stop)
        drive(self._supervisor, route(self._plan, self._stop, end), guard)
        self._location = ArmLocation.HOME

    def _enter(self, a: Attempt) -> None:
        """Note that an attempt enters a state."""
        self._log.step = a.step.value
        recorder = self._supervisor.recorder
        if recorder is not None:
            load_case = f" {a.load_case}" if a.load_case else ""
            recorder.mark(self._supervisor.now, f"{a.step.value}{load_case}")

    def _enable(self) -> None:
        """Release the arm for motion, at the beginning and after a stop that we sent."""
        if self._devices.arm.state().motion in (Motion.DISARMED, Motion.STOPPED):
            with self._supervisor.actuation(Action.ENABLE):
                self._devices.arm.enable()

    def _check_joints(self) -> None:
        names, wanted = tuple(self._devices.arm.joint_names), self._plan.robot.joints
        if names != wanted:
            raise ProcedureError(
                f"the arm has the joints {', '.join(names)}; the plan needs {', '.join(wanted)}"
            )

    @property
    def _free_limit(self) -> float:
        settings = self._settings
        return settings.force_limit + 2.0 * settings.tool_weight

    def _report(self, seen: Snapshot) -> None:
        self._cycles += 1
        if self._watched and self._cycles % _REPORT_EVERY == 0:
            try:
                self._hooks.report(self._progress(seen))
            except OSError:
                # A terminal that is gone is no reason to stop, and no device's fault.
                self._watched = False

    def _progress(self, seen: Snapshot) -> Progress:
        a, count = self._attempt, len(self._plan.poses)
        pose = None if a is None else a.pose.id
        left = self._left[count if pose is None else pose] - (seen.time - self._pose_start)
        # On a move the tool turns, and what the sensor shows is its weight.
        moves = a is None or a.step in (Step.MOVE, Step.DONE)
        shown = not moves and len(seen.force_tcp) > 0
        force = seen.force_tcp[-1] if shown else np.zeros(3)
        return Progress(
            time=seen.time,
            number=count if pose is None else self._number[pose],
            count=count,
            pose=pose,
            attempt=0 if a is None else a.number,
            step=Step.MOVE if a is None else a.step,
            load_case=None if a is None else a.load_case,
            force=float(np.linalg.norm(force)),
            slip=0.0 if a is None else a.slip,
            left=max(float(left), 0.0),
            q=tuple(seen.arm.q.tolist()),
            marker=self._marker(seen),
        )

    def _marker(self, seen: Snapshot) -> Triple | None:
        if not (self._settings.tracked and len(seen.points)):
            return None
        return triple(seen.points.position[-1])

    def _given_up_message(self) -> str:
        if not self._given_up:
            return ""
        numbers = ", ".join(map(str, self._given_up))
        return f"given up: pose {numbers}; `--resume` tries again once the cause is mended"

    def _failure(self, fault: FaultError, location: ArmLocation) -> SessionResult:
        end = RunEnd.INTERRUPTED if fault.fault is Fault.INTERRUPTED else RunEnd.STOPPED
        return self._result(end, location, str(fault))

    def _result(self, end: RunEnd, location: ArmLocation, message: str) -> SessionResult:
        enough = bool(self._enough)
        return SessionResult(end, location, message, tuple(self._given_up), self._failed, enough)

    def _finish(self, result: SessionResult) -> None:
        disarm(self._supervisor)
        self._log.must_write = False
        text = f"{result.end.value}, {result.location.value}"
        text = f"{text}: {result.message}" if result.message else text
        with contextlib.suppress(*EXPECTED_ERRORS):
            self._log.write(Event.FINISH, text=text, lines=self._devices.lines())


def _save(recorder: StreamRecorder, path: Path) -> str | None:
    """Write the streams and return their digest; what a disk refuses is no device's fault."""
    try:
        return recorder.save(path)
    except OSError as error:
        raise FaultError(Fault.DISK, str(error)) from error


def _require_settled_load_case(a: Attempt) -> None:
    """Refuse a pose without its reference, or of which no load case has settled.

    Without the press before the reference friction has another history than the dataset says.
    """
    for window in a.windows:
        wanted = window.load_case in (CONDITIONING, LIGHT_CONTACT)
        # A press that slipped has still loaded the arm; a reference must be at rest.
        slipped = window.load_case == CONDITIONING and window.status is ReadingStatus.SLIPPED
        if wanted and window.status is not ReadingStatus.OK and not slipped:
            raise FaultError(Fault.REFERENCE_LOST, f"{window.load_case}: {window.note}")
    loaded = [window for window in a.windows if window.load_case is not None]
    if loaded and all(window.status is ReadingStatus.UNSTABLE for window in loaded):
        raise FaultError(Fault.UNSTABLE, loaded[-1].note)
