"""States off the surface: the way to the approach pose, aiming, near contact, the reference."""

from functools import partial

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell.devices import Motion
from elastocal.planning import Joints
from elastocal.procedure.attempt import Attempt
from elastocal.procedure.entries import Action
from elastocal.procedure.faults import Fault, FaultError
from elastocal.procedure.settings import Settings
from elastocal.procedure.slip import SlipWatch
from elastocal.procedure.steadiness import LEAST_SAMPLES, Stretch, complaint, shaking, steadiness
from elastocal.procedure.steps import Outcome
from elastocal.procedure.supervisor import TIME_SLACK, Supervisor
from elastocal.procedure.watch import Guard, Seen

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
