"""The simulated robot controller; see `elastocal.cell.devices.RobotArm` for its contract.

Assumptions: joint moves are straight in joint space with trapezoidal speed; straight moves have
one speed throughout; a stop takes no time; free motion shakes the friction out of the gears.
"""

import math
from functools import partial

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import ArmState, CommandChecks, Motion
from elastocal.errors import DeviceError
from elastocal.sim.truth import Fault, truth_of
from elastocal.sim.workcell._contact import Contact
from elastocal.sim.workcell._paths import ForceControl, guarded_move, joint_path, retract_path
from elastocal.sim.workcell._plant import FOREVER, Plant
from elastocal.sim.workcell._timeline import (
    MICROSECONDS,
    Segment,
    Uniform,
    joint_move,
    to_microseconds,
)

_SOURCE = "simulated arm"
_CHECKS = CommandChecks(_SOURCE)
_STANDING = (Motion.IDLE,)
_FORCED = (Motion.IDLE, Motion.HOLDING, Motion.RELEASING)


class SimulatedArm:
    """A robot arm that does not know how it bends."""

    def __init__(self, plant: Plant, control: ForceControl) -> None:
        """Take the arm of a cell; its drives are off."""
        self._plant, self._control = plant, control
        self.joint_names = plant.cell.robot.joint_names
        self._fault: str | None = None
        self._refused_until = 0
        self._approaches = 0
        self._visiting = False
        self._touched = False
        self._leaving: Contact | None = None
        self._pose: tuple[Segment, FloatArray] | None = None

    def state(self) -> ArmState:
        """Return the newest state."""
        plant, segment = self._plant, self._plant.segment
        now = plant.now
        time = now
        for span in plant.schedule.spans("stale_clock"):
            time = min(time, span.begin) if span.holds(now) else time
        done = now >= segment.end
        if done and self._pose is not None and self._pose[0] is segment:
            q, T = segment.path.end.q, self._pose[1]
        else:
            where = np.array([segment.progress(now)])
            q = segment.path.knots.at(segment.path.knots.q, where)[0]
            T = plant.statics.robot.forward(q)
            self._pose = (segment, T) if done else None
        motion = segment.motion_after if done else segment.motion
        return ArmState(
            time=time / MICROSECONDS,
            q=q.copy(),
            T_base_tcp=T.copy(),
            motion=motion,
            in_contact=self._in_contact(done),
            fault=segment.fault_after if done else None,
            source=_SOURCE,
        )

    def enable(self) -> None:
        """Release the arm for motion; it then is idle. Refused while a fault stands."""
        plant = self._plant
        if plant.now < self._refused_until:
            raise DeviceError(f"{_SOURCE} cannot be enabled: {self._fault}")
        self._fault = None
        if self._motion() in (Motion.DISARMED, Motion.STOPPED):
            plant.stand(plant.robot_state(), Motion.IDLE)

    def disable(self) -> None:
        """Take the release back; the arm stands."""
        self._freeze(Motion.DISARMED, self._fault)

    def stop(self) -> None:
        """Stop at once, in position control. Always allowed."""
        if self._motion() is not Motion.DISARMED:
            self._freeze(Motion.STOPPED, self._fault)

    def move_joints(self, q: FloatArray, speed: float) -> None:
        """Start a synchronous joint-space move; see `RobotArm.move_joints`."""
        plant, linkage = self._plant, self._plant.statics.robot.linkage
        limits = linkage.lower, linkage.upper
        target = _CHECKS.joint_move(q, speed, self.joint_names, limits)
        self._allow("move_joints", _STANDING, free=True)
        start = plant.robot_state()
        plant.begin_journey(target)
        self._visiting = False
        end = plant.statics.free(target, plant.stop_error(), None)
        motion = plant.cell.file.motion
        # The cell's speeds hold its override already; a caller says its own part of them.
        fastest = plant.cell.axis_speeds / motion.override
        law = joint_move(target - start.q, speed * fastest, motion.acceleration_time)
        path = joint_path(plant.statics, start, end)
        plant.run(path, law, (Motion.MOVING, Motion.IDLE))

    def adopt_position(self) -> None:
        """Do nothing: there are no corrections on top of the programmed place."""

    def approach(
        self, direction_base: FloatArray, distance: float, speed: float, contact_force: float
    ) -> None:
        """Start a guarded straight move; see `RobotArm.approach`."""
        plant = self._plant
        direction = _CHECKS.line("approach", direction_base, distance, speed)
        _CHECKS.require(contact_force > 0.0, "contact force", contact_force, "above 0 N")
        self._allow("approach", _STANDING, in_contact=False)
        start = plant.robot_state()
        self._begin_approach()
        guarded = guarded_move(plant, start, direction, distance, (speed, contact_force))
        plant.contact, self._touched = guarded.contact, guarded.felt
        after = Motion.STOPPED if guarded.fault else Motion.IDLE
        self._fault = guarded.fault
        law = Uniform(guarded.length / speed)
        plant.run(guarded.path, law, (Motion.APPROACHING, after), fault=guarded.fault)
        if self._approaches == 1 and not guarded.felt:
            segment = plant.segment
            plant.later(segment.end, partial(self._reference, segment))

    def hold(self, force_tcp: FloatArray, rate: float) -> None:
        """Start to build up a force and hold it; see `RobotArm.hold`."""
        wanted = _CHECKS.vector("force", force_tcp, 3)
        _CHECKS.require(
            wanted[2] < 0.0, "force z", wanted[2], "below 0 N: the robot can only press"
        )
        most = truth_of(self._plant.cell).controller.collision_force
        size = float(np.linalg.norm(wanted))
        _CHECKS.require(size <= most, "force", size, f"at most {most:g} N, what the drives give")
        _CHECKS.require(0.0 < rate < math.inf, "force rate", rate, "above 0 N/s and finite")
        self._allow("hold", _FORCED, in_contact=True)
        self._control.hold(wanted, rate)
        self._begin("hold", self._control.load)

    def release(self, rate: float) -> None:
        """Start to ramp the force to zero; see `RobotArm.release`."""
        _CHECKS.require(0.0 < rate < math.inf, "force rate", rate, "above 0 N/s and finite")
        self._allow("release", _FORCED, in_contact=True)
        self._control.release(rate)
        self._begin("release")

    def retract(self, direction_base: FloatArray, distance: float, speed: float) -> None:
        """Start a straight move away from the surface; see `RobotArm.retract`."""
        plant = self._plant
        direction = _CHECKS.line("retract", direction_base, distance, speed)
        self._allow("retract", _FORCED)
        if plant.contact is not None and not float(direction @ plant.contact.normal) > 0.0:
            raise DeviceError(
                f"{_SOURCE}: retract direction {direction.tolist()} leads into the surface, whose"
                f" normal is {np.round(plant.contact.normal, 4).tolist()}"
            )
        start = plant.robot_state()
        path, contact = retract_path(plant, start, direction, distance)
        self._leaving, plant.contact = plant.contact, contact
        if contact is None:
            self._touched = self._visiting = False
        plant.run(path, Uniform(distance / speed), (Motion.RETRACTING, Motion.IDLE))
        self._begin("retract")

    def _motion(self) -> Motion:
        segment = self._plant.segment
        return segment.motion_after if self._plant.now >= segment.end else segment.motion

    def _in_contact(self, done: bool) -> bool:
        return self._touched and (done or self._plant.segment.motion is not Motion.APPROACHING)

    def _allow(
        self,
        command: str,
        states: tuple[Motion, ...],
        *,
        in_contact: bool | None = None,
        free: bool = False,
    ) -> None:
        """Refuse a command that does not fit what the arm is doing."""
        motion = self._motion()
        if motion not in states:
            allowed = ", ".join(state.value for state in states)
            raise DeviceError(
                f"{_SOURCE} refuses {command}: it is {motion.value} (allowed when {allowed})"
            )
        if in_contact is not None and in_contact is not self._touched:
            what = "only in contact" if in_contact else "not in contact: retract first"
            raise DeviceError(f"{_SOURCE} refuses {command}: allowed {what}")
        if free and self._plant.contact is not None:
            raise DeviceError(f"{_SOURCE} refuses {command}: the tool is at the surface, retract")

    def _freeze(self, motion: Motion, fault: str | None) -> None:
        """Stand where the arm is."""
        plant = self._plant
        before = self._motion()
        plant.stand(plant.robot_state(), motion, fault)
        pressing = bool(np.any(plant.segment.path.end.force))
        if before is Motion.APPROACHING:
            self._touched = False
            plant.contact = plant.contact if pressing else None
        elif before is Motion.RETRACTING and pressing:
            plant.contact = self._leaving

    def _begin_approach(self) -> None:
        """Count an approach; the first one after a move or a retract begins a visit."""
        if not self._visiting:
            self._visiting, self._approaches = True, 0
            self._plant.begin_visit()
            self._control.begin_visit()
        self._approaches += 1
        self._begin("approach" if self._approaches == 1 else "engage")

    def _reference(self, segment: Segment) -> None:
        if self._plant.segment is segment:
            self._begin("reference")

    def _begin(self, step: str, load: int = 0) -> None:
        plant = self._plant
        for time, fault in plant.schedule.begin(step, plant.visit, load, plant.now):
            if fault.kind == "slip":
                plant.later(time, partial(self._control.let_slip, fault, plant.segment))
            else:
                plant.later(time, partial(self._break_down, fault))

    def _break_down(self, fault: Fault) -> None:
        self._fault = "stopped by the safety controller"
        lasts = FOREVER if fault.duration is None else to_microseconds(fault.duration)
        self._refused_until = self._plant.now + lasts
        self._freeze(Motion.STOPPED, self._fault)
