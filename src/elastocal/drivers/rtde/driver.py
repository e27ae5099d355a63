"""The driver that cell files name ``rtde``: arm and sensor of a Universal Robots controller.

Each step of the procedure is one of the controller's commands. A slow approach and the load cases
are force mode: the controller itself stops at the contact force and holds the load. A faster
approach, which is to end before the surface, is a line that the controller ends at its distance; a
touch is seen and stopped here. The ramps of `RobotArm.hold` and `RobotArm.release` are made here, a
new force each cycle. All commands go out from one thread, which no caller waits for.
"""

import contextlib
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field, FiniteFloat

from elastocal.arrays import FloatArray
from elastocal.cell import (
    LOOPBACK,
    UNWATCHED,
    Arming,
    ArmState,
    Cell,
    Clock,
    CommandChecks,
    DevicePlace,
    DeviceSet,
    DeviceSettings,
    Motion,
    RigContext,
)
from elastocal.drivers.rtde._ur_rtde import UrControl, UrReceive, open_control, open_receive
from elastocal.drivers.rtde.line import UrLine, UrSample, UrSensor, pose_of_T
from elastocal.errors import DeviceError

_ZEROED = 0.05
"""Time after the order has been taken in which the sensor may still show its old zero, in s."""
_FELT = 0.8
"""Part of the contact force at which the approach has ended."""


@dataclass(frozen=True)
class Guard:
    """Conditions that end a guarded move."""

    direction: FloatArray
    distance: float
    force: float
    start: UrSample
    zeroed: float
    """When the controller had taken the force for zero, in s of the rig's clock."""

    def gone(self, now: UrSample) -> float:
        """Return the distance that the tool has moved, in m."""
        return float((now.T_base_tcp[:3, 3] - self.start.T_base_tcp[:3, 3]) @ self.direction)

    def felt(self, now: UrSample) -> bool:
        """Return whether the contact force is there; what came before the new zero is not asked."""
        fresh = now.time > self.zeroed + _ZEROED
        return fresh and float(-now.force_base @ self.direction) >= _FELT * self.force


def frame_along(direction: FloatArray, origin: FloatArray) -> FloatArray:
    """Return a frame whose z axis is a direction, shape (4, 4)."""
    side = np.eye(3)[int(np.argmin(np.abs(direction)))]
    x = np.cross(side, direction)
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.column_stack([x, np.cross(direction, x), direction])
    T[:3, 3] = origin
    return T


_SOURCE = "rtde"
_CHECKS = CommandChecks(_SOURCE)
_CYCLE = 0.01
"""Cycle of the thread, in s of the wall."""
_WATCHDOG = 1.0
"""Signs of life a second, in Hz, without which the controller ends its program: force mode would go
on when this program is killed, or its line is cut."""
_TOOL_ACCELERATION = 0.5
"""In m/s²."""
_STOP = 2.0
"""Deceleration of a stop, in rad/s²."""
_FORCE_MODE_SPEED = 0.008
"""Fastest approach by force mode, in m/s, whose end we have to see: 0.1 s of ours are 0.8 mm."""
_IN_FRAME = 2
"""Type of force mode: the task frame is not changed."""
_SIDEWAYS, _TURN = 0.01, 0.05
"""Largest motion of the other axes in force mode, in m and rad."""
_PRESS_SPEED = 0.02
"""Fastest motion along a force that is held, in m/s."""
_LAST_RESORT = 1.2
"""Part of the force limit beyond which the arm stops: whoever supervises it stops it before."""
_SETTLED = 5
"""Cycles that a motion must be said to be over: the controller's word comes a cycle late."""
_RESTING = (Motion.DISARMED, Motion.STOPPED)
_STANDING = (Motion.IDLE,)
_FORCED = (Motion.IDLE, Motion.HOLDING, Motion.RELEASING)
_TOWARD = (Motion.APPROACHING, Motion.HOLDING)
"""States in which the tool is pushed at a surface."""

_Step = Callable[[UrSample], Motion | None]
"""One cycle of a command: None while it goes on, else what the arm does after it."""


@dataclass(frozen=True)
class _Order:
    """Command on its way to the thread."""

    begin: Callable[[UrSample], _Step]
    motion: Motion


class UrArm:
    """A `RobotArm` by a controller that runs the program of ``ur-rtde``."""

    def __init__(
        self,
        line: UrLine,
        control: UrControl,
        clock: Clock,
        cell: Cell,
    ) -> None:
        """Take a controller whose line has a sample.

        Parameters
        ----------
        line, control : UrLine, UrControl
            Both halves of the connection.
        clock : Clock
            Clock of the rig.
        cell : Cell
            Cell of six joints, in the order of the controller.
        """
        self._line, self._control, self._clock = line, control, clock
        motion = cell.file.motion
        self._cell, self._names = cell, cell.robot.joint_names
        self._speeds, self._time = cell.axis_speeds / motion.override, motion.acceleration_time
        self.arming = Arming()
        """See `elastocal.cell.RealArm`."""
        self._lock = threading.RLock()
        self._motion = Motion.DISARMED
        self._touched: bool | None = None
        """None: no contact was detected or left since the connection."""
        self._touched_at = np.zeros(3)
        """Tool there, base, shape (3,), in m."""
        self._watched_at = -np.inf
        """When the state was asked for last, or a command given, in s of the wall."""
        self._into = np.zeros(3)
        """Direction of the last approach, base, shape (3,)."""
        self._forced = False
        self._fault: str | None = None
        self._order: _Order | None = None
        self._step: _Step | None = None
        self._force_tcp = np.zeros(3)
        """Force on the robot that is asked for now."""
        self._halt = False
        self._watched = False
        """Whether the program that runs ends without our signs of life."""
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints."""
        return self._names

    def state(self) -> ArmState:
        """Return the newest state; see `RobotArm.state`."""
        sample = self._line.sample()
        with self._lock:
            self._watched_at = time.monotonic()
            if self._fault is None and sample.fault is not None:
                self._fail(sample.fault)
            return ArmState(
                time=sample.time,
                q=sample.q,
                T_base_tcp=sample.T_base_tcp,
                motion=self._motion,
                in_contact=self._touched,
                fault=self._fault,
                source=_SOURCE,
            )

    def enable(self) -> None:
        """Release the arm; a program that has ended is loaded again, which takes seconds.

        Raises
        ------
        DeviceError
            If it is not armed, the controller is stopped, or the program does not start.
        """
        self.arming.require(self._cell)
        fault = self._line.sample().fault
        if fault is not None:
            raise DeviceError(f"{_SOURCE} cannot be enabled: {fault}")
        if not self._control.isProgramRunning() and not self._control.reuploadScript():
            raise DeviceError(f"{_SOURCE} cannot be enabled: its program does not start")
        with self._lock:
            self._fault, self._watched = None, False
            if self._motion in _RESTING:
                self._motion = Motion.IDLE

    def disable(self) -> None:
        """Take the release back."""
        self.stop()
        with self._lock:
            self._motion = Motion.DISARMED

    def stop(self) -> None:
        """Stop in the next cycle of the thread; always allowed."""
        with self._lock:
            if self._motion is not Motion.DISARMED:
                self._motion = Motion.STOPPED
            self._order = self._step = None
            self._halt = True

    def move_joints(self, q: FloatArray, speed: float) -> None:
        """Start a joint move; see `RobotArm.move_joints`."""
        limits = self._cell.robot.limits
        target = _CHECKS.joint_move(q, speed, self._names, (limits.lower, limits.upper))
        if self._touched:
            raise DeviceError(f"{_SOURCE} refuses move_joints: the tool is at the surface, retract")

        def begin(sample: UrSample) -> _Step:
            way = np.abs(target - sample.q)
            # The controller takes the speed of the joint that goes farthest.
            part = way / max(float(way.max()), 1e-9)
            leading = float((speed * self._speeds / np.maximum(part, 1e-3)).min())
            self._control.moveJ(target.tolist(), leading, leading / self._time, True)
            return self._arrival()

        self._give("move_joints", _Order(begin, Motion.MOVING), _STANDING)

    def adopt_position(self) -> None:
        """Do nothing: the controller has no corrections on top of the programmed position."""

    def approach(
        self, direction_base: FloatArray, distance: float, speed: float, contact_force: float
    ) -> None:
        """Start a guarded straight move; see `RobotArm.approach`."""
        direction = _CHECKS.line("approach", direction_base, distance, speed)
        _CHECKS.require(contact_force > 0.0, "contact force", contact_force, "above 0 N")
        if self._touched:
            raise DeviceError(f"{_SOURCE} refuses approach: in contact, retract first")

        def begin(sample: UrSample) -> _Step:
            self._into = direction
            if not np.isfinite(contact_force):
                return self._line_by(sample, distance * direction, speed)
            self._control.zeroFtSensor()
            goal = Guard(direction, distance, contact_force, sample, self._clock.now())
            guarded = self._pressed_way if speed <= _FORCE_MODE_SPEED else self._watched_way
            return guarded(goal, speed)

        self._give("approach", _Order(begin, Motion.APPROACHING), _STANDING)

    def hold(self, force_tcp: FloatArray, rate: float) -> None:
        """Start to build up a force and hold it; see `RobotArm.hold`."""
        wanted = _CHECKS.vector("force", force_tcp, 3)
        _CHECKS.require(
            wanted[2] < 0.0, "force z", wanted[2], "below 0 N: the robot can only press"
        )
        size, most = float(np.linalg.norm(wanted)), self._cell.force_limit
        _CHECKS.require(size <= most, "force", size, f"at most {most:g} N, the force limit")
        if not self._touched:
            raise DeviceError(f"{_SOURCE} refuses hold: allowed only in contact")
        self._give("hold", _Order(self._ramp_to(wanted, rate, None), Motion.HOLDING), _FORCED)

    def release(self, rate: float) -> None:
        """Start to ramp the force to zero; see `RobotArm.release`."""
        zero = np.zeros(3)
        order = _Order(self._ramp_to(zero, rate, Motion.IDLE), Motion.RELEASING)
        self._give("release", order, _FORCED)

    def retract(self, direction_base: FloatArray, distance: float, speed: float) -> None:
        """Start a straight move away from the surface; see `RobotArm.retract`."""
        direction = _CHECKS.line("retract", direction_base, distance, speed)
        if self._touched and not float(direction @ self._into) < 0.0:
            raise DeviceError(
                f"{_SOURCE} refuses retract: direction {direction.tolist()} leads into the surface"
            )
        way = distance * direction

        def begin(sample: UrSample) -> _Step:
            self._end_force()
            arrival = self._line_by(sample, way, speed)

            def step(now: UrSample) -> Motion | None:
                after = arrival(now)
                self._touched = self._touched and after is None
                return after

            return step

        self._give("retract", _Order(begin, Motion.RETRACTING), _FORCED)

    def close(self) -> None:
        """Stop, and end the program."""
        self.stop()
        self._closed.set()
        self._thread.join(5.0)
        # A controller that is gone needs neither.
        with contextlib.suppress(RuntimeError, OSError):
            self._control.stopScript()
            self._control.disconnect()

    def _give(self, command: str, order: _Order, states: tuple[Motion, ...]) -> None:
        with self._lock:
            if self._motion not in states:
                allowed = ", ".join(state.value for state in states)
                raise DeviceError(
                    f"{_SOURCE} refuses {command}: it is {self._motion.value} (allowed when"
                    f" {allowed})"
                )
            self._order, self._motion = order, order.motion
            self._watched_at = time.monotonic()

    # -- the thread ---------------------------------------------------------------------------

    def _work(self) -> None:
        while not self._closed.wait(_CYCLE):
            try:
                self._cycle()
            except (DeviceError, RuntimeError, OSError) as error:
                with self._lock:
                    self._fail(str(error))
        if self._halt:
            self._stop_now()

    def _cycle(self) -> None:
        with self._lock:
            halt, self._halt = self._halt, False
        if halt:
            # Before the line is asked: an arm that is not heard any more must stop as well. An
            # order that came after the stop waits for the next cycle.
            self._stop_now()
            return
        self._give_sign_of_life()
        sample = self._line.sample()
        self._require_well(sample)
        with self._lock:
            order, step, self._order = self._order, self._step, None
        if order is not None:
            step = order.begin(sample)
        after = None if step is None else step(sample)
        with self._lock:
            if self._halt or self._order is not None:
                return  # what came meanwhile counts
            self._step = step if after is None else None
            if after is not None:
                self._motion = after

    def _require_well(self, sample: UrSample) -> None:
        """Refuse to go on with a controller that is at fault, or with a push that went wrong.

        Raises
        ------
        DeviceError
            With what is wrong.
        """
        with self._lock:
            motion, watched_at = self._motion, self._watched_at
        if motion in _RESTING:
            return
        if sample.fault is not None:
            raise DeviceError(sample.fault)
        if motion in _TOWARD and not time.monotonic() - watched_at <= UNWATCHED:
            raise DeviceError(f"nobody has asked how the arm stands for {UNWATCHED:g} s")
        if not (self._forced and motion in _TOWARD):
            return
        size, most = float(np.linalg.norm(sample.force_base)), self._cell.force_limit
        if not size <= _LAST_RESORT * most:
            raise DeviceError(
                f"force limit exceeded: {size:.0f} N, limit {_LAST_RESORT * most:.0f} N"
            )
        limit = self._cell.file.procedure.travel_limit
        went = float(np.linalg.norm(sample.T_base_tcp[:3, 3] - self._touched_at))
        if self._touched and not went <= limit:
            raise DeviceError(
                f"the tool went {1e3 * went:.1f} mm from where it touched, limit {1e3 * limit:g} mm"
            )

    def _give_sign_of_life(self) -> None:
        if not self._control.isProgramRunning():
            if self._motion not in _RESTING:
                raise DeviceError("the program on the controller has ended")
        elif self._watched:
            self._control.kickWatchdog()
        else:
            # A watchdog goes with its program: each has its own.
            self._watched = self._control.setWatchdog(_WATCHDOG)

    def _stop_now(self) -> None:
        try:
            if self._control.isProgramRunning():
                try:
                    self._end_force()
                finally:
                    self._control.stopJ(_STOP, True)
            else:
                # The arm has stopped with its program, and force mode ended.
                self._forced, self._force_tcp = False, np.zeros(3)
        except (DeviceError, RuntimeError, OSError) as error:
            with self._lock:
                self._fail(str(error))
                # Until it is taken, and without a sign of life meanwhile.
                self._halt = True

    def _fail(self, fault: str) -> None:
        """Stop with a fault: the controller would go on with its last command."""
        self._halt = self._halt or self._motion not in _RESTING
        self._fault, self._motion = " ".join(fault.split()), Motion.STOPPED
        self._order = self._step = None

    def _pressed_way(self, goal: Guard, speed: float) -> _Step:
        """Return an approach in force mode: the controller stops at the force, we at the end."""
        frame = frame_along(goal.direction, goal.start.T_base_tcp[:3, 3])
        limits = [_SIDEWAYS, _SIDEWAYS, speed, _TURN, _TURN, _TURN]
        along = [0.0, 0.0, goal.force, 0.0, 0.0, 0.0]
        self._press(pose_of_T(frame), [0, 0, 1, 0, 0, 0], along, limits)

        def step(now: UrSample) -> Motion | None:
            felt = goal.felt(now)
            if not (felt or goal.gone(now) >= goal.distance):
                return None
            self._end_force()
            self._touched, self._touched_at = felt, now.T_base_tcp[:3, 3]
            return Motion.IDLE

        return step

    def _watched_way(self, goal: Guard, speed: float) -> _Step:
        """Return an approach along a line: the controller stops at the end, we at the force."""
        arrival = self._line_by(goal.start, goal.distance * goal.direction, speed)

        def step(now: UrSample) -> Motion | None:
            if not goal.felt(now):
                return arrival(now)
            self._control.stopJ(_STOP, True)
            self._touched, self._touched_at = True, now.T_base_tcp[:3, 3]
            return Motion.IDLE

        return step

    def _arrival(self) -> _Step:
        still = 0

        def step(_: UrSample) -> Motion | None:
            nonlocal still
            running = self._control.getAsyncOperationProgressEx().isAsyncOperationRunning()
            still = 0 if running else still + 1
            return Motion.IDLE if still >= _SETTLED else None

        return step

    def _line_by(self, sample: UrSample, way: FloatArray, speed: float) -> _Step:
        T = sample.T_base_tcp.copy()
        T[:3, 3] += way
        self._control.moveL(pose_of_T(T), speed, _TOOL_ACCELERATION, True)
        return self._arrival()

    def _ramp_to(
        self, wanted: FloatArray, rate: float, after: Motion | None
    ) -> Callable[[UrSample], _Step]:
        """Return the lines that ramp the force; ``after``: what follows them, None: it is held."""
        _CHECKS.require(0.0 < rate < np.inf, "force rate", rate, "above 0 N/s and finite")

        def begin(sample: UrSample) -> _Step:
            frame, last = pose_of_T(sample.T_base_tcp), self._clock.now()
            limits = [_PRESS_SPEED] * 3 + [_TURN] * 3

            def step(_: UrSample) -> Motion | None:
                nonlocal last
                now = self._clock.now()
                gap, most = wanted - self._force_tcp, rate * (now - last)
                size, last = float(np.linalg.norm(gap)), now
                if size <= most and after is not None:
                    self._end_force()
                    return after
                if size > 0.0:
                    self._force_tcp = self._force_tcp + gap * min(1.0, most / size)
                    # What the robot applies is against what it feels.
                    applied = [*(-self._force_tcp).tolist(), 0.0, 0.0, 0.0]
                    self._press(frame, [1, 1, 1, 0, 0, 0], applied, limits)
                return None

            return step

        return begin

    def _press(
        self, frame: list[float], selection: list[int], wrench: list[float], limits: list[float]
    ) -> None:
        self._forced = True
        if not self._control.forceMode(frame, selection, wrench, _IN_FRAME, limits):
            raise DeviceError("the controller refuses force mode")

    def _end_force(self) -> None:
        self._force_tcp = np.zeros(3)
        if self._forced:
            if not self._control.forceModeStop():
                raise DeviceError("the controller does not end its force mode")
            self._forced = False


_PORT = 30004
"""Port by which a controller is identified, of those that it answers on."""
_CONTROL_RATE = 500.0
"""Rate of the commanding half, in Hz; controllers of version 5 take it."""
_FAR_OFF = 0.02
"""Largest distance of the controller's tcp from the model's, in m: nominal and calibrated arms
differ."""


class RtdeSettings(DeviceSettings):
    """Settings of an arm or a sensor whose driver is ``rtde``."""

    address: str = LOOPBACK
    """Address of the controller, which has its ports fixed: 30004, 30003, 29999."""
    rate: Annotated[FiniteFloat, Field(ge=10.0, le=500.0)] = 125.0
    """Samples a second."""

    def device_places(self) -> tuple[DevicePlace, ...]:
        """Return the address of the controller."""
        return (DevicePlace(self.address, _PORT),)


class RtdeDriver:
    """Arms of Universal Robots, and their own force/torque sensors.

    Parameters
    ----------
    receive, control : callable, optional
        Open the two halves of a connection; by default those of ``ur-rtde``.
    """

    kinds = frozenset({"arm", "sensor"})
    real = True

    def __init__(
        self,
        receive: Callable[[str, float], UrReceive] = open_receive,
        control: Callable[[str, float], UrControl] = open_control,
    ) -> None:
        self._open_receive, self._open_control = receive, control

    def settings(self, kind: str) -> type[DeviceSettings]:  # noqa: ARG002 - one for both
        """Return the settings; see `elastocal.cell.Driver`."""
        return RtdeSettings

    def connect(
        self, cell: Cell, wanted: Mapping[str, DeviceSettings], context: RigContext
    ) -> DeviceSet:
        """Connect to the controller; see `elastocal.cell.Driver.connect`."""
        chosen = [each for each in wanted.values() if isinstance(each, RtdeSettings)]
        settings = chosen[0]
        if any(each.address != settings.address for each in chosen):
            raise DeviceError("rtde: arm and sensor must be of one controller (key 'address')")
        if cell.robot.external_axes or len(cell.robot.joint_names) != 6:
            raise DeviceError(f"rtde knows six joints, {cell.robot.name} has others")
        rate = max(each.rate for each in chosen)
        line = UrLine(self._open_receive(settings.address, rate), context.clock, rate)
        try:
            line.start()
            if context.watches:
                return DeviceSet(close=line.close, readings=lambda: line.readings(wanted))
            arm = self._arm(cell, line, settings, context) if "arm" in wanted else None
        except DeviceError:
            line.close()
            raise

        def close() -> None:
            if arm is not None:
                arm.close()
            line.close()

        sensor = None
        if "sensor" in wanted:
            if cell.file.sensor is None:
                raise DeviceError(f"cell {cell.name} describes no sensor (key 'sensor')")
            sensor = UrSensor(line, cell.file.sensor.force_range)
        feed = line if sensor is not None else None
        return DeviceSet(arm=arm, sensor=sensor, feed=feed, close=close, lines=line.lines)

    def _arm(self, cell: Cell, line: UrLine, settings: RtdeSettings, context: RigContext) -> UrArm:
        control = self._open_control(settings.address, _CONTROL_RATE)
        try:
            control.setTcp(pose_of_T(cell.T_flange_tcp))
            control.setPayload(cell.file.tool.mass, cell.file.tool.centre_of_mass)
            _require_same_tcp(cell, line)
        except DeviceError:
            control.stopScript()
            control.disconnect()
            raise
        return UrArm(line, control, context.clock, cell)


def _require_same_tcp(cell: Cell, line: UrLine) -> None:
    """Refuse a controller whose tcp is elsewhere than the model has it."""
    sample = line.sample()
    gap = cell.robot.forward(sample.q)[:3, 3] - sample.T_base_tcp[:3, 3]
    off = float(np.linalg.norm(gap))
    if not off <= _FAR_OFF:
        raise DeviceError(
            f"rtde: the controller's tcp is {1e3 * off:.1f} mm from the model's at the same joints"
            f" (allowed {1e3 * _FAR_OFF:.0f} mm): is it this arm, and this tool?"
        )


DRIVER = RtdeDriver()
"""The driver that cell files name; see `RtdeDriver`."""
