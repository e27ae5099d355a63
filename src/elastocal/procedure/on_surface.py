"""States at the surface: engage, and for each load case ramp, settle, average."""

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell.devices import Motion
from elastocal.procedure.attempt import Attempt
from elastocal.procedure.entries import Action
from elastocal.procedure.faults import Fault, FaultError
from elastocal.procedure.off_surface import go_straight
from elastocal.procedure.pose_log import ReadingStatus
from elastocal.procedure.slip import SlideWatch
from elastocal.procedure.steadiness import LEAST_SAMPLES, Stretch, complaint, steadiness
from elastocal.procedure.steps import Outcome
from elastocal.procedure.supervisor import TIME_SLACK
from elastocal.procedure.watch import Seen

WINDOW_TRIES = 3
"""Windows of one load case that may be spoiled before it is given up."""


def engage(a: Attempt) -> Outcome:
    """Go on until the contact force is felt."""
    procedure = a.settings.procedure
    seen = a.supervisor.cycle(a.guard())
    distance = a.line.height(seen.arm.T_base_tcp) + procedure.travel_limit
    seen = go_straight(a, distance, procedure.contact_speed)
    if not seen.arm.in_contact:
        text = f"none within {procedure.travel_limit * 1e3:g} mm beyond the expected one"
        raise FaultError(Fault.CONTACT_MISSED, text)
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
        why = complaint(steadiness(stretch.time, stretch.values), procedure, force) or ""
        if not why and s.watch.sees:
            return Outcome.GOOD
    note = f"not stable within {procedure.timeout:g} s: {why or 'the beam is broken'}"
    a.close_window(name, s.now, ReadingStatus.UNSTABLE, note)
    return Outcome.LOST


def average(a: Attempt) -> Outcome:
    """Take one reading, or find that it cannot be taken."""
    s, (name, force), procedure = a.supervisor, a.load, a.settings.procedure
    start, breaks, forces, points = s.now, s.watch.breaks, Stretch(), Stretch()
    for seen in s.stay(a.guard(), procedure.average):
        _refuse_other_motion(seen)
        _see(a, seen)
        forces.add(seen.wrenches.time, seen.force_tcp)
        points.add(seen.points.time, seen.points.position)
        if s.watch.breaks > breaks:
            note = f"{a.station} lost the marker in {WINDOW_TRIES} windows"
            return _again(a, ReadingStatus.ABORTED, note)
    if len(forces) < LEAST_SAMPLES or len(points) < LEAST_SAMPLES:
        note = f"{len(forces)} samples of the force and {len(points)} of the marker"
        return _again(a, ReadingStatus.ABORTED, note)
    why = complaint(steadiness(forces.time, forces.values), procedure, force)
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
    watch, slide, procedure = a.slip_watch, a.slide_watch, a.settings.procedure
    assert watch is not None
    assert slide is not None
    a.slip = watch.so_far(positions)
    moved, limit = abs(a.slip - a.slip_origin), procedure.slip_limit
    expected = procedure.contact_compliance * float(np.linalg.norm(force))
    for length, most, what in (
        (slide.largest, limit, "slid {} at once"),
        (watch.during(positions), limit, "slid {} during the window"),
        (moved, limit + expected, "is {} aside under this load"),
    ):
        if not length <= most:
            a.slip_origin = a.slip
            said = what.format(f"{length * 1e3:.2f} mm")
            return f"marker {said}, limit {most * 1e3:.2f} mm"
    return ""


def _see(a: Attempt, seen: Seen) -> None:
    if a.slide_watch is not None:
        a.slide_watch.see(seen.points.position)


def _refuse_other_motion(seen: Seen) -> None:
    if seen.arm.motion is not Motion.HOLDING:
        text = f"{seen.arm.source} is {seen.arm.motion.value} and holds no force"
        raise FaultError(Fault.CONTACT_LOST, text)
