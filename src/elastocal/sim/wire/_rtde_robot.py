"""A Universal Robots controller of the simulated cell: registers, control script, force mode.

The program that clients upload is not interpreted: what is known of the one of ``ur_rtde`` is its
register protocol (a command in the first integer register, its arguments in others, 1 for ready
and 2 for done in the first output register), and `UrRobot` carries its commands out with the
simulated arm. The arm does the force control itself, as a real controller does.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.cell import Motion
from elastocal.errors import DeviceError
from elastocal.sim.wire._rtde_protocol import Value
from elastocal.sim.wire.live_cell import LiveCell

_READY, _DONE = 1, 2
_RUNNING_BIT = 1 << 15
_FORCE_RATE = 2000.0
"""Fastest change of the force of force mode, in N/s: the controller takes a new value at once."""
_FAR = 0.2
"""How far force mode goes in free space, in m."""
_STEP_TIME = 0.002
_POLYSCOPE = (5, 11, 1, 108318)
_ROBOT_RUNNING, _SAFETY_NORMAL, _PROTECTIVE_STOP = 7, 1, 3
_PROGRAM_STOPPED, _PROGRAM_PLAYING = 1, 2
_SETTINGS = ("set_tcp", "set_payload", "set_payload_cog", "set_gravity")
_LINES = ("movej", "stopj", "stopl", "textmsg", *_SETTINGS)
"""Of URScript, what is carried out as a single line."""
_LINE_SPEED = 1.05
"""Of ``movej`` without one, in rad/s."""


@dataclass
class _Registers:
    """Input and output registers of one kind each."""

    inputs: dict[str, Value] = field(default_factory=dict)
    outputs: dict[str, Value] = field(default_factory=dict)


class UrRobot:
    """The controller: what its registers say, and what its program does with the arm."""

    version = _POLYSCOPE
    """PolyScope: major, minor, bugfix, build."""

    def __init__(self, live: LiveCell) -> None:
        self._live, self._arm = live, live.arm()
        limits = live.cell.robot.limits
        self._speeds = np.where(np.isfinite(limits.velocity), limits.velocity, np.pi)
        self._registers = _Registers()
        self.program = ""
        """Name of the program that runs; empty: none."""
        self.unserved: set[int] = set()
        """Commands of the program that came and are not simulated."""
        self._offset = 0
        self._executing = self._by_line = False
        self._waits_for: Callable[[], bool] | None = None
        self._finishes: Callable[[], bool] | None = None
        self._operations = self._writes = 0
        self._last_force: tuple[float, ...] = ()
        self._force_mode = False
        self._zero = np.zeros(6)
        self._offset_tcp = _pose_of(_T_flange_tcp(live))
        self._commands: Mapping[int, Callable[[], None]] = {
            1: self._move_joints,
            3: self._move_straight,
            6: self._press,
            7: self._end_force,
            8: self._zero_sensor,
            26: self._tell_step_time,
            33: self._stop,
            34: self._stop,
            40: self._tell_tcp,
            43: self._tell_pose,
            47: self._tell_steady,
            **dict.fromkeys((15, 16, 17, 20, 21, 24, 29, 35, 59, 65), _nothing),
            **dict.fromkeys((36, 37), lambda: self._put_int(1, 1)),
        }

    # -- what clients see ---------------------------------------------------------------------

    def take(self, values: Mapping[str, Value]) -> None:
        """Write input registers."""
        self._registers.inputs.update(values)

    def run(self, script: str) -> str:
        """Run a script: a program, or single lines; return what they show.

        Of single lines, ``movej`` of joints and ``stopj``, ``stopl`` move the arm, ``textmsg``
        shows its text, and `_SETTINGS` are taken without effect.

        Raises
        ------
        DeviceError
            If a line is not simulated, or the arm refuses it.
        """
        if re.search(r"^\s*(def|sec) \w+\(", script, re.MULTILINE):
            self.load(script)
            return ""
        shown = [self._run_line(line.strip()) for line in script.splitlines() if line.strip()]
        return " ".join(text for text in shown if text)

    def _run_line(self, line: str) -> str:
        match = re.fullmatch(r"(\w+)\s*\((.*)\)", line)
        name, given = (match[1], match[2]) if match else (line, "")
        if name == "movej":
            self._move_by_line(given)
        elif name in ("stopj", "stopl"):
            self.program = ""
            self._stop()
        elif name == "textmsg":
            return given.strip("\"' ")
        elif name not in _SETTINGS:
            raise DeviceError(f"{name[:40]} is not simulated: must be one of {', '.join(_LINES)}")
        return ""

    def _move_by_line(self, given: str) -> None:
        match = re.match(r"\s*\[([^\]]*)\](.*)", given)
        named = re.search(r"\bv\s*=\s*([\d.eE+-]+)", match[2]) if match else None
        try:
            q = [float(each) for each in match[1].split(",")] if match else []
            speed = float(named[1]) if named else _LINE_SPEED
        except ValueError:
            q, speed = [], 0.0
        if len(q) != 6 or not speed > 0.0:
            raise DeviceError(f"movej({given[:60]}): must be a list of six joints, and v above 0")
        self.load("def movej():\nend")
        try:
            self._arm.move_joints(np.array(q), float(np.clip(speed / self._speeds.max(), 1e-3, 1)))
        except DeviceError:
            self.program = ""
            raise
        self._by_line = True

    def load(self, script: str) -> None:
        """Start a program that came over the script interface, in place of the one that ran."""
        self._by_line = False
        match = re.search(r"^def (\w+)\(", script, re.MULTILINE)
        offset = re.search(r"reg_offset_int = (\d+)", script)
        self._offset = int(offset[1]) if offset else 0
        self.program = match[1] if match else "unnamed"
        self._executing, self._waits_for, self._finishes = False, None, None
        self._registers.inputs.clear()
        self._set_progress(False)
        if self._arm.state().motion in (Motion.DISARMED, Motion.STOPPED):
            self._arm.enable()

    def unload(self) -> None:
        """End the program; the arm stops."""
        if self.program:
            self.program = ""
            self._arm.stop()

    def outputs(self) -> dict[str, Value]:
        """Return the variables as they are now, by name."""
        state, wrench = self._arm.state(), self._live.wrench()
        raw = np.zeros(6) if wrench is None else np.concatenate([wrench.force, wrench.moment])
        R = state.T_base_tcp[:3, :3] @ _T_flange_tcp(self._live)[:3, :3].T
        felt = np.concatenate([R @ part for part in np.split(raw - self._zero, 2)])
        stopped = state.fault is not None
        if stopped:
            self.program = ""
        running = bool(self.program)
        q, pose = state.q.tolist(), _pose_of(state.T_base_tcp)
        return {
            "timestamp": state.time,
            "target_q": q,
            "actual_q": q,
            "actual_TCP_pose": pose,
            "target_TCP_pose": pose,
            "actual_TCP_force": felt.tolist(),
            "ft_raw_wrench": raw.tolist(),
            "tcp_offset": self._offset_tcp,
            "robot_mode": _ROBOT_RUNNING,
            "joint_mode": [253] * 6,
            "safety_mode": _PROTECTIVE_STOP if stopped else _SAFETY_NORMAL,
            "safety_status_bits": 1 << 2 if stopped else 1,
            "robot_status_bits": 1 | (2 if running else 0),
            "runtime_state": _PROGRAM_PLAYING if running else _PROGRAM_STOPPED,
            "speed_scaling": 1.0,
            "target_speed_fraction": 1.0,
            **self._registers.outputs,
        }

    # -- the loop of the program --------------------------------------------------------------

    def cycle(self) -> None:
        """Do what the program does in one cycle of the controller."""
        if not self.program:
            return
        if self._by_line:
            self.program = "" if self._idle() else self.program
            return
        if self._finishes is not None and self._finishes():
            self._finishes = None
            self._set_progress(False)
        if self._waits_for is not None:
            if self._waits_for():
                self._waits_for = None
                self._put_int(0, _DONE)
            return
        command = int(self._int(0))
        if command in (24, 11, 9, 10, 6, 25, 26, 27, 38, 58, *range(66, 72)):
            self._obey(command)
            self._put_int(0, _READY)
        elif command == 0:
            self._executing = False
            self._put_int(0, _READY)
        elif not self._executing:
            self._executing = True
            self._obey(command)
            if self._waits_for is None:
                self._put_int(0, _DONE)

    def _obey(self, command: int) -> None:
        if command == 255:
            self.unload()
            return
        try:
            self._commands[command]()
        except KeyError:
            self.unserved.add(command)
        except DeviceError:
            # What the arm refuses, a controller answers with a protective stop.
            self.unload()

    # -- commands -----------------------------------------------------------------------------

    def _move_joints(self) -> None:
        q, speed = np.array(self._six(0)), self._double(6)
        part = float(np.clip(speed / self._speeds.max(), 1e-3, 1.0))
        self._arm.move_joints(q, part)
        self._run(self._idle)

    def _move_straight(self) -> None:
        T, target = self._arm.state().T_base_tcp, _T_of(self._six(0))
        way = target[:3, 3] - T[:3, 3]
        distance = float(np.linalg.norm(way))
        if distance > 1e-6:
            back = self._arm.state().in_contact
            if back:
                self._arm.retract(way / distance, distance, self._double(6))
            else:
                self._arm.approach(way / distance, distance, self._double(6), np.inf)
        self._run(self._idle)

    def _press(self) -> None:
        """Begin or change force mode: in free space towards the surface, in contact with a force.

        The wrench is what the robot applies, in the task frame; the arm's is what it feels.
        """
        values = (*self._six(0), *self._six(6), *self._six(12))
        if self._force_mode and values == self._last_force:
            return
        self._last_force, state = values, self._arm.state()
        applied = _T_of(self._six(0))[:3, :3] @ np.array(self._six(6)[:3])
        size = float(np.linalg.norm(applied))
        # Contact ends with a retract alone; a contact that was lost in force mode is the arm's.
        if state.in_contact or state.motion in (Motion.HOLDING, Motion.RELEASING):
            self._force_mode = True
            felt = -state.T_base_tcp[:3, :3].T @ applied
            if felt[2] < 0.0:
                self._arm.hold(felt, _FORCE_RATE)
            elif state.motion is Motion.HOLDING:
                self._arm.release(_FORCE_RATE)
        elif size > 0.0 and not self._force_mode:
            self._force_mode = True
            speed = max(self._six(12)[:3])
            self._arm.approach(applied / size, _FAR, speed, size)

    def _end_force(self) -> None:
        self._force_mode = False
        motion = self._arm.state().motion
        if motion is Motion.HOLDING:
            self._arm.release(_FORCE_RATE)
        elif motion is Motion.APPROACHING:
            self._stop()
        self._waits_for = self._idle

    def _stop(self) -> None:
        self._force_mode = False
        if self._finishes is not None:
            self._finishes = None
            self._set_progress(False)
        if not self._idle():
            self._arm.stop()
            self._arm.enable()

    def _zero_sensor(self) -> None:
        wrench = self._live.wrench()
        if wrench is not None:
            self._zero = np.concatenate([wrench.force, wrench.moment])

    def _tell_step_time(self) -> None:
        self._put_double(0, _STEP_TIME)

    def _tell_tcp(self) -> None:
        self._put_six(self._offset_tcp)

    def _tell_pose(self) -> None:
        self._put_six(_pose_of(self._arm.state().T_base_tcp))

    def _tell_steady(self) -> None:
        self._put_int(1, int(self._idle()))

    def _idle(self) -> bool:
        return self._arm.state().motion in (Motion.IDLE, Motion.STOPPED)

    def _run(self, until: Callable[[], bool]) -> None:
        """Wait for a motion, or note that it runs while the program goes on."""
        if self._int(1) == 1:
            self._operations += 1
            self._finishes = until
            self._set_progress(True)
        else:
            self._waits_for = until

    def _set_progress(self, running: bool) -> None:
        self._writes = (self._writes + 1) % 128
        value = (self._writes << 16) | ((self._operations % 128) << 24)
        self._put_int(2, value | (_RUNNING_BIT if running else 0))

    # -- registers ----------------------------------------------------------------------------

    def _int(self, number: int) -> float:
        return self._input(f"input_int_register_{number + self._offset}")

    def _double(self, number: int) -> float:
        return self._input(f"input_double_register_{number + self._offset}")

    def _input(self, name: str) -> float:
        value = self._registers.inputs.get(name, 0.0)
        return float(value) if isinstance(value, int | float) else 0.0

    def _six(self, first: int) -> list[float]:
        return [self._double(first + number) for number in range(6)]

    def _put_int(self, number: int, value: int) -> None:
        self._registers.outputs[f"output_int_register_{number + self._offset}"] = value

    def _put_double(self, number: int, value: float) -> None:
        self._registers.outputs[f"output_double_register_{number + self._offset}"] = value

    def _put_six(self, values: list[float]) -> None:
        for number, value in enumerate(values):
            self._put_double(number, value)


def _nothing() -> None:
    """Take a setting that changes nothing here."""


def _T_flange_tcp(live: LiveCell) -> FloatArray:
    T: FloatArray = live.cell.T_flange_tcp
    return T


def _pose_of(T: FloatArray) -> list[float]:
    """Return x, y, z in m and the rotation vector in rad."""
    return [*T[:3, 3].tolist(), *Rotation.from_matrix(T[:3, :3]).as_rotvec().tolist()]


def _T_of(pose: list[float]) -> FloatArray:
    T = np.eye(4)
    T[:3, 3], T[:3, :3] = pose[:3], Rotation.from_rotvec(pose[3:]).as_matrix()
    return T
