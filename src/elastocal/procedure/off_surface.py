"""States off the surface: the way to the approach pose, aiming, near contact, the reference."""

from functools import partial

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell.devices import Motion
from elastocal.planning.plan_file import Joints
from elastocal.procedure.attempt import Attempt
from elastocal.procedure.entries import Action
from elastocal.procedure.faults import Fault, FaultError
from elastocal.procedure.slip import SlipWatch
from elastocal.procedure.steadiness import LEAST_SAMPLES, Stretch, complaint, steadiness
from elastocal.procedure.steps import Outcome
from elastocal.procedure.supervisor import TIME_SLACK, Supervisor
from elastocal.procedure.watch import Guard, Seen

ARRIVED = 5e-3
"""A joint that is closer to its target than this has arrived, in rad or m."""
STRAIGHT_ARRIVED = 1e-3
"""The same of a straight motion, in m."""


def drive(supervisor: Supervisor, way: tuple[Joints, ...], guard: Guard) -> None:
    """Pass joint positions one after the other, each leg straight in joint space.

    Raises
    ------
    FaultError
        See `Supervisor.wait`.
    """
    settings = supervisor.settings
    for target in way:
        seen = supervisor.cycle(Guard())
        # Legs turn the tool: its weight is taken out anew at each.
        if len(seen.wrenches):
            supervisor.tare(seen.wrenches.force.mean(axis=0))
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
        lambda seen: s.watch.sees and len(seen.points) > 0,
        procedure.beam_timeout + 1.0,
        f"{a.station}: looking for the marker",
    )
    forces, points = Stretch(), Stretch()
    for seen in s.stay(a.guard(), procedure.dwell):
        forces.add(seen.wrenches.time, seen.wrenches.force)
        points.add(seen.points.time, seen.points.position)
    _refuse_empty(a, forces, points)
    s.tare(forces.values.mean(axis=0))
    a.at_approach = points.values.mean(axis=0)
    return Outcome.GOOD


def near(a: Attempt) -> Outcome:
    """Go straight to near contact; nothing may be touched on the way."""
    procedure = a.settings.procedure
    seen = a.supervisor.cycle(a.guard())
    distance = a.line.height(seen.arm.T_base_tcp) - a.settings.near_contact
    seen = go_straight(a, distance, procedure.approach_speed)
    if seen.arm.in_contact:
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


def go_straight(a: Attempt, distance: float, speed: float) -> Seen:
    """Make a guarded linear move along the inward normal; return what is seen at its end."""
    s, procedure = a.supervisor, a.settings.procedure
    start = s.cycle(a.guard()).arm.T_base_tcp[:3, 3]
    with s.actuation(Action.APPROACH, (distance,)):
        s.devices.arm.approach(-a.line.normal, distance, speed, procedure.contact_force)
        return s.wait(
            a.guard(),
            lambda seen: _is_done(seen, start, distance),
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
    limit = a.settings.procedure.marker_sigma
    sigma = float(positions.std(axis=0, ddof=1).max())
    if not sigma <= limit:
        return f"marker has a sigma of {sigma * 1e6:.0f} um, limit {limit * 1e6:g} um"
    return complaint(steadiness(forces.time, forces.values), a.settings.procedure) or ""


def _refuse_empty(a: Attempt, forces: Stretch, points: Stretch) -> None:
    """Refuse a window with hardly any samples in it; no watchdog saw a gap, so they are slow."""
    for stretch, fault, name in (
        (forces, Fault.SENSOR_STALE, "the sensor"),
        (points, Fault.TRACKER_STALE, a.station),
    ):
        if len(stretch) < LEAST_SAMPLES:
            raise FaultError(fault, f"{name} gave {len(stretch)} samples in a window")
