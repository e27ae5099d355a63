"""State of one attempt at a pose, and the motions that it is made of.

A motion (joint move, straight move, force release) begins with one cycle that checks the arm. It
journals the command before it is sent, and waits under the watchdog until the arm reports the end,
at most for a limited time.
"""

from dataclasses import dataclass, field
from functools import partial

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import ArmState, Motion
from elastocal.planning import Joints, PoseRecord
from elastocal.procedure.record import Action, PoseLog, ReadingStatus, Window
from elastocal.procedure.run._supervisor import Supervisor
from elastocal.procedure.run._watchdog import Guard, Snapshot
from elastocal.procedure.run.leaving import BIAS, STRAIGHT_TOLERANCE, LeavingWatch
from elastocal.procedure.run.routes import ApproachLine
from elastocal.procedure.run.settings import RunSettings
from elastocal.procedure.run.steps import (
    MAY_TOUCH,
    ON_APPROACH_LINE,
    ArmLocation,
    Fault,
    FaultError,
    SlideDetector,
    SlipReference,
    Step,
)

_STIFFEST = 1e6
"""Arm and tooling against each other are not stiffer than this, in N/m: so much the force grows
a metre before a guarded move is seen to have ended."""


@dataclass(eq=False)
class Attempt:
    """One attempt at a pose; changes as it goes."""

    supervisor: Supervisor
    pose: PoseRecord
    station: str
    number: int
    """Number of the attempt, from 1, over all sessions of the run."""
    legs: tuple[Joints, ...]
    """Joint positions to pass on the path to the approach pose, which is the last."""
    streams: str
    """Name of the file with the raw streams."""
    step: Step = Step.MOVE
    loads_done: int = 0
    """Load cases that have a window."""
    window_tries: int = 0
    """Windows of the present load case that a broken beam spoiled."""
    in_force_control: bool = False
    """Since a force was asked for, until it was released."""
    windows: list[Window] = field(default_factory=list)
    at_approach: FloatArray = field(default_factory=lambda: np.zeros(3))
    """Marker at the approach pose, shape (3,), in m, tracker frame."""
    slip_reference: SlipReference | None = None
    slide: SlideDetector | None = None
    """Slides of the present load case."""
    slip_origin: float = 0.0
    """Lateral movement that has been reported as slip already, in m."""
    slip: float = 0.0
    """Lateral movement of the marker at the last reading, in m."""
    jump: SlideDetector | None = None
    """Along the normal, during the windows of the present load case."""
    location: ArmLocation = ArmLocation.BETWEEN_POSES
    """Position of the arm if the program fails."""

    @property
    def settings(self) -> RunSettings:
        """Figures of the run."""
        return self.supervisor.settings

    @property
    def line(self) -> ApproachLine:
        """Straight line to the surface."""
        return ApproachLine.of_pose(self.pose, self.settings.procedure.travel_limit)

    @property
    def load(self) -> tuple[str, FloatArray]:
        """Name and force of the present load case."""
        return self.settings.loads[self.loads_done]

    @property
    def load_case(self) -> str | None:
        """Name of the present load case while one is on."""
        loaded = self.step in (Step.LOAD, Step.SETTLE, Step.AVERAGE)
        return self.load[0] if loaded else None

    @property
    def loads_left(self) -> int:
        """Number of load cases without a window."""
        return len(self.settings.loads) - self.loads_done

    def guard(self, *, beam: bool = True) -> Guard:
        """Return the limits that hold in the present state."""
        if self.step in ON_APPROACH_LINE:
            limit = self.settings.force_limit
            if self.step is Step.ENGAGE:
                limit = min(limit, self._engage_limit)
            return Guard(limit, self.line, beam, self.step in MAY_TOUCH)
        # The weight of the tool turns with its orientation: at most twice itself.
        limit = self.settings.force_limit + 2.0 * self.settings.tool_weight
        return Guard(limit, None, beam, free=self.step is Step.MOVE)

    @property
    def noise(self) -> float:
        """Force without contact: noise, and the inertia of the tool, in N."""
        return 2.0 * self.settings.procedure.force_spread

    @property
    def _engage_limit(self) -> float:
        """Largest force of a guarded move that ends as it should, in N."""
        p = self.settings.procedure
        return p.contact_force + _STIFFEST * p.contact_speed * p.cycle + self.noise

    def close_window(
        self,
        load_case: str | None,
        start: float,
        status: ReadingStatus = ReadingStatus.OK,
        note: str = "",
    ) -> None:
        """Keep the stretch from ``start`` until now as a reading; go on to the next load case."""
        end = self.supervisor.now
        self.windows.append(
            Window(
                load_case=load_case,
                start=start,
                end=end,
                station=self.station or None,
                status=status,
                note=note,
            )
        )
        if load_case is not None:
            self.loads_done, self.window_tries = self.loads_done + 1, 0

    def log(self) -> PoseLog:
        """Return the log to commit."""
        return PoseLog(
            pose=self.pose.id,
            attempt=self.number,
            streams=self.streams,
            windows=tuple(self.windows),
        )


_JOINT_TOLERANCE = 5e-3
"""A joint that is closer to its target than this has arrived, in rad or m."""


def drive(supervisor: Supervisor, legs: tuple[Joints, ...], guard: Guard) -> None:
    """Pass joint positions one after the other, each leg straight in joint space.

    Raises
    ------
    FaultError
        See `Supervisor.wait`.
    """
    settings = supervisor.settings
    if legs:
        _adopt_position(supervisor)
    for leg, target in enumerate(legs):
        seen = supervisor.cycle(Guard())
        _require_off(seen.arm)
        # Once: a tare at each leg would hide a force that grows from leg to leg.
        if leg == 0 and len(seen.wrenches):
            force = seen.wrenches.force.mean(axis=0)
            require_tool_weight(force, settings)
            supervisor.tare(force)
            supervisor.watchdog.collisions.restart()
        goal = np.array(target)
        limit = 2.0 * float(settings.axes.duration(seen.arm.q, goal)) + settings.procedure.timeout
        with supervisor.actuation(Action.MOVE, target):
            supervisor.devices.arm.move_joints(goal, settings.override)
            supervisor.wait(guard, partial(_at_joints, goal), limit, "a move")


def _adopt_position(supervisor: Supervisor) -> None:
    """Let the arm adopt its position as the programmed one, if the tool is off the surface.

    Raises
    ------
    FaultError
        If the arm says that it is in contact.
    """
    arm = supervisor.devices.arm
    _require_off(arm.state())
    supervisor.pause()
    arm.adopt_position()
    supervisor.restart_watching()


def _require_off(state: ArmState) -> None:
    # A joint move sweeps the tool sideways: in contact it would drag it over the surface.
    if state.in_contact:
        raise FaultError(Fault.IN_CONTACT, f"{state.source} says that it is")


def approach_by(a: Attempt, distance: float, speed: float, most: float = np.inf) -> Snapshot:
    """Make a guarded linear move along the inward normal; return what is seen at its end.

    It also ends, with the arm still moving, when a force above ``most`` N is felt.
    """
    s, procedure = a.supervisor, a.settings.procedure
    start = s.cycle(a.guard()).arm.T_base_tcp[:3, 3]

    def done(seen: Snapshot) -> bool:
        touched = is_idle(seen.arm) and bool(seen.arm.in_contact)
        return touched or has_gone(seen.arm, start, distance) or not largest_force(seen) <= most

    limit = 2.0 * distance / speed + procedure.timeout
    with s.actuation(Action.APPROACH, (distance,)):
        s.devices.arm.approach(-a.line.normal, distance, speed, procedure.contact_force)
        return s.wait(a.guard(), done, limit, "an approach")


def retract_to(
    supervisor: Supervisor,
    line: ApproachLine,
    guard: Guard,
    height: float,
    leaving: LeavingWatch | None = None,
) -> None:
    """Move along a line's normal to a height above the expected contact, in m.

    Parameters
    ----------
    supervisor, line, guard, height : Supervisor, ApproachLine, Guard, float
        The cycle, the line, the conditions on it, and its end.
    leaving : LeavingWatch, optional
        Refuses a force that grows during the retreat.

    Raises
    ------
    FaultError
        See `Supervisor.wait`.
    """
    start = supervisor.cycle(guard).arm.T_base_tcp
    distance = height - line.height(start)
    if distance <= 0.0:
        return
    limit = retract_limit(supervisor.settings, distance)

    def done(seen: Snapshot) -> bool:
        if leaving is not None:
            leaving.look(seen.wrenches, seen.arm.T_base_tcp)
        return has_gone(seen.arm, start[:3, 3], distance)

    with supervisor.actuation(Action.RETRACT, (distance,)):
        speed = supervisor.settings.procedure.approach_speed
        supervisor.devices.arm.retract(line.normal, distance, speed)
        supervisor.wait(guard, done, limit, "the retract")


def release_force(supervisor: Supervisor, guard: Guard) -> None:
    """Ramp the force to zero; the arm then is in position control.

    Raises
    ------
    FaultError
        See `Supervisor.wait`.
    """
    with supervisor.actuation(Action.RELEASE):
        supervisor.devices.arm.release(supervisor.settings.procedure.ramp)
        _wait_released(supervisor, guard)


def leave_force_control(supervisor: Supervisor) -> None:
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
        _wait_released(supervisor, Guard())


def require_tool_weight(force: FloatArray, settings: RunSettings) -> None:
    """Refuse a force in free air, shape (3,), in N, that is not about the tool's weight.

    Half the weight is left for a mass that is only roughly known, and a tenth of the force limit
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


def largest_force(seen: Snapshot) -> float:
    """Return the largest force of a cycle, tared, in N; 0 when nothing has come."""
    return float(np.linalg.norm(seen.force_tcp, axis=1).max(initial=0.0))


def is_idle(arm: ArmState) -> bool:
    """Return whether the arm is at rest in position control."""
    return arm.motion is Motion.IDLE


def has_gone(arm: ArmState, start: FloatArray, distance: float) -> bool:
    """Return whether a straight motion of a distance in m from a start, shape (3,), is over.

    Idle alone is not enough: an arm may still be idle in the first cycle after a command.
    """
    gone = float(np.linalg.norm(arm.T_base_tcp[:3, 3] - start))
    return is_idle(arm) and gone > distance - STRAIGHT_TOLERANCE


def release_limit(settings: RunSettings) -> float:
    """Return the longest time that a release may take, in s."""
    return 2.0 * settings.force_limit / settings.procedure.ramp + settings.procedure.timeout


def retract_limit(settings: RunSettings, distance: float) -> float:
    """Return the longest time that a retract by a distance in m may take, in s."""
    return 2.0 * distance / settings.procedure.approach_speed + settings.procedure.timeout


def _at_joints(goal: FloatArray, seen: Snapshot) -> bool:
    away = float(np.abs(seen.arm.q - goal).max())
    return is_idle(seen.arm) and away <= _JOINT_TOLERANCE


def _wait_released(supervisor: Supervisor, guard: Guard) -> None:
    limit = release_limit(supervisor.settings)
    supervisor.wait(guard, lambda seen: is_idle(seen.arm), limit, "the release")
