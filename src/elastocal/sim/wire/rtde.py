"""A Universal Robots controller on the wire: RTDE, primary, secondary, script, dashboard.

Served of RTDE (protocol versions 1 and 2): recipes of outputs and inputs, registers, start and
pause, up to 500 Hz. Of the primary and secondary port: the state of the robot ten times a second,
the message of the version, and scripts. Of a script: a program is taken and its name noted, not
interpreted, and the register protocol of ``ur_rtde``'s program is carried out as far as `UrRobot`
says; of single lines those that `UrRobot.run` knows are carried out, others are refused by a
message. Of the dashboard: what that client asks for.

Verified against ``ur_rtde``, ``urx``, the RTDE client of Universal Robots and public descriptions,
not against a controller.

A Universal Robots controller of the simulated cell: registers, control script, force mode.

The program that clients upload is not interpreted: what is known of the one of ``ur_rtde`` is its
register protocol (a command in the first integer register, its arguments in others, 1 for ready
and 2 for done in the first output register), and `UrRobot` carries its commands out with the
simulated arm. The arm does the force control itself, as a real controller does.

What the primary and secondary port of a Universal Robots controller send: states and messages.

Every package is ``int32 size, uint8 type`` and a payload, big-endian; a robot state (16) holds
sub-packages of the same form. Written from public clients (UniversalRobots/
Universal_Robots_Client_Library and SintefManufacturing/python-urx): robot mode, joints, tool,
master board, Cartesian info. Not sent: kinematics, configuration, force mode, additional info.
"""

import contextlib
import math
import re
import select
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.cell import LOOPBACK, Motion
from elastocal.errors import DeviceError
from elastocal.robot import Robot
from elastocal.sim.wire._rtde_protocol import (
    INPUT_TYPES,
    OUTPUT_TYPES,
    VERSIONS,
    MessageReader,
    Recipe,
    Value,
    message,
    text_message,
)
from elastocal.sim.wire.live_cell import LiveCell
from elastocal.sim.wire.servers import Told, bound, serves

_READY, _DONE = 1, 2
_RUNNING_BIT = 1 << 15
_FORCE_RATE = 2000.0
"""Fastest change of the force of force mode, in N/s: the controller takes a new value at once."""
_FAR = 0.2
"""Distance of force mode in free space, in m."""
_STEP_TIME = 0.002
_POLYSCOPE = (5, 11, 1, 108318)
_ROBOT_RUNNING, _SAFETY_NORMAL, _PROTECTIVE_STOP = 7, 1, 3
_PROGRAM_STOPPED, _PROGRAM_PLAYING = 1, 2
_SETTINGS = ("set_tcp", "set_payload", "set_payload_cog", "set_gravity")
_LINES = ("movej", "stopj", "stopl", "textmsg", *_SETTINGS)
"""Commands of URScript, what is carried out as a single line."""
_LINE_SPEED = 1.05
"""Speed of ``movej`` without one, in rad/s."""


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
        self._heard, self._silence = time.monotonic(), math.inf
        """When registers were written last, and how long without ends the program, in s of the
        wall, as the line is."""
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
            **dict.fromkeys((15, 16, 17, 20, 21, 24, 29, 59, 65), _nothing),
            35: self._watch,
            **dict.fromkeys((36, 37), lambda: self._put_int(1, 1)),
        }

    # -- what clients see ---------------------------------------------------------------------

    def take(self, values: Mapping[str, Value]) -> None:
        """Write input registers."""
        self._heard = time.monotonic()
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
        self._silence = math.inf
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
        """Run the program for one cycle of the controller."""
        self._look_at_watchdog()
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

    def _look_at_watchdog(self) -> None:
        if time.monotonic() - self._heard > self._silence:
            self.unload()

    def _watch(self) -> None:
        frequency = self._double(0)
        self._silence = 1.0 / frequency if frequency > 0.0 else math.inf

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


_HEADER = struct.Struct(">iB")
_STATE, _MESSAGE = 16, 20
_TEXT, _VERSION, _EXCEPTION = 0, 3, 10
_MODE, _JOINTS, _TOOL, _BOARD, _CARTESIAN = 0, 1, 2, 3, 4
_MODE_LAYOUT = struct.Struct(">Q7?BB3dB")
_JOINT_LAYOUT = struct.Struct(">3d4fB")
_TOOL_LAYOUT = struct.Struct(">BBddfBffB")
_BOARD_LAYOUT = struct.Struct(">iiBBddbbdd4fB??IB?B")
_CARTESIAN_LAYOUT = struct.Struct(">12d")
_PLAYING = 2
_VOLTS, _CELSIUS = 48.0, 25.0


def robot_state(values: Mapping[str, Value]) -> bytes:
    """Return the state of a controller whose RTDE outputs are given, by name."""
    stopped = values["safety_mode"] == _PROTECTIVE_STOP
    running = values["runtime_state"] == _PLAYING
    mode = _MODE_LAYOUT.pack(
        *(_microseconds(values), True, True, True, False, stopped, running, False),
        *(int(_number(values, "robot_mode")), 0, 1.0, _number(values, "speed_scaling"), 1.0, 0),
    )
    names = ("actual_q", "target_q", "joint_mode")
    joints = b"".join(
        _JOINT_LAYOUT.pack(q, target, 0.0, 0.0, _VOLTS, _CELSIUS, _CELSIUS, int(own))
        for q, target, own in zip(*(_vector(values, name) for name in names), strict=True)
    )
    tool = _TOOL_LAYOUT.pack(0, 0, 0.0, 0.0, _VOLTS, 0, 0.0, _CELSIUS, 253)
    board = _BOARD_LAYOUT.pack(
        *(0, 0, 0, 0, 0.0, 0.0, 0, 0, 0.0, 0.0, _CELSIUS, _VOLTS, 0.0, 0.0),
        *(int(_number(values, "safety_mode")), False, False, 0, 0, False, 0),
    )
    cartesian = _CARTESIAN_LAYOUT.pack(
        *_vector(values, "actual_TCP_pose"), *_vector(values, "tcp_offset")
    )
    kinds = (_MODE, _JOINTS, _TOOL, _BOARD, _CARTESIAN)
    parts = zip(kinds, (mode, joints, tool, board, cartesian), strict=True)
    return _package(_STATE, b"".join(_package(kind, part) for kind, part in parts))


def version_message(values: Mapping[str, Value], version: Sequence[int]) -> bytes:
    """Return the message that greets a client: the version of PolyScope."""
    name, (major, minor, bugfix, build) = b"URControl", version
    text = struct.pack(">B", len(name)) + name
    text += struct.pack(">BBii", major, minor, bugfix, build) + b"10-12-2021, 00:00:00"
    return _message(values, _VERSION, text)


def shown_text(values: Mapping[str, Value], text: str) -> bytes:
    """Return the text that a program shows by ``textmsg``."""
    return _message(values, _TEXT, text.encode("latin-1", "replace"))


def exception_message(values: Mapping[str, Value], text: str) -> bytes:
    """Return why a script was refused: the exception in its first line."""
    return _message(
        values, _EXCEPTION, struct.pack(">ii", 1, 1) + text.encode("latin-1", "replace")
    )


def _package(kind: int, payload: bytes) -> bytes:
    return _HEADER.pack(_HEADER.size + len(payload), kind) + payload


def _message(values: Mapping[str, Value], kind: int, payload: bytes) -> bytes:
    # 254 says that the message comes from the controller itself.
    return _package(_MESSAGE, struct.pack(">QBB", _microseconds(values), 254, kind) + payload)


def _microseconds(values: Mapping[str, Value]) -> int:
    return int(1e6 * _number(values, "timestamp"))


def _number(values: Mapping[str, Value], name: str) -> float:
    value = values[name]
    return value if isinstance(value, int | float) else value[0]


def _vector(values: Mapping[str, Value], name: str) -> Sequence[float]:
    value = values[name]
    return value if isinstance(value, Sequence) else (value,)


PORTS = {
    "rtde": 30004,
    "script": 30003,
    "dashboard": 29999,
    "primary": 30001,
    "secondary": 30002,
}
"""Ports of a controller, which its clients presuppose."""
_MOST_RATE, _LEAST_RATE = 500.0, 1.0
_RATE = 125.0
"""Rate of outputs in version 1 of RTDE, in Hz; the least that clients of version 2 take for
granted."""
_MOST_CLIENTS = 8
_CYCLE = 0.002
"""Cycle of the controller, in s of the wall."""
_STATE_CYCLE = 0.1
"""Cycle of the primary and secondary port, in s of the wall."""
_LISTEN = 0.05
_MOST_SCRIPT = 1 << 20
_QUIET = 0.05
"""A script that says no more for so long is complete, in s of the wall."""


def _takes(robot: Robot) -> bool:
    return not robot.external_axes and len(robot.joint_names) == 6


class RtdeServer:
    """A controller on all its ports of one address."""

    def __init__(
        self, live: LiveCell, ports: Mapping[str, int] = PORTS, *, address: str = LOOPBACK
    ) -> None:
        """Take the ports; 0: any that is free.

        Raises
        ------
        DeviceError
            If the arm has external axes or not six joints, or a port is taken.
        """
        robot = live.cell.robot
        if not _takes(robot):
            raise DeviceError(f"RTDE knows six joints, {robot.name} has {len(robot.joint_names)}")
        self.robot = UrRobot(live)
        self._lock = threading.RLock()
        """Lock of the robot: clients and its program come in threads of their own."""
        self._closed = threading.Event()
        self._lines = {name: bound(socket.SOCK_STREAM, ports[name], address) for name in PORTS}
        serve = {
            "rtde": self._serve_rtde,
            "script": self._serve_script,
            "dashboard": self._serve_dashboard,
            "primary": self._serve_state,
            "secondary": self._serve_state,
        }
        self._threads = [threading.Thread(target=self._control, daemon=True)]
        for name, line in self._lines.items():
            each = (line, serve[name])
            self._threads.append(threading.Thread(target=self._accept, args=each, daemon=True))
        self._clients = threading.BoundedSemaphore(_MOST_CLIENTS)

    @property
    def ports(self) -> dict[str, int]:
        """All ports, RTDE first."""
        return {name: int(line.getsockname()[1]) for name, line in self._lines.items()}

    @property
    def port(self) -> int:
        """The port of RTDE."""
        return self.ports["rtde"]

    def start(self) -> None:
        """Answer from now on."""
        for line in self._lines.values():
            line.listen()
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """Answer no more."""
        self._closed.set()
        for thread in self._threads:
            if thread.is_alive():
                thread.join(2.0)
        for line in self._lines.values():
            line.close()

    def _control(self) -> None:
        while not self._closed.wait(_CYCLE):
            with self._lock:
                self.robot.cycle()

    def _accept(self, line: socket.socket, serve: Callable[[socket.socket], None]) -> None:
        line.settimeout(_LISTEN)
        while not self._closed.is_set():
            # A client that has gone again, or one too many for the process, is left out.
            with contextlib.suppress(OSError):
                client, _ = line.accept()
                if not self._clients.acquire(blocking=False):
                    client.close()
                    continue
                threading.Thread(target=self._served, args=(client, serve), daemon=True).start()

    def _served(self, client: socket.socket, serve: Callable[[socket.socket], None]) -> None:
        try:
            with client, contextlib.suppress(OSError, DeviceError, struct.error, ValueError):
                client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                serve(client)
        finally:
            self._clients.release()

    # -- RTDE ---------------------------------------------------------------------------------

    def _serve_rtde(self, client: socket.socket) -> None:
        session = _Session(self.robot, self._lock)
        reader, due = MessageReader(), time.monotonic()
        while not self._closed.is_set():
            wait = max(due - time.monotonic(), 0.0) if session.running else _LISTEN
            if select.select([client], [], [], wait)[0]:
                data = client.recv(4096)
                if not data:
                    return
                for kind, payload in reader.take(data):
                    client.sendall(session.answer(kind, payload))
            elif session.running:
                client.sendall(session.package())
                # What was missed is not made up for: a client wants the newest.
                due = max(due + 1.0 / session.rate, time.monotonic())

    # -- script and dashboard -----------------------------------------------------------------

    def _serve_script(self, client: socket.socket) -> None:
        for _ in self._heard(client):
            # The port has no answers: a line that is refused is one that does nothing.
            pass

    def _serve_state(self, client: socket.socket) -> None:
        """Serve the primary or secondary port: states, and answers to scripts."""
        client.sendall(version_message(self._outputs(), self.robot.version))
        due = 0.0
        for answer in self._heard(client):
            client.sendall(answer)
            if time.monotonic() >= due:
                due = time.monotonic() + _STATE_CYCLE
                client.sendall(robot_state(self._outputs()))

    def _outputs(self) -> dict[str, Value]:
        with self._lock:
            return self.robot.outputs()

    def _heard(self, client: socket.socket) -> Iterator[bytes]:
        """Run scripts that come; yield an answer to each, and nothing in each pause."""
        text = b""
        client.settimeout(_QUIET)
        while not self._closed.is_set():
            try:
                data = client.recv(65536)
            except TimeoutError:
                yield self._run(text.decode("latin-1")) if text else b""
                text = b""
                continue
            if not data or len(text) > _MOST_SCRIPT:
                return
            text += data
            yield b""

    def _run(self, script: str) -> bytes:
        try:
            with self._lock:
                shown = self.robot.run(script)
        except DeviceError as error:
            return exception_message(self._outputs(), str(error))
        return shown_text(self._outputs(), shown) if shown else b""

    def _serve_dashboard(self, client: socket.socket) -> None:
        client.sendall(b"Connected: Universal Robots Dashboard Server\n")
        client.settimeout(_LISTEN)
        text = b""
        while not self._closed.is_set() and len(text) < 4096:
            with contextlib.suppress(TimeoutError):
                data = client.recv(1024)
                if not data:
                    return
                text += data
            while b"\n" in text:
                line, text = text.split(b"\n", 1)
                client.sendall(self._dashboard(line.decode("latin-1").strip()).encode() + b"\n")

    def _dashboard(self, order: str) -> str:
        with self._lock:
            running = bool(self.robot.program)
            if order == "stop":
                self.robot.unload()
        major, minor, fix, build = self.robot.version
        answers = {
            "polyscopeversion": f"URSoftware {major}.{minor}.{fix}.{build} (Dec 10 2021)",
            "is in remote control": "true",
            "robotmode": "Robotmode: RUNNING",
            "safetystatus": "Safetystatus: NORMAL",
            "safetymode": "Safetymode: NORMAL",
            "running": f"Program running: {str(running).lower()}",
            "programstate": "PLAYING elastocal.urp" if running else "STOPPED elastocal.urp",
            "get robot model": "UR20",
            "get serial number": "20000000000",
            "stop": "Stopped",
            "quit": "Disconnected",
        }
        return answers.get(order.lower(), f"could not understand: '{order[:80]}'")


class _Session:
    """One client of RTDE: its recipes, and whether it listens."""

    def __init__(self, robot: UrRobot, lock: threading.RLock) -> None:
        self._robot, self._lock = robot, lock
        self._outputs: Recipe | None = None
        self._inputs: dict[int, Recipe] = {}
        self.running = False
        self.rate = _RATE
        self._version = VERSIONS[0]

    def answer(self, kind: str, payload: bytes) -> bytes:
        """Return the answer to a message.

        Raises
        ------
        DeviceError, struct.error
            If a controller does not understand it.
        """
        match kind:
            case "V":
                (version,) = struct.unpack(">H", payload)
                if version in VERSIONS:
                    self._version = version
                return message("V", bytes([version in VERSIONS]))
            case "v":
                return message("v", struct.pack(">4I", *self._robot.version))
            case "O":
                return self._set_outputs(payload)
            case "I":
                return self._set_inputs(payload)
            case "S":
                self.running = self._outputs is not None and self._outputs.complete
                return message("S", bytes([self.running]))
            case "P":
                self.running = False
                return message("P", b"\x01")
            case "U":
                return self._take(payload)
        return text_message(f"message {kind!r} is not understood", self._version)

    def package(self) -> bytes:
        """Return the outputs as they are now."""
        if self._outputs is None:
            return b""
        with self._lock:
            values = self._robot.outputs()
        number = b"\x01" if self._version > 1 else b""
        return message("U", number + self._outputs.pack(values))

    def _set_outputs(self, payload: bytes) -> bytes:
        number = b""
        if self._version > 1:
            (rate,) = struct.unpack(">d", payload[:8])
            self.rate, payload = min(max(rate, _LEAST_RATE), _MOST_RATE), payload[8:]
        self._outputs = Recipe.of(payload.decode("ascii"), OUTPUT_TYPES)
        if self._version > 1:
            number = bytes([self._outputs.complete])
        return message("O", number + ",".join(self._outputs.types).encode())

    def _set_inputs(self, payload: bytes) -> bytes:
        recipe = Recipe.of(payload.decode("ascii"), INPUT_TYPES)
        number = len(self._inputs) + 1 if recipe.complete else 0
        if number > 255:
            raise DeviceError("more than 255 recipes")
        if number:
            self._inputs[number] = recipe
        return message("I", bytes([number]) + ",".join(recipe.types).encode())

    def _take(self, payload: bytes) -> bytes:
        recipe = self._inputs.get(payload[0]) if payload else None
        if recipe is None:
            return text_message("a package of no recipe", self._version)
        with self._lock:
            self._robot.take(recipe.unpack(payload[1:]))
        return b""


@serves("rtde", _takes)
def rtde_server(live: LiveCell, told: Told) -> RtdeServer:
    """Return the controller that a cell file describes, on the ports of a controller."""
    address = str(told.settings.get("address") or told.address)
    return RtdeServer(live, PORTS, address=address)
