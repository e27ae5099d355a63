"""States off the surface: the way to the approach pose, aiming, near contact, the reference."""

from functools import partial

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell.devices import Motion
from elastocal.planning import Joints
from elastocal.procedure.record.journal import Action, ReadingStatus
from elastocal.procedure.run._attempt import Attempt
from elastocal.procedure.run._stability import (
    LEAST_SAMPLES,
    SlideWatch,
    SlipWatch,
    Stretch,
    complaint,
    shaking,
    steadiness,
)
from elastocal.procedure.run._supervisor import TIME_SLACK, Supervisor
from elastocal.procedure.run._watchdog import Guard, Seen
from elastocal.procedure.run.faults import Fault, FaultError
from elastocal.procedure.run.settings import Settings
from elastocal.procedure.run.steps import Outcome

ARRIVED = 5e-3
"""A joint that is closer to its target than this has arrived, in rad or m."""
STRAIGHT_ARRIVED = 1e-3
"""The same of a straight motion, in m."""
BIAS = 0.1
"""Bias of a sensor that is let pass, as a part of the force limit."""


def drive(supervisor: Supervisor, way: tuple[Joints, ...], guard: Guard) -> None:
    """Pass joint positions one after the other, each leg straight in joint space.

    Raises
    ------
    FaultError
        See `Supervisor.wait`.
    """
    settings = supervisor.settings
    for leg, target in enumerate(way):
        seen = supervisor.cycle(Guard())
        if seen.arm.in_contact:
            raise FaultError(Fault.IN_CONTACT, f"{seen.arm.source} says that it is")
        # Once: a tare at each leg would hide a force that grows from leg to leg.
        if leg == 0 and len(seen.wrenches):
            force = seen.wrenches.force.mean(axis=0)
            refuse_other_weight(force, settings)
            supervisor.tare(force)
        goal = np.array(target)
        expected = float(settings.axes.duration(seen.arm.q, goal))
        with supervisor.actuation(Action.MOVE, target):
            supervisor.devices.arm.move_joints(goal, settings.override)
            supervisor.wait(
                guard,
                partial(_stands_at, goal),
                2.0 * expected + settings.procedure.timeout,
                "a move",
            )


def move(a: Attempt) -> Outcome:
    """Go to the approach pose."""
    drive(a.supervisor, a.way, a.guard(beam=False))
    return Outcome.GOOD


def aim(a: Attempt) -> Outcome:
    """Wait for the beam; take the sensor's reading and the marker's place at the approach pose."""
    s, procedure = a.supervisor, a.settings.procedure
    s.aim(a.station)
    s.wait(
        a.guard(),
        lambda seen: s.watch.sees and len(seen.points) > 0 and seen.points.station == a.station,
        procedure.beam_timeout + 1.0,
        f"{a.station}: looking for the marker",
    )
    forces, points = Stretch(), Stretch()
    for seen in s.stay(a.guard(), procedure.dwell):
        forces.add(seen.wrenches.time, seen.wrenches.force)
        points.add(seen.points.time, seen.points.position)
    _refuse_empty(a, forces, points)
    refuse_other_weight(forces.values.mean(axis=0), a.settings)
    s.tare(forces.values.mean(axis=0))
    a.at_approach = points.values.mean(axis=0)
    return Outcome.GOOD


def near(a: Attempt) -> Outcome:
    """Go straight to near contact; nothing may be touched on the way."""
    procedure = a.settings.procedure
    seen = a.supervisor.cycle(a.guard())
    distance = a.line.height(seen.arm.T_base_tcp) - a.settings.near_contact
    most = procedure.contact_force + a.noise
    seen = go_straight(a, distance, procedure.approach_speed, most)
    if seen.arm.in_contact or felt(seen) > most:
        height = a.line.height(seen.arm.T_base_tcp)
        raise FaultError(Fault.CONTACT_EARLY, f"{height * 1e3:.1f} mm before the expected contact")
    return Outcome.GOOD


def unloaded(a: Attempt) -> Outcome:
    """Average tracker and sensor until both are quiet (p_i0^c, p_i0^m)."""
    s, procedure = a.supervisor, a.settings.procedure
    begin, noisy = s.now, ""
    for _ in s.stay(a.guard(), procedure.dwell):
        pass
    while s.now - begin <= procedure.timeout + TIME_SLACK:
        start, breaks, forces, points = s.now, s.watch.breaks, Stretch(), Stretch()
        for seen in s.stay(a.guard(), procedure.unloaded_average):
            forces.add(seen.wrenches.time, seen.wrenches.force)
            points.add(seen.points.time, seen.points.position)
            if s.watch.breaks > breaks:
                break
        if s.watch.breaks > breaks or not s.watch.sees:
            noisy = f"{a.station} loses the marker again and again"
            _wait_for_beam(a)
            continue
        _refuse_empty(a, forces, points)
        noisy = _noise(a, forces, points.values)
        if not noisy:
            s.tare(forces.values.mean(axis=0))
            a.slip_watch = SlipWatch.of(a.at_approach, points.values.mean(axis=0))
            a.close_window(None, start)
            return Outcome.GOOD
    raise FaultError(Fault.UNLOADED_NOISY, noisy)


def released(a: Attempt) -> Outcome:
    """Average once more, after the loads: how far the sensor is from its tare then.

    Nothing depends on it but what the summary says of the drift, so it cannot fail.
    """
    s, procedure = a.supervisor, a.settings.procedure
    for _ in s.stay(a.guard(beam=False), procedure.dwell):
        pass
    start = s.now
    for _ in s.stay(a.guard(beam=False), procedure.unloaded_average):
        pass
    a.close_window(None, start)
    return Outcome.GOOD


def refuse_other_weight(force: FloatArray, settings: Settings) -> None:
    """Refuse a force in free air, shape (3,), in N, that is not about the tool's weight.

    Half the weight is left for a mass that is only roughly known, and `BIAS` of the force limit
    for a sensor that has not been set to zero. Without a mass in the cell nothing is refused.

    Raises
    ------
    FaultError
        With both.
    """
    weight = settings.tool_weight
    if not weight > 0.0:
        return
    size, tolerance = float(np.linalg.norm(force)), 0.5 * weight + BIAS * settings.force_limit
    if not abs(size - weight) <= tolerance:
        text = f"{size:.0f} N in free air, it weighs {weight:.0f} N, tolerance {tolerance:.0f} N"
        raise FaultError(Fault.WEIGHT, text)


def felt(seen: Seen) -> float:
    """Return the largest force of a cycle, tared, in N; 0 when nothing has come."""
    return float(np.linalg.norm(seen.force_tcp, axis=1).max(initial=0.0))


def go_straight(a: Attempt, distance: float, speed: float, most: float = np.inf) -> Seen:
    """Make a guarded linear move along the inward normal; return what is seen at its end.

    It also ends, with the arm still moving, when a force above ``most`` N is felt.
    """
    s, procedure = a.supervisor, a.settings.procedure
    start = s.cycle(a.guard()).arm.T_base_tcp[:3, 3]
    with s.actuation(Action.APPROACH, (distance,)):
        s.devices.arm.approach(-a.line.normal, distance, speed, procedure.contact_force)
        return s.wait(
            a.guard(),
            lambda seen: _is_done(seen, start, distance) or felt(seen) > most,
            2.0 * distance / speed + procedure.timeout,
            "an approach",
        )


def _is_done(seen: Seen, start: FloatArray, distance: float) -> bool:
    if seen.arm.motion is not Motion.IDLE:
        return False
    if seen.arm.in_contact:
        return True
    return float(np.linalg.norm(seen.arm.T_base_tcp[:3, 3] - start)) > distance - STRAIGHT_ARRIVED


def _stands_at(goal: FloatArray, seen: Seen) -> bool:
    return seen.arm.motion is Motion.IDLE and float(np.abs(seen.arm.q - goal).max()) <= ARRIVED


def _wait_for_beam(a: Attempt) -> None:
    a.supervisor.wait(
        a.guard(),
        lambda seen: a.supervisor.watch.sees and len(seen.points) > 0,
        a.settings.procedure.beam_timeout + 1.0,
        f"{a.station}: looking for the marker",
    )


def _noise(a: Attempt, forces: Stretch, positions: FloatArray) -> str:
    """Return why a window is too noisy for a reference; empty when it is not."""
    procedure = a.settings.procedure
    why = shaking(positions, procedure.marker_sigma)
    return why or complaint(steadiness(forces.time, forces.values), procedure) or ""


def _refuse_empty(a: Attempt, forces: Stretch, points: Stretch) -> None:
    """Refuse a window with hardly any samples in it; no watchdog saw a gap, so they are slow."""
    for stretch, fault, name in (
        (forces, Fault.SENSOR_STALE, "the sensor"),
        (points, Fault.TRACKER_STALE, a.station),
    ):
        if len(stretch) < LEAST_SAMPLES:
            raise FaultError(fault, f"{name} gave {len(stretch)} samples in a window")


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
