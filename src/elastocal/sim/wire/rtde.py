"""A Universal Robots controller on the wire: RTDE, primary, secondary, script, dashboard.

Served of RTDE (protocol versions 1 and 2): recipes of outputs and inputs, registers, start and
pause, up to 500 Hz. Of the primary and secondary port: the state of the robot ten times a second,
the message of the version, and scripts. Of a script: a program is taken and its name noted, not
interpreted, and the register protocol of ``ur_rtde``'s program is carried out as far as `UrRobot`
says; of single lines those that `UrRobot.run` knows are carried out, others are refused by a
message. Of the dashboard: what that client asks for.

Verified against ``ur_rtde``, ``urx``, the RTDE client of Universal Robots and public descriptions,
not against a controller.
"""

import contextlib
import select
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator, Mapping

from elastocal.cell import LOOPBACK
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
from elastocal.sim.wire._rtde_robot import UrRobot
from elastocal.sim.wire._ur_state import (
    exception_message,
    robot_state,
    shown_text,
    version_message,
)
from elastocal.sim.wire.live_cell import LiveCell
from elastocal.sim.wire.servers import Told, bound, serves

PORTS = {
    "rtde": 30004,
    "script": 30003,
    "dashboard": 29999,
    "primary": 30001,
    "secondary": 30002,
}
"""Those of a controller, which its clients take for granted."""
_MOST_RATE, _LEAST_RATE = 500.0, 1.0
_RATE = 125.0
"""Of outputs in version 1 of RTDE, in Hz; the least that clients of version 2 take for granted."""
_MOST_CLIENTS = 8
_CYCLE = 0.002
"""Of the controller, in s of the wall."""
_STATE_CYCLE = 0.1
"""Of the primary and secondary port, in s of the wall."""
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
            If the arm has external axes or not six joints, or a port cannot be had.
        """
        robot = live.cell.robot
        if not _takes(robot):
            raise DeviceError(f"RTDE knows six joints, {robot.name} has {len(robot.joint_names)}")
        self.robot = UrRobot(live)
        self._lock = threading.RLock()
        """Of the robot: clients and its program come in threads of their own."""
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
            If it is none that a controller understands.
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
