"""Protocols of arm, force sensor, tracker and clock, and the samples that they return.

An arm does the steps of paper Procedure 1 (4-25). Every command returns at once; `RobotArm.state`
reports the progress. A caller reads it in each supervision cycle, so that a watchdog can stop the
arm at any step. Forces are those on the robot at the tool centre point, as in docs/conventions.md.

No call may take longer than a supervision cycle (``procedure.cycle``, 40 ms): the calling thread is
the watchdog that stops the arm. A driver whose line may be slow communicates in a thread of its own
and answers from the last message. A call may raise `DeviceError`, or an `OSError` of its line; the
arm is then retracted from the surface by the devices that still work.

A new driver is one package, ``drivers/NAME``; see `elastocal.cell.rig` and
docs/how-to/write-a-driver.md.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol, runtime_checkable

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell.line_counts import LineCounts, no_lines
from elastocal.errors import DeviceError
from elastocal.results import brief_repr

_UNIT = 1e-6
"""Largest deviation of the length of a direction from 1."""


class Motion(Enum):
    """States of motion of an arm."""

    DISARMED = "disarmed"
    """Drives off, or not released for motion by `RobotArm.enable`."""
    IDLE = "idle"
    """Standing in position control; the last command is done."""
    MOVING = "moving"
    """Joint-space move."""
    APPROACHING = "approaching"
    """Guarded linear move."""
    HOLDING = "holding"
    """Force control, building up or holding a load case."""
    RELEASING = "releasing"
    """Force control, ramping the force to zero."""
    RETRACTING = "retracting"
    """Linear move away from the surface."""
    STOPPED = "stopped"
    """Stopped by a fault, a limit or `RobotArm.stop`; needs `RobotArm.enable` again."""


@brief_repr
@dataclass(frozen=True, eq=False)
class ArmState:
    """State of an arm, as its controller states it."""

    time: float
    """When, in s of the clock."""
    q: FloatArray
    """Joint positions of the controller, shape (joint,), in rad or m."""
    T_base_tcp: FloatArray
    """Tool frame that the controller computes from them, shape (4, 4), in m."""
    motion: Motion
    in_contact: bool | None
    """Whether a guarded move ended because the contact force was reached, until a retract; None
    where nothing has been felt or left since the connection: an arm that was pressing before does
    not know it."""
    fault: str | None
    """Why it stopped, or why it left a guarded move or force control; None when nothing is
    wrong."""
    source: str
    """Device that says so."""
    link: FloatArray | None = None
    """Positions of the links by secondary encoders, shape (joint,), in rad or m; NaN at a joint
    that has none. None: the arm has none at all."""


UNWATCHED = 5.0
"""Time without a call of `RobotArm.state` after which an arm that presses, or moves to a surface,
stands still with a fault, in s: whoever supervises it hangs, on a disk or in a debugger."""


class RobotArm(Protocol):
    """An arm with a guarded approach and force control at the tool.

    Contract: no command moves anything before `enable`; a command that is not allowed in the
    present state raises `DeviceError`; `stop` is allowed in every state and any number of times;
    `approach` and `hold` end with a fault where nobody asks for the `state`; see `UNWATCHED`.
    """

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in the order of every joint array."""

    def state(self) -> ArmState:
        """Return the newest state, within a supervision cycle; it does not wait for a newer one."""

    def enable(self) -> None:
        """Enable motion; the arm then is idle. Refused while a fault persists."""

    def disable(self) -> None:
        """Disable motion; the arm stands still."""

    def move_joints(self, q: FloatArray, speed: float) -> None:
        """Start a synchronous joint-space move.

        Parameters
        ----------
        q : ndarray, shape (joint,)
            Target in rad or m.
        speed : float
            Fraction of the axis speeds, in (0, 1].
        """

    def adopt_position(self) -> None:
        """Take the present position of the arm as its programmed position.

        On return a joint move can begin from here. Meanwhile the arm stands still and may send
        nothing for some seconds, during which it is not supervised. Call it off the surface, when
        the arm is idle.
        """

    def approach(
        self, direction_base: FloatArray, distance: float, speed: float, contact_force: float
    ) -> None:
        """Start a straight move that ends at a distance or when a force is felt.

        Parameters
        ----------
        direction_base : ndarray, shape (3,)
            Unit vector in base.
        distance : float
            Distance in m after which the arm stops if it has felt no force.
        speed : float
            In m/s.
        contact_force : float
            Force against the motion at which the arm stops, in N; infinite: never.
        """

    def hold(self, force_tcp: FloatArray, rate: float) -> None:
        """Start to build up a force and hold it, orientation kept.

        Parameters
        ----------
        force_tcp : ndarray, shape (3,)
            Force on the robot in the tcp frame, in N.
        rate : float
            Fastest change of the force, in N/s.
        """

    def release(self, rate: float) -> None:
        """Start to ramp the force to zero; the arm then is idle, without force, at the surface."""

    def retract(self, direction_base: FloatArray, distance: float, speed: float) -> None:
        """Start a straight move away from the surface; see `approach`."""

    def stop(self) -> None:
        """Stop at once, in position control. Always allowed."""


@dataclass(frozen=True)
class CommandChecks:
    """Checks of a command before its motion begins; refusals name the arm."""

    source: str

    def require(self, holds: bool, what: str, value: object, allowed: str) -> None:
        """Refuse a value.

        Raises
        ------
        DeviceError
            Naming it and what is allowed.
        """
        if not holds:
            raise DeviceError(f"{self.source}: {what} is {value}: must be {allowed}")

    def vector(self, what: str, values: FloatArray, size: int) -> FloatArray:
        """Return finite numbers, shape (size,), as an array of their own.

        Parameters
        ----------
        what : str
            How the message names them.
        values : ndarray, shape (size,)
            Finite.
        size : int
            How many there must be.

        Raises
        ------
        DeviceError
            If they are not as they must be.
        """
        array = np.array(values, dtype=float)
        fits = array.shape == (size,) and bool(np.all(np.isfinite(array)))
        self.require(fits, what, array.tolist(), f"{size} finite numbers")
        return array

    def joint_move(
        self,
        q: FloatArray,
        speed: float,
        names: Sequence[str],
        limits: tuple[FloatArray, FloatArray],
    ) -> FloatArray:
        """Return the target of a joint move, shape (joint,), in rad or m, as an array of its own.

        Raises
        ------
        DeviceError
            If it is beyond a lower or upper limit, or the speed is no part of the axis speeds.
        """
        target = self.vector("joint target", q, len(names))
        for name, value, low, high in zip(names, target, *limits, strict=True):
            self.require(
                low <= value <= high, f"joint target {name}", value, f"{low:g} to {high:g}"
            )
        self.require(0.0 < speed <= 1.0, "speed", speed, "a part of the axis speeds in (0, 1]")
        return target

    def line(self, what: str, direction: FloatArray, distance: float, speed: float) -> FloatArray:
        """Return the direction of a straight move, shape (3,), of length 1 exactly.

        Raises
        ------
        DeviceError
            If it is no unit vector, or distance or speed is not above 0 and finite.
        """
        array = self.vector(f"{what} direction", direction, 3)
        length = float(np.linalg.norm(array))
        self.require(abs(length - 1.0) <= _UNIT, f"length of the {what} direction", length, "1")
        finite = "above 0 {} and finite"
        self.require(0.0 < distance < math.inf, f"{what} distance", distance, finite.format("m"))
        self.require(0.0 < speed < math.inf, f"{what} speed", speed, finite.format("m/s"))
        return array / length


def require_duration(seconds: float) -> None:
    """Refuse a sleep that is negative or not finite.

    Raises
    ------
    DeviceError
        With the time.
    """
    if not 0.0 <= seconds < math.inf:
        raise DeviceError(f"sleep of {seconds!r} s: must be 0 or more, and finite")


class Clock(Protocol):
    """Seconds that only go forward. Nothing in the procedure asks any other clock."""

    def now(self) -> float:
        """Return the time in s since an origin of the clock's own."""

    def sleep(self, seconds: float) -> None:
        """Wait while the devices go on."""


class SensorStatus(Enum):
    """State of the sensor over a block of samples; the worst of them."""

    OK = "ok"
    SATURATED = "saturated"
    """A gauge or the range of an axis is exceeded: the values are not to be used."""
    FAULT = "fault"
    """The device says that it cannot measure."""


@brief_repr
@dataclass(frozen=True, eq=False)
class WrenchBlock:
    """Samples since the last look, as the sensor measures them.

    Raw: in the sensor's own frame, bias and tool weight still in. An empty block means that
    nothing has come.
    """

    time: FloatArray
    """Shape (sample,), in s of the clock, ascending."""
    force: FloatArray
    """Force on the tool side, shape (sample, 3), sensor frame, in N."""
    moment: FloatArray
    """Moment about the sensor's origin, shape (sample, 3), in N·m."""
    force_sigma: float
    """Standard deviation of one sample and axis, in N; NaN when the maker does not say."""
    moment_sigma: float
    """The same of the moment, in N·m."""
    status: SensorStatus
    source: str

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.time)


class ForceSensor(Protocol):
    """A six-axis sensor between flange and tool."""

    @property
    def rate(self) -> float:
        """Nominal number of samples a second."""

    def read(self) -> WrenchBlock:
        """Return the samples since the last call; the newest few hundred when there are more.

        Returns at once, empty when nothing has come.
        """


class BeamState(Enum):
    """Whether the instrument sees the marker."""

    LOCKED = "locked"
    BROKEN = "broken"


@brief_repr
@dataclass(frozen=True, eq=False)
class PointBlock:
    """Marker positions since the last look, in the station's own frame."""

    time: FloatArray
    """Shape (sample,), in s of the clock, ascending."""
    position: FloatArray
    """Shape (sample, 3), in m, tracker frame."""
    sigma: FloatArray
    """Standard deviation of one sample along each axis of the tracker frame, shape (sample, 3),
    in m; NaN when the maker does not say."""
    beam: BeamState
    """State of the beam at the end of the block."""
    station: str
    """Station that measures."""
    source: str
    note: str = ""
    """Why the beam is broken, where the device says so."""

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.time)


class Metrology(Protocol):
    """One or several stations; at any time one of them measures."""

    @property
    def stations(self) -> tuple[str, ...]:
        """Names of the stations."""

    @property
    def rate(self) -> float:
        """Nominal number of samples a second."""

    def look(self, station: str) -> None:
        """Measure with this station from now on, and find the marker again if it was lost.

        Returns at once; `read` says whether it was found.
        """

    def read(self) -> PointBlock:
        """Return the positions since the last call, at once; none while the beam is broken."""


@runtime_checkable
class AskedMetrology(Metrology, Protocol):
    """Metrology that measures on request: a person reads the instrument."""

    def ask(self, what: str) -> None:
        """Ask for a reading of the marker, which stands still; returns at once.

        Until the reading arrives, the beam counts as broken; the reading then remains until the
        next request.

        Parameters
        ----------
        what : str
            Where in the procedure, for the person.
        """


def close_nothing() -> None:
    """Close nothing: the default for devices that hold neither line nor thread."""


def stack_nothing(disks: int) -> None:
    """Do nothing: the default of devices that are real."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Devices:
    """The devices of a run, with the clock that they share."""

    arm: RobotArm
    sensor: ForceSensor
    metrology: Metrology
    clock: Clock
    close: Callable[[], None] = close_nothing
    """Gives lines and threads back, at the end of a run, whatever happened."""
    lines: Callable[[], tuple[LineCounts, ...]] = no_lines
    """Function that returns the counts of the lines so far; never raises."""
    stack: Callable[[int], None] = stack_nothing
    """Takes note of the number of disks between tool and tooling: simulated cells stack them."""
