"""A simulated KUKA controller with RSI over Ethernet (UDP, XML).

The robot is the client: each cycle it sends a ``<Rob>`` datagram to the PC and waits for the
``<Sen>`` with the same ``IPOC``, a count of milliseconds. An answer that is late, or to another
cycle, counts as missing; after ``timeout`` cycles in a row without one the controller stops the
arm, and is silent until an operator resets it. The effect of a correction depends on the
`RsiContext`.

It is written from public descriptions of RSI 3 to 5 and from client programs; never compared with a
real controller. Further assumptions: only consecutive late answers count; before the first answer
none is late (an operator starts the program when the PC listens); if this machine is too slow, the
robot's time pauses between two cycles, and ``statistics.stretched`` counts them.

A simulated KRC behind RSI: corrections, the interpreter of its KRL program, and the arm.

One call of `RsiRobot.cycle` is one cycle of the controller. `PosCorr` is the object of the RSI
context that makes corrections act; a KRL program is a generator that runs every 12 ms. Corrections
do not change the programmed pose (RSol, ASPos): they move the actual one (RIst, AIPos), some time
after their arrival.
"""

import contextlib
import math
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import LOOPBACK, Motion, RobotArm, WallClock
from elastocal.errors import DeviceError, ElastocalError
from elastocal.results import brief_repr
from elastocal.sim.wire._rsi_messages import (
    LARGEST,
    Answer,
    Channel,
    EthernetConfig,
    PosCorr,
    PosCorrLimits,
    RobWriter,
    RsiStopError,
    SenReader,
)
from elastocal.sim.wire.live_cell import LiveCell
from elastocal.sim.wire.servers import Told, serves
from elastocal.sim.workcell import PoseFollower, SimulatedCell

POLL = 0.012
"""Time between two looks of the interpreter at its channels, in s."""
_NONE = 1e-9
"""Size below which a correction counts as zero, in m and rad."""
_ARM_JOINTS = 6
_STANDING, _GUIDED, _MOVING, _DONE, _BRAKED, _ENDED = 1, 2, 3, 4, 5, 9
"""Krl.State; 0 until the program is in its loop."""
_DRIVE_CONSTANT = 60.0
"""Torque of a gear per ampere of its motor, in N·m/A. An assumption."""
_PTP, _ADOPT = 2, 3
"""Cmd.Op of a PTP, and of the present place for the programmed one."""
_OFF = 0.1
"""Time for which RSI is off while the present place is adopted, in s."""
_OVER = object()
Steps = Generator[None, None, None]
"""A KRL program as it runs: it gives the interpreter back at every wait."""


@dataclass
class KrlState:
    """Values that the KRL program has written into its channels."""

    number: int = 0
    """Krl.N: of the last PTP that is over."""
    state: int = 0
    """Krl.State."""
    guided: bool = False
    """Whether it is in RSI_MOVECORR."""


KrlProgram = Callable[["RsiRobot"], Steps]


def run_program(robot: "RsiRobot") -> Steps:
    """Obey the PC: stand, be guided, go to a target; the program of a run."""
    krl = robot.krl
    yield
    while True:
        krl.state = _STANDING
        wanted, number = robot.command
        if wanted == 1:
            krl.state = _GUIDED
            yield from robot.move_corr()
        elif wanted == _PTP and number != krl.number:
            krl.state = _MOVING
            arrived = yield from robot.point_to_point()
            krl.number, krl.state = number, _DONE if arrived else _BRAKED
            while robot.command == (_PTP, number):
                yield
        elif wanted == _ADOPT and number != krl.number:
            krl.state = _MOVING
            yield
            yield from robot.adopt()
            krl.number = number
        elif wanted == 9:
            krl.state = _ENDED
            yield
            return
        else:
            yield


def corrected_program(robot: "RsiRobot") -> Steps:
    """Be guided at the present position until the PC stops it: the plain use of RSI."""
    robot.krl.state = _GUIDED
    yield from robot.move_corr()


@brief_repr
@dataclass(frozen=True)
class RsiContext:
    """Configuration of the controller, and tolerances of the simulation."""

    program: KrlProgram = run_program
    """The KRL program that runs."""
    absolute: bool = False
    """Whether corrections are absolute (RSI_ON #ABSOLUTE), for compensation; else relative."""
    limits: PosCorrLimits = field(default_factory=PosCorrLimits)
    cycle: float = 0.004
    """In s: 4 ms (IPO_FAST) or 12 ms (IPO)."""
    delay: float = 0.012
    """Delay from a correction to the motion, in s; at least a cycle. RSI 2 has 120 ms; no value is
    published for later versions."""
    timeout: int = 100
    """Cycles in a row without an answer after which the controller stops; 10 by default on a
    controller, 100 in the contexts that public drivers come with."""
    precision: int = 6
    """Decimals of the ETHERNET object; 1 by default on a controller."""
    patience: float = 0.0
    """Time that the robot at least waits for an answer, in s of the wall; above the cycle its time
    is stretched. For machines that are busy."""
    operator: float | None = None
    """Time after which an operator resets a controller that has stopped, in s of the wall; None:
    only when asked."""


class RsiRobot:
    """The controller with its arm."""

    def __init__(self, live: LiveCell, receive: Sequence[Channel], context: RsiContext) -> None:
        """Set up the robot; ``receive`` are the channels from the PC."""
        self._live, self._receive, self._krl_program = live, receive, context.program
        self._cycle = context.cycle
        self._latency = max(0, round(context.delay / context.cycle) - 1)
        self._corrections = PosCorr(context.limits, context.absolute)
        self._follower = live.apart(lambda sim: PoseFollower(sim.plant))
        cell, self._true = live.cell, live.sim.plant.statics.robot
        self._fastest = cell.axis_speeds / cell.file.motion.override
        self._external = len(cell.robot.joint_names) - _ARM_JOINTS
        turns = np.array(self._true.linkage.revolute)
        self._unit = np.where(turns, 180.0 / math.pi, 1e3)
        self.channels: dict[str, float] = {}
        """Values from the PC, by tag."""
        self.krl = KrlState()
        self.ended = True
        """Whether the KRL program is over."""
        self.silent = False
        """Whether RSI is off, so that nothing is sent."""

    def start(self) -> None:
        """Switch the drives on and start the KRL program, as an operator does.

        Raises
        ------
        DeviceError
            While the safety controller keeps the arm stopped.
        """
        self._live.apart(self._start)

    def _start(self, sim: SimulatedCell) -> None:
        sim.arm.enable()
        self.krl, self.channels, self._stop_before = KrlState(), {}, False
        self._corrections.clear()
        self._offset = self._corrections.offset
        self._offsets = deque([self._offset] * self._latency)
        self._program(sim.arm.state().q)
        self._corrected_by = np.zeros_like(self._q_programmed)
        self._led, self._moving, self.ended, self.silent = False, False, False, False
        self._steps, self._looked = self._krl_program(self), 0
        self._said = self._values(sim)

    def stop(self) -> None:
        """Stop the arm where it is."""
        self._live.apart(lambda sim: sim.arm.stop())

    def values(self) -> dict[str, float | Sequence[float]]:
        """Return the controller's message of now, in mm and deg."""
        return self._live.apart(self._values) if self._moving else self._said

    def _values(self, sim: SimulatedCell) -> dict[str, float | Sequence[float]]:
        if self._led:
            q, T = self._follower.q, self._follower.T
        else:
            state = sim.arm.state()
            q, T = state.q, state.T_base_tcp
        if self._moving:
            self._program(q - self._corrected_by)
        programmed = self._q_programmed
        axes, wanted = (self._unit * q).tolist(), (self._unit * programmed).tolist()
        ampere = self._follower.gear_torque / _DRIVE_CONSTANT if self._led else np.zeros(6)
        return {
            "RIst": _frame(T),
            "RSol": _frame(self._T_programmed),
            "AIPos": axes[self._external :],
            "ASPos": wanted[self._external :],
            "EIPos": axes[: self._external],
            "ESPos": wanted[: self._external],
            "MACur": ampere.tolist(),
            "Krl.N": self.krl.number,
            "Krl.State": self.krl.state,
        }

    def cycle(self, heard: Mapping[str, float] | None) -> None:
        """Do the work of a cycle after its answer.

        Parameters
        ----------
        heard : mapping, optional
            Values from the PC by tag; None when no valid answer has come in time.

        Raises
        ------
        RsiStopError
            When something stops the arm.
        """
        for channel in self._receive:
            if heard is not None and channel.tag in heard:
                self.channels[channel.tag] = heard[channel.tag]
            elif not channel.hold:
                self.channels[channel.tag] = 0.0
        self._live.apart(self._go_on)

    def _go_on(self, sim: SimulatedCell) -> None:
        stop = bool(self.channels.get("Stop", 0.0))
        if self.krl.guided:
            self._corrections.take(self.channels)
            self.krl.guided = not (stop and not self._stop_before)
        self._stop_before = stop
        self._offsets.append(self._corrections.offset)
        offset = self._offsets.popleft()
        if self._led and not self._moving:
            self._lead(offset)
        self._offset = offset
        if self._looked <= 0:
            self._looked = round(POLL / self._cycle)
            self.ended = next(self._steps, _OVER) is _OVER
        self._looked -= 1
        self._said = self._values(sim)
        fault = self._follower.stopped if self._led else sim.arm.state().fault
        if fault is not None:
            raise RsiStopError(fault)

    def _lead(self, offset: FloatArray) -> None:
        """Move the arm to its corrected pose; refuse what its axes cannot follow."""
        before = self._follower.q
        self._follower.follow(_corrected(self._T_programmed, offset), self._cycle)
        speed = np.abs(self._follower.q - before) / self._cycle / self._fastest
        if not float(speed.max()) <= 1.0:
            axis = self._live.cell.robot.joint_names[int(np.nanargmax(speed))]
            raise RsiStopError(
                f"KSS00421 command velocity of {axis} is {speed.max():.0%} of the most"
            )

    def _program(self, q: FloatArray) -> None:
        """Take joints as the programmed ones."""
        self._q_programmed, self._T_programmed = q, self._true.forward(q)

    def move_corr(self) -> Steps:
        """RSI_MOVECORR: let corrections act until ``Stop`` rises."""
        self._live.apart(lambda _: self._follower.begin())
        self.krl.guided = self._led = True
        while self.krl.guided:
            yield
        while not all(np.array_equal(each, self._offset) for each in self._offsets):
            yield

    def point_to_point(self) -> Generator[None, None, bool]:
        """PTP: go to the target of the channels; return whether the arm has come there.

        A correction that is still there stays on top of the target.
        """
        target = self._target()
        programmed = self._true.forward(target)
        T = _corrected(programmed, self._offset)
        if np.abs(T - programmed).max() > _NONE:
            found = self._true.solve(T[None], target[None])
            if not found.ok[0]:
                raise RsiStopError("KSS01422 the corrected target is out of reach")
            self._corrected_by = found.q[0] - target
        else:
            self._corrected_by = np.zeros_like(target)
        goal, speed = target + self._corrected_by, self.channels.get("Cmd.V", 0.0) / 100.0
        self._move(goal, min(max(speed, 0.01), 1.0))
        while self._arm().state().motion is Motion.MOVING:
            if self.command[0] != _PTP:
                self._arm().stop()
                self._arm().enable()
            yield
        q = self._arm().state().q
        self._moving = False
        self._program(q - self._corrected_by)
        return bool(np.array_equal(q, goal))

    def adopt(self) -> Steps:
        """RSI_OFF, PTP $AXIS_ACT_MEAS, RSI_ON: adopt the present position without correction."""
        self.silent = True
        for _ in range(round(_OFF / POLL)):
            yield
        self._live.apart(self._adopt)
        self.silent = False

    def _adopt(self, sim: SimulatedCell) -> None:
        q = self._follower.q if self._led else sim.arm.state().q
        self._corrections.clear()
        self._offset = self._corrections.offset
        self._offsets = deque([self._offset] * self._latency)
        self._program(q)

    @property
    def command(self) -> tuple[int, int]:
        """Command of the PC, and its number."""
        return round(self.channels.get("Cmd.Op", 0.0)), round(self.channels.get("Cmd.N", 0.0))

    def _target(self) -> FloatArray:
        external = [self.channels.get(f"Ex.E{k + 1}", 0.0) for k in range(self._external)]
        arm = [self.channels.get(f"Ax.A{k + 1}", 0.0) for k in range(_ARM_JOINTS)]
        target: FloatArray = np.array([*external, *arm]) / self._unit
        return target

    def _move(self, q: FloatArray, speed: float) -> None:
        try:
            self._arm().move_joints(q, speed)
        except DeviceError as error:
            raise RsiStopError(str(error)) from error
        self._led, self._moving = False, True

    def _arm(self) -> RobotArm:
        return self._live.arm()


def _corrected(T_programmed: FloatArray, offset: FloatArray) -> FloatArray:
    """Return a frame with a correction in base on top; see `PosCorr.offset`."""
    T = T_programmed.copy()
    T[:3, :3] = offset[1:] @ T[:3, :3]
    T[:3, 3] += offset[0]
    return T


def _frame(T: FloatArray) -> list[float]:
    """Return X, Y, Z in mm and A, B, C in deg (about Z, Y', X'') of a frame."""
    (ux, vx, _), (uy, vy, _), (uz, vz, wz) = T[:3, :3].tolist()
    flat = math.hypot(vz, wz)
    angles = (
        (math.atan2(uy, ux), math.atan2(-uz, flat), math.atan2(vz, wz))
        if flat > 1e-9
        else (math.atan2(-vx, vy), math.atan2(-uz, flat), 0.0)
    )
    return [*(1e3 * T[:3, 3]).tolist(), *map(math.degrees, angles)]


IPOC_START = 4_208_163_634
"""First count of milliseconds of a session; a restart of the controller begins lower."""
SENTYPE = "elastocal"
"""Default ``Type`` of the answers."""
_MALFORMED = (
    b"<Rob Type='KUKA'><RIst X='",
    b"\xff\x00" * 700,
    b'<!DOCTYPE x [<!ENTITY a "b">]><Rob>&a;</Rob>',
)
_LOOK = 0.05
"""Longest time without a look whether the server is to be closed, in s of the wall."""
_BEHIND = 1.0
"""Cycles that the robot may be behind the clock before its time is stretched."""
_WRAP = 1 << 32
"""IPOC counts up to here, and from zero again."""
_LOGGED = 50_000
"""Answers that are kept."""
_NEAR = 100
"""Cycles by which the count of a controller that restarts nearby is lower."""
RsiFault = Literal[
    "ipoc_jump",
    "lost",
    "swapped",
    "repeated",
    "malformed",
    "intruder",
    "deaf",
    "restart",
    "restart_nearby",
]
"""Faults on demand: count that jumps by a second; datagrams that get lost, come in the wrong order,
come twice, or make no sense; a second robot; answers that come late; a controller that restarts,
its count lower by a quarter of an hour, or by a hundred cycles."""


class TakenAnswer(NamedTuple):
    """The correction of an answer that came in time."""

    session: int
    """Number of the session, from 0; each begins without correction."""
    ipoc: int
    correction: tuple[float, ...]
    """RKorr X, Y, Z, in mm."""


def _elements(tags: Sequence[tuple[str, str, int]]) -> str:
    """Return the elements of numbered channels: tag, type, and whether it keeps its value."""
    return "".join(
        f'<ELEMENT TAG="{tag}" TYPE="{kind}" INDX="{index}" HOLDON="{hold}"/>'
        for index, (tag, kind, hold) in enumerate(tags, 1)
    )


def ethernet_config(address: str, port: int, mode: str = "contact", sentype: str = SENTYPE) -> str:
    """Return a config file of the ETHERNET object, for the KRL program of a mode.

    Parameters
    ----------
    address, port : str, int
        Address and port of the PC.
    mode : str
        ``contact``: the program of a run, its corrections relative; ``compensation``: corrections
        alone, which keep their value when no answer comes; ``measure``: no answer is expected.
    sentype : str
        ``Type`` of the answers.
    """
    hold = int(mode == "compensation")
    wanted = [("Stop", "BOOL", 1), *((f"RKorr.{axis}", "DOUBLE", hold) for axis in "XYZABC")]
    if mode == "contact":
        wanted += [("Cmd.N", "LONG", 1), ("Cmd.Op", "LONG", 1), ("Cmd.V", "DOUBLE", 1)]
        wanted += [(f"Ax.A{k}", "DOUBLE", 1) for k in range(1, 7)]
        wanted += [(f"Ex.E{k}", "DOUBLE", 1) for k in range(1, 7)]
    own = "".join(
        f'<ELEMENT TAG="DEF_{tag}" TYPE="DOUBLE" INDX="INTERNAL"/>'
        for tag in ("RIst", "RSol", "AIPos", "ASPos", "EIPos", "MACur")
    )
    own += '<ELEMENT TAG="DEF_Delay" TYPE="LONG" INDX="INTERNAL"/>'
    program = [] if mode == "measure" else [("Krl.N", "LONG", 0), ("Krl.State", "LONG", 0)]
    only_send = str(mode == "measure").upper()
    return (
        f"<ROOT><CONFIG><IP_NUMBER>{address}</IP_NUMBER><PORT>{port}</PORT>"
        f"<SENTYPE>{sentype}</SENTYPE><ONLYSEND>{only_send}</ONLYSEND></CONFIG>"
        f"<SEND><ELEMENTS>{own}{_elements(program)}</ELEMENTS></SEND>"
        f"<RECEIVE><ELEMENTS>{'' if mode == 'measure' else _elements(wanted)}</ELEMENTS></RECEIVE>"
        "</ROOT>"
    )


@brief_repr
@dataclass
class RsiStatistics:
    """Counts since `RsiServer.start`."""

    cycles: int = 0
    answered: int = 0
    late: int = 0
    """Cycles without a valid answer, the first answer of a session passed."""
    stretched: int = 0
    """Cycles that came later than the robot would have sent them, by more than a cycle."""
    stops: list[str] = field(default_factory=list)
    """Why the controller stopped, in its order."""


class RsiServer:
    """The controller: sends, listens, and moves the arm of a `LiveCell`."""

    def __init__(
        self,
        live: LiveCell,
        config: EthernetConfig,
        context: RsiContext | None = None,
        *,
        address: str = LOOPBACK,
        port: int = 0,
    ) -> None:
        """Take a port to send from; see `rsi_server` for one that is made as usual.

        Parameters
        ----------
        live : LiveCell
            The cell.
        config : EthernetConfig
            Where the PC is, and the channels.
        context : RsiContext, optional
            How the controller is set up.
        address, port : str, int
            Address and port of the robot; 0: any free port.

        Raises
        ------
        DeviceError
            If the port is taken.
        """
        self._live, self._config = live, config
        self._context = context = context or RsiContext()
        self._robot = RsiRobot(live, config.receive, context)
        self._writer = RobWriter(config.send, context.precision)
        self._reader = SenReader(config.receive, config.sentype)
        self._peer = (config.address, config.port)
        rate = live.clock.rate if isinstance(live.clock, WallClock) else 1.0
        self._window = max(context.cycle / rate, context.patience)
        self.statistics = RsiStatistics()
        self.first_ipoc = IPOC_START
        """Count that the first session begins at; to be set before `start`."""
        self.taken: deque[TakenAnswer] = deque(maxlen=_LOGGED)
        """The answers that came in time."""
        self._faults: deque[RsiFault | None] = deque()
        self._held: bytes | None = None
        self._malformed = deque(_MALFORMED)
        self._closing, self._reset = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="simulated RSI", daemon=True)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind((address, port))
        except OSError as error:
            self._socket.close()
            raise DeviceError(f"simulated RSI cannot bind {address}:{port}: {error}") from error

    @property
    def port(self) -> int:
        """The port that the robot sends from."""
        return int(self._socket.getsockname()[1])

    @property
    def ports(self) -> dict[str, int]:
        """Port of the PC, which must listen there, and the robot's own."""
        return {"udp": self._config.port, "robot": self.port}

    def start(self) -> None:
        """Send from now on."""
        self._thread.start()

    def close(self) -> None:
        """Send no more, and give the port back."""
        self._closing.set()
        self._reset.set()
        if self._thread.is_alive():
            self._thread.join(5.0)
        self._socket.close()

    def reset(self) -> None:
        """Reset the controller and start its program again, as an operator does."""
        self._reset.set()

    def inject(self, *faults: RsiFault, after: int = 0) -> None:
        """Schedule faults, one a cycle, after a number of cycles without."""
        self._faults.extend([*[None] * after, *faults])

    def _run(self) -> None:
        started, stop = 0, ""
        while not self._closing.is_set():
            self._reset.clear()
            if stop == "restart_nearby":
                begin = self._ipoc - _NEAR * round(1e3 * self._context.cycle)
            else:
                begin = self.first_ipoc - 1_000_000 * started
            try:
                self._robot.start()
                stop = self._session(started, begin)
            except ElastocalError as error:
                stop = str(error)
            with contextlib.suppress(ElastocalError):
                self._robot.stop()
            started += 1
            if self._closing.is_set():
                return
            self.statistics.stops.append(stop)
            if not stop.startswith("restart"):
                self._reset.wait(self._context.operator)

    def _session(self, number: int, ipoc: int) -> str:
        """Run RSI from RSI_ON on; return why it has ended."""
        clock, counts = self._live.clock, self.statistics
        due, missed, heard = clock.now(), 0, False
        while not self._closing.is_set():
            if self._robot.ended:
                return "program ended"
            if self._robot.silent:
                self._robot.cycle(None)
                ipoc += round(1e3 * self._context.cycle)
                due = self._wait(due + self._context.cycle)
                continue
            fault = self._faults.popleft() if self._faults else None
            if fault in ("restart", "restart_nearby"):
                return fault
            self._ipoc = ipoc = (ipoc + (1000 if fault == "ipoc_jump" else 0)) % _WRAP
            self._send(self._writer.write({**self._robot.values(), "Delay": missed}, ipoc), fault)
            counts.cycles += 1
            answer = None
            if not self._config.only_send:
                # A telegram that is lost has no answer that could be waited for.
                answer = self._await(ipoc, 0.0 if fault == "lost" else self._window)
                answer = None if fault == "deaf" else answer
                if self._closing.is_set():
                    return "closed"
                heard = heard or answer is not None
                missed = missed + 1 if heard and answer is None else 0
                if answer is not None:
                    counts.answered += 1
                    shift = tuple(answer.values.get(f"RKorr.{axis}", 0.0) for axis in "XYZ")
                    self.taken.append(TakenAnswer(number, ipoc, shift))
                counts.late += missed > 0
            if missed > self._context.timeout:
                return f"KSS29002 SEN: RSI execution error: no valid answer for {missed} cycles"
            try:
                self._robot.cycle(None if answer is None else answer.values)
            except RsiStopError as stop:
                return str(stop)
            ipoc += round(1e3 * self._context.cycle)
            due = self._wait(due + self._context.cycle)
        return "closed"

    def _wait(self, due: float) -> float:
        """Wait until a time in s; return when the cycle really begins."""
        clock = self._live.clock
        left = due - clock.now()
        if left > 0.0:
            clock.sleep(left)
            return due
        if -left > _BEHIND * self._context.cycle:
            self.statistics.stretched += 1
            return due - left
        return due

    def _send(self, datagram: bytes, fault: RsiFault | None) -> None:
        """Send a datagram of a cycle, with what a fault makes of it."""
        out = [datagram]
        if self._held is not None:
            out, self._held = [datagram, self._held], None
        if fault == "swapped":
            out, self._held = [], datagram
        elif fault == "lost":
            out = []
        elif fault == "repeated":
            out *= 2
        elif fault == "malformed":
            out = [self._malformed[0]]
            self._malformed.rotate(-1)
        elif fault == "intruder":
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
                other.bind((self._socket.getsockname()[0], 0))
                other.sendto(datagram.replace(b'X="', b'X="9'), self._peer)
        for each in out:
            try:
                self._socket.sendto(each, self._peer)
            except OSError:
                return  # no listener yet

    def _await(self, ipoc: int, window: float) -> Answer | None:
        """Return the answer to a cycle; None when it does not come within a time of the wall."""
        end = time.monotonic() + window
        while not self._closing.is_set():
            left = end - time.monotonic()
            self._socket.settimeout(min(max(left, 0.0), _LOOK))
            try:
                data, source = self._socket.recvfrom(LARGEST + 1)
            except (TimeoutError, BlockingIOError):
                if left <= _LOOK:
                    return None
                continue
            answer = self._reader.read(data) if source == self._peer else None
            if answer is not None and answer.ipoc == ipoc:
                return answer
        return None


def _free_port(address: str) -> int:
    """Return a free UDP port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind((address, 0))
        return int(probe.getsockname()[1])


@serves("kuka_rsi")
def rsi_server(live: LiveCell, told: Told, context: RsiContext | None = None) -> RsiServer:
    """Return the controller for a PC that listens at the address in a cell file.

    Parameters
    ----------
    live : LiveCell
        The cell.
    told : Told
        ``port`` and ``address`` of the PC, ``robot`` (address of the controller), ``mode`` (see
        `ethernet_config`), ``sentype``, ``cycle`` and ``delay`` in s, ``timeout`` in cycles.
        Without a port a free one is chosen for the PC.
    context : RsiContext, optional
        How the controller is set up; by default as the cell file says, with an operator who resets
        it 2 s after a stop, and patient: a machine that is busy with other things for 100 ms does
        not cost the run.
    """
    settings = {key: value for key, value in told.settings.items() if value is not None}
    mode = str(settings.get("mode", "contact"))
    if context is None:
        known = {key: settings[key] for key in ("cycle", "delay", "timeout") if key in settings}
        context = replace(_CONTEXTS[mode], operator=2.0, patience=_PATIENCE, **known)  # type: ignore[arg-type]
    address = str(settings.get("address", told.address))
    port, sentype = told.port() or _free_port(address), str(settings.get("sentype", SENTYPE))
    config = EthernetConfig.from_xml(ethernet_config(address, port, mode, sentype))
    return RsiServer(live, config, context, address=str(settings.get("robot", LOOPBACK)))


_PATIENCE = 0.1
"""Patience of a controller that `elastocal simulate` starts, in s."""
_CONTEXTS = {
    "measure": RsiContext(),
    "contact": RsiContext(),
    "compensation": RsiContext(program=corrected_program, absolute=True),
}
"""Contexts of the modes of the driver."""
