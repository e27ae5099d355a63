"""A simulated KRC behind RSI: corrections, the interpreter of its KRL program, and the arm.

One call of `RsiRobot.cycle` is one cycle of the controller. `PosCorr` is the object of the RSI
context that makes corrections act; a KRL program is a generator that is looked at every 12 ms.
The programmed pose (RSol, ASPos) stays what it is while corrections act: they move the actual
one (RIst, AIPos), some time after they have come.
"""

import math
from collections import deque
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Motion, RobotArm
from elastocal.errors import DeviceError
from elastocal.results import brief_repr
from elastocal.sim.wire._pos_corr import PosCorr, PosCorrLimits, RsiStopError
from elastocal.sim.wire._rsi_messages import Channel
from elastocal.sim.wire.live_cell import LiveCell
from elastocal.sim.workcell import PoseFollower, SimulatedCell

POLL = 0.012
"""Time between two looks of the interpreter at its channels, in s."""
_NONE = 1e-9
"""A correction below this is none, in m and rad."""
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
    """What the KRL program has written into its channels."""

    number: int = 0
    """Krl.N: of the last PTP that is over."""
    state: int = 0
    """Krl.State."""
    guided: bool = False
    """Whether it is in RSI_MOVECORR."""


KrlProgram = Callable[["RsiRobot"], Steps]


def run_program(robot: "RsiRobot") -> Steps:
    """Do what the PC wants: stand, be guided, go to a target; the program of a run."""
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
    """Be guided where the arm stands until the PC says stop: the plain use of RSI."""
    robot.krl.state = _GUIDED
    yield from robot.move_corr()


@brief_repr
@dataclass(frozen=True)
class RsiContext:
    """How the controller is set up, and how patient the simulation is."""

    program: KrlProgram = run_program
    """The KRL program that runs."""
    absolute: bool = False
    """Whether corrections are absolute (RSI_ON #ABSOLUTE), for compensation; else relative."""
    limits: PosCorrLimits = field(default_factory=PosCorrLimits)
    cycle: float = 0.004
    """In s: 4 ms (IPO_FAST) or 12 ms (IPO)."""
    delay: float = 0.012
    """From a correction to the motion, in s; at least a cycle. RSI 2 has 120 ms, and nobody has
    published a number for later ones."""
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
        """Stand ready; ``receive`` are the channels from the PC."""
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
        """Return what the controller says now, in mm and deg."""
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
        """Do what a cycle does after its answer.

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
        """Lead the arm to its corrected pose; refuse what its axes cannot follow."""
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
        """RSI_OFF, PTP $AXIS_ACT_MEAS, RSI_ON: correct nothing, stand where the arm stands."""
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
        """What the PC wants, and the number of it."""
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
