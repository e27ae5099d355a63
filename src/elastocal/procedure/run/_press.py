"""The states of one attempt, in the order of Procedure 1: one action each.

The order is what makes a reading worth something, and the cell safe. The sensor is tared in free
air just before contact, so that its drift since the last pose and the weight of the tool are not
taken for load; the reference of the tracker is taken there too, so that only what happens between
it and the load counts as deflection. With ``procedure.reference: light_contact`` that is read once
more, in contact, as the first press or the second: no step is added, the force of it is in the
plan's list of presses. Contact is made in position control, slowly and up to a small
force; only then is force control switched on. It is switched off, with the force ramped to zero,
before the tool leaves the surface: an arm in force control in free air would accelerate.
"""

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import LIGHT_CONTACT, Motion
from elastocal.errors import present
from elastocal.procedure.record import Action, ReadingStatus
from elastocal.procedure.run._attempt import (
    Attempt,
    approach_by,
    drive,
    largest_force,
    release_force,
    require_tool_weight,
    retract_to,
)
from elastocal.procedure.run._stability import (
    LEAST_SAMPLES,
    RecentSamples,
    SlideDetector,
    SlipReference,
    steadiness,
    why_off,
    why_shaking,
    why_unsteady,
)
from elastocal.procedure.run._supervisor import TIME_SLACK
from elastocal.procedure.run._watchdog import Snapshot
from elastocal.procedure.run.steps import Fault, FaultError, StepResult

_AGREES = 0.5
"""Smallest part of a force of the arm that its sensor must feel."""
_REACH_MARGIN = 1e-3
"""How much earlier than at the travel limit the surface counts as missed, in m."""
_WINDOW_TRIES = 3
"""Windows of one load case that may be spoiled before it is given up."""


def move(a: Attempt) -> StepResult:
    """Go to the approach pose."""
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
    """Go straight to near contact; nothing may be touched on the way."""
    procedure = a.settings.procedure
    seen = a.supervisor.cycle(a.guard())
    distance = a.line.height(seen.arm.T_base_tcp) - a.settings.near_contact
    most = procedure.contact_force + a.noise
    seen = approach_by(a, distance, procedure.approach_speed, most)
    if seen.arm.in_contact or largest_force(seen) > most:
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
    """Go on until the contact force is felt."""
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
    # Set before the command, not after: should the command fail half way, the force is released.
    a.in_force_control = True
    reference = present(a.slip_reference, "slip reference")
    a.slide = SlideDetector(reference)
    a.jump = SlideDetector(reference, along=True)
    with s.actuation(Action.HOLD, name):
        s.devices.arm.hold(force, ramp)
        for seen in s.stay(a.guard(), float(np.linalg.norm(change)) / ramp):
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
    # From here on the beam may break: no reading depends on it, and the way off must not.
    release_force(a.supervisor, a.guard(beam=False))
    a.in_force_control = False
    return StepResult.GOOD


def lift(a: Attempt) -> StepResult:
    """Go straight back until near contact."""
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
    """Go straight back to the approach pose."""
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
    """Have the standing marker measured, where that is a person's work; return whether it is."""
    is_asked = a.supervisor.ask(_what(a))
    if is_asked:
        # Nobody watched the way from the reading before: it is no slide.
        if a.slide is not None:
            a.slide.forget()
        _wait_for_beam(a)
    return is_asked


def _what(a: Attempt) -> str:
    return f"pose {a.pose.id}, {a.load_case or a.step.value}"


def _stand_still(a: Attempt, *, beam: bool = True) -> None:
    """Let what still swings after a motion die down."""
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
    """Return how the marker slipped during a window or on the way to it; empty: it did not."""
    reference, slide, jump, procedure = a.slip_reference, a.slide, a.jump, a.settings.procedure
    reference = present(reference, "reference")
    slide = present(slide, "slide")
    jump = present(jump, "jump")
    a.slip = reference.so_far(positions)
    if a.load[0] == LIGHT_CONTACT:
        # The zero is read here: where the marker stands now is where it counts from.
        a.slip_origin = a.slip
    moved, limit = abs(a.slip - a.slip_origin), procedure.slip_limit
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
