"""A KUKA arm over RSI; see `elastocal.cell.RobotArm` for the contract.

Two threads meet here: that of the link, which needs an answer at once, and the caller's, whose
commands only record the request. Joint moves are the controller's (``PTP``); approach, hold,
release and retract are relative corrections from the PC, so that the tool keeps its orientation.
The PC is no safety function: the motion is bounded by POSCORR, POSCORRMON, axis limits and
SafeOperation of the controller.

The module also adopts the present position as the programmed one.

It checks commands before a motion begins.

It records what one connection knows of contact and position.

Nothing is known at its beginning: if the program was started while the tool pressed, the position
of zero correction is on the surface.
"""

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import (
    UNWATCHED,
    Arming,
    ArmState,
    Cell,
    Clock,
    CollisionWatch,
    CommandChecks,
    Motion as MotionState,
    WrenchFeed,
)
from elastocal.drivers.kuka_rsi import motions
from elastocal.drivers.kuka_rsi.commissioning import AnswerRecorder
from elastocal.drivers.kuka_rsi.corrections import CorrectionGuard, as_millimetres
from elastocal.drivers.kuka_rsi.force_control import ForceLaw, ForceReader, overshoot
from elastocal.drivers.kuka_rsi.link import (
    AMISS,
    ANSWERS,
    EXACT,
    SURPRISES,
    Cycle,
    Motion,
    Pace,
    RsiLink,
    Step,
    guided,
)
from elastocal.drivers.kuka_rsi.messages import (
    Arrival,
    MoveTarget,
    Order,
    ProgramState,
    RobMessage,
    SenMessage,
)
from elastocal.drivers.kuka_rsi.motions import ContactGuard, LeavingGuard, Press
from elastocal.drivers.kuka_rsi.posture import PostureReader
from elastocal.drivers.kuka_rsi.settings import Bounds, RsiSettings, bounds_of
from elastocal.errors import DeviceError, present
from elastocal.robot import inverse_transform

ADOPTS = 5.0
"""Longest time that the controller may take to switch RSI off and on again, in s."""


def adopt(cycle: Cycle, number: int) -> Motion:
    """Yield the steps by which the controller takes the present position as programmed.

    It sends nothing while RSI is off. A program that does not know the order stays idle.

    Parameters
    ----------
    cycle : Cycle
        State at the beginning.
    number : int
        Number of the command.

    Raises
    ------
    DeviceError
        If the controller does not do it, or the arm is somewhere else after it.
    """
    ordered, before = cycle.time, cycle.T_base_tcp[:3, 3]
    taken = False
    while cycle.command != number:
        taken |= cycle.state == ProgramState.MOVING
        if not taken and cycle.time - ordered > ANSWERS:
            raise DeviceError(
                f"the arm stands {1e3 * float(np.linalg.norm(cycle.offset)):.1f} mm from the"
                " programmed place, which may be the surface, and the program on the controller"
                " cannot take the present place for it: move the arm off by the pendant, or load"
                " the new elcal_run (`elastocal krc-config`)"
            )
        if not cycle.time - ordered <= ADOPTS:
            raise DeviceError(f"the controller did not switch RSI off and on in {ADOPTS:g} s")
        cycle = yield Step(order=Order.ADOPT, target=MoveTarget(number))
    cycle = yield from guided(cycle)
    away = float(np.linalg.norm(cycle.T_base_tcp[:3, 3] - before))
    left = float(np.linalg.norm(cycle.offset))
    if not (away <= AMISS and left <= AMISS):
        raise DeviceError(
            f"RSI was switched off and on: the arm moved {1e3 * away:.2f} mm and has a correction"
            f" of {1e3 * left:.2f} mm, limit {1e3 * AMISS:g} mm"
        )


_WRIST = math.radians(5.0)
"""Least |A5| at which the tool is moved straight: near 0 axes 4 and 6 run away."""


class RsiChecks(CommandChecks):
    """Checks of commands, with those of corrections."""

    def require_programmed_place(self, offset: FloatArray) -> None:
        """Refuse a joint move on top of a correction, base, shape (3,), in m.

        Raises
        ------
        DeviceError
            With its length.
        """
        size = float(np.linalg.norm(offset))
        self.require(
            size <= AMISS,
            "move_joints: correction at its begin",
            f"{1e3 * size:.2f} mm",
            f"at most {1e3 * AMISS:g} mm (adopt_position)",
        )


SOURCE = "kuka_rsi"
CHECKS = RsiChecks(SOURCE)
SILENT = 0.25
"""Time without a message after which the arm counts as stopped, in s."""
OUT = (ProgramState.ABSENT, ProgramState.ENDED)
"""States of a program that is not in its loop."""


def require_ready(cycle: Cycle, silent: float, mode: str) -> None:
    """Refuse to enable an arm while a condition forbids it.

    A missing force does not forbid it, since the tool must be able to leave the surface without
    one.

    Parameters
    ----------
    cycle : Cycle
        The newest state.
    silent : float
        Its age, in s.
    mode : str
        Mode of the settings.

    Raises
    ------
    DeviceError
        With the condition that forbids it.
    """
    why = None
    if mode != "contact":
        why = f"mode {mode} moves nothing: devices.arm.mode must be contact"
    elif not silent <= SILENT:
        why = f"no message from the controller for {silent:.2f} s"
    elif cycle.state in OUT:
        why = "the program elcal_run on the controller is not in its loop: select and start it"
    if why is not None:
        raise DeviceError(f"{SOURCE} cannot be enabled: {why}")


@dataclass(frozen=True)
class StraightMoveRules:
    """Limits of straight moves."""

    bounds: Bounds
    law: ForceLaw
    delay: float
    """Time from force to standstill, in s."""

    def require_room(self, command: str, end: FloatArray, speed: float) -> None:
        """Refuse a move that leaves what corrections may do.

        Parameters
        ----------
        command : str
            Name of the command.
        end : ndarray, shape (3,)
            Correction at its end, base, in m.
        speed : float
            In m/s.
        """
        bounds, size = self.bounds, float(np.linalg.norm(end))
        CHECKS.require(
            size <= bounds.correction,
            f"{command}: correction at its end",
            f"{1e3 * size:.1f} mm",
            f"at most {1e3 * bounds.correction:g} mm (largest_correction)",
        )
        CHECKS.require(
            speed <= bounds.speed,
            f"{command} speed",
            f"{1e3 * speed:g} mm/s",
            f"at most {1e3 * bounds.speed:g} mm/s (correction_speed)",
        )

    def require_away(self, direction: FloatArray, approached: FloatArray | None) -> None:
        """Refuse a retract along a direction of an approach that felt a surface, both (3,)."""
        if approached is not None and not float(direction @ approached) < 0.0:
            raise DeviceError(
                f"{SOURCE}: retract direction {direction.tolist()} leads into the surface,"
                f" which was approached along {np.round(approached, 4).tolist()}"
            )

    def require_bent_wrist(self, q: FloatArray) -> None:
        """Refuse a move with axes 4 and 6 in line; joints of shape (joint,), A5 last but one."""
        bend = abs(math.remainder(float(q[-2]), math.pi))
        CHECKS.require(
            bend >= _WRIST,
            "A5",
            f"{math.degrees(bend):.1f} deg from straight",
            f"at least {math.degrees(_WRIST):g} deg for a straight move",
        )

    def require_gentle(self, speed: float, contact_force: float) -> None:
        """Refuse a guarded move that would press too hard before it stops."""
        if math.isinf(contact_force):
            return
        stiffness, room = self.law.stiffness, self.bounds.force - contact_force
        further = overshoot(speed, stiffness, self.delay)
        if not further <= room:
            allowed = max(room, 0.0) / (stiffness * self.delay)
            raise DeviceError(
                f"kuka_rsi refuses approach: at {1e3 * speed:.3g} mm/s it would press"
                f" {further:.0f} N beyond {contact_force:g} N before it stands (delay"
                f" {1e3 * self.delay:.0f} ms, stiffness {1e-6 * stiffness:.3g} N/um), force limit"
                f" {self.bounds.force:.0f} N: at most {1e3 * allowed:.2g} mm/s"
            )


_LET_GO = 0.3
"""Part of the contact force below which the tool has left the surface at the end of a retract."""
_SAME_ZERO = 1e-4
"""Largest distance of the programmed position from the end of the last ``PTP``, in m."""


class ContactMemory:
    """Remembers what was felt and where a joint move has ended."""

    def __init__(self) -> None:
        self.guard: ContactGuard | None = None
        """Guard that detected the present contact."""
        self.touched_at: FloatArray = np.zeros(3)
        """Correction there, base, shape (3,), in m."""
        self._is_free = False
        self._free_place: FloatArray | None = None

    @property
    def in_contact(self) -> bool | None:
        """Whether the tool touches; None: nothing has been felt or left."""
        return True if self.guard is not None else (False if self._is_free else None)

    def approached(self, guard: ContactGuard, cycle: Cycle) -> None:
        """Note how a guarded move ended."""
        self._is_free = not guard.felt
        if guard.felt:
            self.guard, self.touched_at = guard, cycle.offset

    def retracted(self, reader: ForceReader | None) -> None:
        """Note the end of a retract; without a force nothing is known then."""
        if self.guard is None or reader is None:
            return
        if reader.problem() is not None:
            self.guard, self._is_free = None, False
            return
        left = float(np.linalg.norm(reader.force_tcp))
        if left <= _LET_GO * self.guard.contact_force:
            self.guard, self._is_free = None, True

    def arrived(self, cycle: Cycle) -> None:
        """Note the end of a joint move, which nothing was felt on."""
        self._is_free, self._free_place = True, _programmed(cycle)

    def forget_place(self) -> None:
        """Note that the programmed place may become another one."""
        self._is_free, self._free_place = False, None

    def is_zero_free(self, cycle: Cycle) -> bool:
        """Return whether the place where the correction is zero is known to be free.

        A joint move of this connection has ended there. RSol is compared: a program that was
        restarted elsewhere gives itself away even where its start was not seen.
        """
        if self._free_place is None:
            return False
        return float(np.linalg.norm(_programmed(cycle) - self._free_place)) <= _SAME_ZERO


def _programmed(cycle: Cycle) -> FloatArray:
    """Return the programmed place, base, shape (3,), in m."""
    place: FloatArray = cycle.T_base_tcp[:3, 3] - cycle.offset
    return place


def feeling(
    cell: Cell, settings: RsiSettings, feed: WrenchFeed | None
) -> tuple[ForceReader | None, CollisionWatch | None]:
    """Return the force reader and the collision watch of an arm that presses, or none of them."""
    if settings.mode != "contact":
        return None, None
    T_sensor_tcp = cell.T_sensor_tcp
    if feed is None or T_sensor_tcp is None:
        raise DeviceError(
            f"{cell.path}: devices.arm: mode contact needs a force sensor whose driver"
            " feeds the arm (section sensor, and devices.sensor)"
        )
    reader = ForceReader(feed, inverse_transform(T_sensor_tcp), settings.cycle)
    weight = cell.file.tool.mass * cell.gravity_base
    return reader, CollisionWatch(weight, settings.collision_force)


_EDGE_AGAIN = 25
"""Cycles for which a program stays guided against its order before STOP rises again."""
_BRAKES = 1.0
"""Time within which a program takes a ``PTP`` back, in s; one that does not is answered no more,
and the controller stops by its ``Timeout``."""
_RESTING = (MotionState.DISARMED, MotionState.STOPPED)
_STANDING = (MotionState.IDLE,)
_FORCED = (MotionState.IDLE, MotionState.HOLDING, MotionState.RELEASING)
_AWAY = ("release", "retract")
"""Commands that lead away from the surface: allowed with a fault, and without a force."""
_TOWARD = (MotionState.APPROACHING, MotionState.HOLDING)
"""States in which the tool is pushed at a surface."""
_BY_FORCE = (MotionState.APPROACHING, MotionState.HOLDING, MotionState.RELEASING)
"""States that end in position control where they fail: from there the tool can be retracted."""


@dataclass(frozen=True, eq=False)
class _Task:
    """A command that is being carried out."""

    state: MotionState
    begin: Callable[[Cycle], Motion]
    done: Callable[[Cycle], None] | None = None
    silence: float = SILENT
    """Longest time without a message, in s."""


class KukaArm:
    """A KUKA arm whose controller runs ``elcal_run`` with RSI."""

    def __init__(
        self, cell: Cell, settings: RsiSettings, clock: Clock, feed: WrenchFeed | None
    ) -> None:
        """Take an arm with its drives off; call `step` with each message of the controller.

        Raises
        ------
        DeviceError
            If it is to press, and there is no force to press by.
        """
        self._cell, self._settings, self._clock = cell, settings, clock
        self.joint_names = cell.robot.joint_names
        self.bounds = bounds_of(cell, settings)
        delay = settings.motion_delay(cell)
        self._pace = Pace(settings.cycle, delay, settings.acceleration)
        stiffness, speed = settings.contact_stiffness, settings.force_speed
        self.law = ForceLaw.design(stiffness, delay, settings.cycle, speed)
        self._rules = StraightMoveRules(self.bounds, self.law, delay + 2.0 * settings.cycle)
        self._postures = PostureReader(cell.robot, settings.signs)
        self.guard = CorrectionGuard(self.bounds, settings.cycle, delay)
        """Bounds what is sent, and counts what the controller clamps."""
        self._reader, self._watch = feeling(cell, settings, feed)
        self._lock = threading.RLock()
        self._cycle: Cycle | None = None
        self._problem: str | None = None
        self._state = MotionState.DISARMED
        self._fault: str | None = None
        self._task: _Task | None = None
        self._running: Motion | None = None
        self._number = 0
        self._contact = ContactMemory()
        self._disobeyed = self._unbraked = 0
        self._watched_at = -math.inf
        """When the state was asked for last, or a command given."""
        self.link: RsiLink | None = None
        """Line to the controller; its failure is raised at the next call."""
        self.arming = Arming()
        """See `elastocal.cell.RealArm`."""

    def state(self) -> ArmState:
        """Return the newest state."""
        self._require_link()
        with self._lock:
            cycle = self._newest()
            self._watched_at = self._clock.now()
            silent = self._watched_at - cycle.time
            patience = SILENT if self._task is None else self._task.silence
            if silent > patience and self._state not in _RESTING:
                counts = "" if self.link is None else self.link.statistics().sentence()
                self._break_down(f"nothing from the controller for {silent:.2f} s; {counts}")
            return ArmState(
                time=cycle.time,
                q=cycle.q.copy(),
                T_base_tcp=cycle.T_base_tcp.copy(),
                motion=self._state,
                in_contact=self._contact.in_contact,
                fault=self._fault,
                source=SOURCE,
            )

    def enable(self) -> None:
        """Enable motion; the arm is then idle. Refused unarmed, or while a fault persists."""
        self.arming.require(self._cell)
        self._require_link()
        with self._lock:
            cycle = self._newest()
            require_ready(cycle, self._clock.now() - cycle.time, self._settings.mode)
        self._postures.require_model(cycle, self._settings.model_tolerance)  # link goes on
        with self._lock:
            self._fault = None
            if self._state in _RESTING:
                self._state = MotionState.IDLE
                self.guard.restart(cycle.offset)

    def disable(self) -> None:
        """Disable motion; the arm stands still."""
        with self._lock:
            self._drop(MotionState.DISARMED)

    def stop(self) -> None:
        """Stop at once: no correction from now on, and the channel of the STOP object."""
        with self._lock:
            if self._state is not MotionState.DISARMED:
                self._drop(MotionState.STOPPED)

    def move_joints(self, q: FloatArray, speed: float) -> None:
        """Start a joint move; see `RobotArm.move_joints`."""
        names, limits = self.joint_names, self._cell.robot.limits
        target = CHECKS.joint_move(q, speed, names, (limits.lower, limits.upper))
        with self._lock:
            self._allow("move_joints", _STANDING, in_contact=False)
            CHECKS.require_programmed_place(self._newest().offset)
            self._number += 1
            percent = min(max(1.0, 100.0 * speed), float(self._settings.ptp_percent))
            axes, external = self._postures.as_told(target)
            order = MoveTarget(self._number, axes, external, percent)
            self._contact.forget_place()
            motion = partial(motions.free_move, target=order, q=target)
            self._start(_Task(MotionState.MOVING, motion, self._contact.arrived))

    def adopt_position(self) -> None:
        """Leave no correction behind; see `RobotArm.adopt_position`.

        The correction is taken back where a joint move of this connection has ended at zero. Where
        zero may be the surface, the controller takes the present place for the programmed one.
        """
        with self._lock:
            self._allow("adopt_position", _STANDING, in_contact=False)
            cycle = self._newest()
            if float(np.linalg.norm(cycle.offset)) <= EXACT:
                return
            if self._contact.is_zero_free(cycle):
                limits = (self._settings.collision_force, self.bounds.force)
                guard = ContactGuard(self._sensed(), None, *limits)
                # As slow as an approach in which contact is expected, since the distance is short.
                speed = min(self.bounds.speed, self._cell.file.procedure.contact_speed)
                back = partial(motions.take_back, guard=guard, speed=speed, pace=self._pace)
                self._start(_Task(MotionState.MOVING, back))
            else:
                self._number += 1
                self._contact.forget_place()
                motion = partial(adopt, number=self._number)
                self._start(_Task(MotionState.MOVING, motion, silence=ADOPTS))
        while self.state().motion is MotionState.MOVING:
            self._clock.sleep(self._pace.cycle)
        if self._fault is not None:
            raise DeviceError(f"{SOURCE}: {self._fault}")

    def approach(
        self, direction_base: FloatArray, distance: float, speed: float, contact_force: float
    ) -> None:
        """Start a guarded straight move; see `RobotArm.approach`."""
        direction = CHECKS.line("approach", direction_base, distance, speed)
        CHECKS.require(contact_force > 0.0, "contact force", contact_force, "above 0 N")
        with self._lock:
            self._allow("approach", _STANDING, in_contact=False)
            way, cycle = distance * direction, self._newest()
            self._rules.require_room("approach", cycle.offset + way, speed)
            self._rules.require_bent_wrist(cycle.q)
            self._rules.require_gentle(speed, contact_force)
            guard = ContactGuard(self._sensed(), direction, contact_force, self.bounds.force)
            motion = partial(motions.approach, way=way, speed=speed, guard=guard, pace=self._pace)
            felt = partial(self._contact.approached, guard)
            self._start(_Task(MotionState.APPROACHING, motion, felt))

    def hold(self, force_tcp: FloatArray, rate: float) -> None:
        """Start to build up a force and hold it; see `RobotArm.hold`."""
        wanted = CHECKS.vector("force", force_tcp, 3)
        CHECKS.require(wanted[2] < 0.0, "force z", wanted[2], "below 0 N: the robot can only press")
        size, most = float(np.linalg.norm(wanted)), self.bounds.force
        CHECKS.require(size <= most, "force", size, f"at most {most:g} N, the force limit")
        CHECKS.require(0.0 < rate < math.inf, "force rate", rate, "above 0 N/s and finite")
        with self._lock:
            self._allow("hold", _FORCED, in_contact=True)
            motion = partial(motions.hold, press=self._press(wanted, rate), pace=self._pace)
            self._start(_Task(MotionState.HOLDING, motion))

    def release(self, rate: float) -> None:
        """Start to ramp the force to zero; see `RobotArm.release`."""
        CHECKS.require(0.0 < rate < math.inf, "force rate", rate, "above 0 N/s and finite")
        with self._lock:
            self._allow("release", _FORCED, in_contact=True)
            press, stiffness = self._press(np.zeros(3), rate), self._settings.contact_stiffness
            motion = partial(motions.release, press=press, pace=self._pace, stiffness=stiffness)
            self._start(_Task(MotionState.RELEASING, motion))

    def retract(self, direction_base: FloatArray, distance: float, speed: float) -> None:
        """Start a straight move away from the surface; see `RobotArm.retract`."""
        direction = CHECKS.line("retract", direction_base, distance, speed)
        with self._lock:
            self._allow("retract", _FORCED)
            touched = self._contact.guard
            if touched is not None:
                self._rules.require_away(direction, touched.direction)
            way = distance * direction
            self._rules.require_room("retract", self._newest().offset + way, speed)
            guard = None
            if self._reader is not None:
                limits = (self.bounds.force, self._settings.collision_force)
                guard = LeavingGuard.of(self._reader, *limits)
            motion = partial(motions.retract, way=way, speed=speed, pace=self._pace, guard=guard)
            left = partial(self._contact.retracted, self._reader)
            self._start(_Task(MotionState.RETRACTING, motion, lambda _: left()))

    def excite(self, places: FloatArray) -> AnswerRecorder:
        """Start to follow positions, shape (cycle, 3), base, in m, from the tool's present one.

        Returns
        -------
        AnswerRecorder
            Has command and answer along the places when it is over.
        """
        with self._lock:
            self._allow("excite", _STANDING, in_contact=False)
            recorder = AnswerRecorder(places, self._newest().offset, self._pace.cycle)
            motion = partial(motions.play, places=places, heard=recorder.hear)
            self._start(_Task(MotionState.MOVING, motion))
        return recorder

    def step(self, message: RobMessage, arrival: Arrival, now: float) -> SenMessage | None:
        """Return the answer to a message; see `elastocal.drivers.kuka_rsi.Handler`."""
        with self._lock:
            try:
                cycle = self._postures.read(message, now, self._settings.mode)
            except DeviceError as error:
                self._problem = str(error)
                self._break_down(str(error))
                return self._message(Step(order=Order.HOLD))
            self._cycle, self._problem = cycle, None
            if arrival in (Arrival.FIRST, Arrival.JUMPED):
                self._number = cycle.command
                self._contact.forget_place()
            if self._settings.mode == "measure":
                return None
            self._look(cycle, arrival)
            step = self._next(cycle)
            if self._rides_on(cycle, step):
                return None
            disobeys = step.order is not Order.GUIDE and cycle.state == ProgramState.GUIDED
            self._disobeyed = self._disobeyed + 1 if disobeys else 0
            return self._message(step)

    def _rides_on(self, cycle: Cycle, step: Step) -> bool:
        """Return whether a ``PTP`` goes on though the order to hold was given long ago."""
        rides = step.order is Order.HOLD and cycle.state == ProgramState.MOVING
        self._unbraked = self._unbraked + 1 if rides else 0
        if self._unbraked * self._pace.cycle <= _BRAKES:
            return False
        self._break_down(
            f"the program on the controller does not brake its PTP within {_BRAKES:g} s: it is"
            " answered no more, so that the controller stops by its Timeout"
        )
        return True

    def _next(self, cycle: Cycle) -> Step:
        """Return the next step of what is being carried out."""
        task = self._task
        if task is None:
            return Step(order=Order.HOLD if self._state in _RESTING else Order.GUIDE)
        try:
            if self._running is None:
                self.guard.restart(cycle.offset)
                self._running = task.begin(cycle)
                step = next(self._running)
            else:
                step = self._running.send(cycle)
            if cycle.state == ProgramState.GUIDED:
                self.guard.bounded(step.shift, cycle.offset)
            return step
        except StopIteration:
            self._task = self._running = None
            self._state = MotionState.IDLE
            if task.done is not None:
                task.done(cycle)
            return Step()
        except SURPRISES as error:
            fault = str(error) if isinstance(error, DeviceError) else repr(error)
            if self._state not in _BY_FORCE:
                self._break_down(fault)
                return Step(order=Order.HOLD)
            self._stand(fault)
            return Step()

    def _look(self, cycle: Cycle, arrival: Arrival) -> None:
        """Stop where the controller, or the force, says that something is wrong."""
        if self._reader is not None:
            self._reader.look(cycle.time)
        adopting = self._task is not None and self._task.silence > SILENT
        if self._state in _RESTING or adopting:
            return
        if arrival is Arrival.JUMPED:
            self._break_down("IPOC has jumped: the controller's program was started anew")
        elif cycle.state in OUT:
            self._break_down("the program elcal_run on the controller is not in its loop any more")
        elif self._state in _TOWARD and not cycle.time - self._watched_at <= UNWATCHED:
            self._stand(f"nobody has asked how the arm stands for {UNWATCHED:g} s")
        elif self._state is MotionState.MOVING and self._watch is not None:
            reader = self._sensed()
            if (blind := reader.problem()) is not None:
                self._break_down(f"{blind}: a collision would not be felt")
                return
            R_base_sensor = cycle.T_base_tcp[:3, :3] @ reader.R_tcp_sensor
            hit = self._watch.look(cycle.time, reader.raw, R_base_sensor)
            if hit is not None:
                self._break_down(f"collision: {hit}")

    def _message(self, step: Step) -> SenMessage:
        target = step.target or MoveTarget(self._number)
        shift = as_millimetres(step.shift)
        # The edge of STOP may have come before RSI_MOVECORR began: then it comes once more.
        again = self._disobeyed % _EDGE_AGAIN == _EDGE_AGAIN - 1
        return SenMessage(shift, step.order, target, self._settings.sentype, again)

    def _start(self, task: _Task) -> None:
        self._task, self._running, self._state = task, None, task.state
        self._watched_at = self._clock.now()
        if self._watch is not None:
            self._watch.restart()

    def _drop(self, state: MotionState) -> None:
        """Stop where the arm is."""
        self._task = self._running = None
        self._state = state

    def _stand(self, fault: str) -> None:
        """Leave force control for position control; from there the tool can be retracted."""
        self._fault = fault
        self._drop(MotionState.IDLE)

    def _break_down(self, fault: str) -> None:
        if self._state is not MotionState.DISARMED:
            self._fault = fault
            self._drop(MotionState.STOPPED)

    def _press(self, wanted: FloatArray, rate: float) -> Press:
        limits = (self._contact.touched_at, self.bounds.travel, self.bounds.force)
        return Press(self._sensed(), self.law, wanted, rate, *limits)

    def _sensed(self) -> ForceReader:
        return present(self._reader, "sensor of an arm that presses")

    def _require_link(self) -> None:
        if self.link is not None:
            self.link.require()

    def listens(self) -> bool:
        """Return whether the program on the controller takes orders."""
        return self._cycle is not None and self._cycle.state not in OUT

    def _newest(self) -> Cycle:
        if self._problem is not None:
            raise DeviceError(f"{SOURCE}: {self._problem}")
        if self._cycle is None:
            raise DeviceError(f"{SOURCE}: the controller has sent nothing yet")
        return self._cycle

    def _allow(
        self, command: str, states: tuple[MotionState, ...], *, in_contact: bool | None = None
    ) -> None:
        """Refuse a command that does not fit what the arm is doing."""
        if self._state not in states:
            allowed = ", ".join(state.value for state in states)
            raise DeviceError(
                f"{SOURCE} refuses {command}: it is {self._state.value} (allowed when {allowed})"
            )
        blind = None if self._reader is None else self._reader.problem(SILENT)
        why = self._fault or (None if command == "adopt_position" else blind)
        if why is not None and command not in _AWAY:
            raise DeviceError(f"{SOURCE} refuses {command}: {why}")
        touches = self._contact.guard is not None
        if in_contact is not None and in_contact is not touches:
            what = "only in contact" if in_contact else "not in contact: retract first"
            raise DeviceError(f"{SOURCE} refuses {command}: allowed {what}")
