"""States at the surface: engage, and for each load case ramp, settle, average."""

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell.devices import Motion
from elastocal.procedure.attempt import Attempt
from elastocal.procedure.entries import Action
from elastocal.procedure.faults import Fault, FaultError
from elastocal.procedure.off_surface import felt, go_straight
from elastocal.procedure.pose_log import ReadingStatus
from elastocal.procedure.slip import SlideWatch
from elastocal.procedure.steadiness import LEAST_SAMPLES, Stretch, complaint, shaking, steadiness
from elastocal.procedure.steps import Outcome
from elastocal.procedure.supervisor import TIME_SLACK
from elastocal.procedure.watch import Seen

AGREES = 0.5
"""Smallest part of a force of the arm that its sensor must feel."""
REACH_MARGIN = 1e-3
"""How much earlier than at the travel limit the surface counts as missed, in m."""
WINDOW_TRIES = 3
"""Windows of one load case that may be spoiled before it is given up."""


def engage(a: Attempt) -> Outcome:
    """Go on until the contact force is felt."""
    procedure = a.settings.procedure
    seen = a.supervisor.cycle(a.guard())
    # Less than the limit: a place that is noisy must not turn a miss into something worse.
    reach = max(procedure.travel_limit - REACH_MARGIN, 0.5 * procedure.travel_limit)
    distance = a.line.height(seen.arm.T_base_tcp) + reach
    seen = go_straight(a, distance, procedure.contact_speed)
    if not seen.arm.in_contact:
        text = f"none within {reach * 1e3:g} mm beyond the expected one"
        raise FaultError(Fault.CONTACT_MISSED, text)
    _refuse_contact_unfelt(a, seen)
    return Outcome.GOOD


def load(a: Attempt) -> Outcome:
    """Ramp to the present load case."""
    s, (name, force) = a.supervisor, a.load
    ramp = a.settings.procedure.ramp
    present = s.cycle(a.guard()).force_tcp
    change = force - present[-1] if len(present) else force
    a.in_force_control = True
    assert a.slip_watch is not None
    a.slide_watch = slide = SlideWatch(a.slip_watch)
    a.jump_watch = SlideWatch(a.slip_watch, along=True)
    with s.actuation(Action.HOLD, name):
        s.devices.arm.hold(force, ramp)
        for seen in s.stay(a.guard(), float(np.linalg.norm(change)) / ramp):
            slide.see(seen.points.position)
    return Outcome.GOOD


def settle(a: Attempt) -> Outcome:
    """Wait until the force is steady and the marker is seen."""
    s, (name, force), procedure = a.supervisor, a.load, a.settings.procedure
    stretch, begin, why = Stretch(procedure.dwell), s.now, ""
    for seen in s.stay(a.guard(), procedure.timeout):
        _refuse_other_motion(seen)
        _see(a, seen)
        stretch.add(seen.wrenches.time, seen.force_tcp)
        if seen.time - begin < procedure.dwell - TIME_SLACK or len(stretch) < LEAST_SAMPLES:
            continue
        found = steadiness(stretch.time, stretch.values)
        why = complaint(found, procedure, force) or ""
        if not why and s.watch.sees:
            return Outcome.GOOD
        if seen.time - begin > 2.0 * procedure.dwell and not complaint(found, procedure):
            _refuse_unfollowed(found.mean, force)
    note = f"not stable within {procedure.timeout:g} s: {why or 'the beam is broken'}"
    a.close_window(name, s.now, ReadingStatus.UNSTABLE, note)
    return Outcome.LOST


def average(a: Attempt) -> Outcome:
    """Take one reading, or find that it cannot be taken."""
    s, (name, force), procedure = a.supervisor, a.load, a.settings.procedure
    start, breaks, forces, points = s.now, s.watch.breaks, Stretch(), Stretch()
    if a.jump_watch is not None:
        a.jump_watch.forget()
    for seen in s.stay(a.guard(), procedure.average):
        _refuse_other_motion(seen)
        _see(a, seen)
        if a.jump_watch is not None:
            a.jump_watch.see(seen.points.position)
        forces.add(seen.wrenches.time, seen.force_tcp)
        points.add(seen.points.time, seen.points.position)
        if s.watch.breaks > breaks:
            note = f"{a.station} lost the marker in {WINDOW_TRIES} windows"
            return _again(a, ReadingStatus.ABORTED, note)
    if len(forces) < LEAST_SAMPLES or len(points) < LEAST_SAMPLES:
        note = f"{len(forces)} samples of the force and {len(points)} of the marker"
        return _again(a, ReadingStatus.ABORTED, note)
    why = complaint(steadiness(forces.time, forces.values), procedure, force)
    why = why or shaking(points.values, procedure.marker_sigma)
    if why:
        note = f"not stable in {WINDOW_TRIES} windows: {why}"
        return _again(a, ReadingStatus.UNSTABLE, note)
    slipped = _slip(a, points.values, force)
    status = ReadingStatus.SLIPPED if slipped else ReadingStatus.OK
    a.close_window(name, start, status, slipped)
    return Outcome.GOOD


def _again(a: Attempt, status: ReadingStatus, note: str) -> Outcome:
    """Return AGAIN for a spoiled window; after the last one the load case has a status instead."""
    a.window_tries += 1
    if a.window_tries < WINDOW_TRIES:
        return Outcome.AGAIN
    a.close_window(a.load[0], a.supervisor.now, status, note)
    return Outcome.LOST


def _slip(a: Attempt, positions: FloatArray, force: FloatArray) -> str:
    """Return how the marker slipped during a window or on the way to it; empty: it did not."""
    watch, slide, jump, procedure = a.slip_watch, a.slide_watch, a.jump_watch, a.settings.procedure
    assert watch is not None
    assert slide is not None
    assert jump is not None
    a.slip = watch.so_far(positions)
    moved, limit = abs(a.slip - a.slip_origin), procedure.slip_limit
    expected = procedure.contact_compliance * float(np.linalg.norm(force))
    for length, most, what in (
        (slide.largest, limit, "slid {} at once"),
        (watch.during(positions), limit, "slid {} during the window"),
        (jump.largest, limit, "jumped {} along the normal"),
        (moved, limit + expected, "is {} aside under this load"),
    ):
        if not length <= most:
            a.slip_origin = a.slip
            said = what.format(f"{length * 1e3:.2f} mm")
            return f"marker {said}, limit {most * 1e3:.2f} mm"
    return ""


def _refuse_contact_unfelt(a: Attempt, seen: Seen) -> None:
    """Refuse a contact that the arm has felt and the sensor has not, within ``stale`` seconds."""
    s, procedure, largest = a.supervisor, a.settings.procedure, felt(seen)
    wanted = AGREES * procedure.contact_force
    if largest >= wanted:
        return
    for later in s.stay(a.guard(), procedure.stale):
        largest = max(largest, felt(later))
        if largest >= wanted:
            return
    text = (
        f"{seen.arm.source} feels {procedure.contact_force:g} N of contact,"
        f" {seen.wrenches.source} at most {largest:.0f} N"
    )
    raise FaultError(Fault.DISAGREE, text)


def _refuse_unfollowed(mean: FloatArray, force: FloatArray) -> None:
    """Refuse a force that is steady and has hardly come nearer to what was asked."""
    asked = float(np.linalg.norm(force))
    along = float(mean @ force) / asked
    if not along >= AGREES * asked:
        text = f"{asked:.0f} N are asked for, the sensor feels {along:.0f} N in that direction"
        raise FaultError(Fault.DISAGREE, text)


def _see(a: Attempt, seen: Seen) -> None:
    if a.slide_watch is not None:
        a.slide_watch.see(seen.points.position)


def _refuse_other_motion(seen: Seen) -> None:
    if seen.arm.motion is not Motion.HOLDING:
        text = f"{seen.arm.source} is {seen.arm.motion.value} and holds no force"
        raise FaultError(Fault.CONTACT_LOST, text)
