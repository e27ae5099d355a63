"""The watchdog: look each cycle at what the devices say, and refuse to go on when it is wrong.

The order of the checks is that of trust. The arm comes first: when it has stopped, the rest follows
from that. Then the sensor, whether it lives and is within its range, before its force is compared
with a limit. Then the tool's place, and last the beam, whose loss spoils a reading but no tooling.
"""

import math
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import (
    ArmState,
    BeamState,
    CollisionWatch,
    Motion,
    PointBlock,
    SensorStatus,
    WrenchBlock,
)
from elastocal.procedure.run.routes import ApproachLine
from elastocal.procedure.run.steps import Fault, FaultError

_LOOK_AGAIN = 1.0
"""Time after which a tracker without the marker is sent another search command, in s."""
_MOST_LOOKED_AT = 20
"""Samples of a cycle that are looked at for a collision."""


@dataclass(frozen=True, eq=False, slots=True)
class Snapshot:
    """State and samples of every device in one cycle."""

    time: float
    arm: ArmState
    wrenches: WrenchBlock
    points: PointBlock
    force_tcp: FloatArray
    """Force on the robot in the tcp frame, tared, shape (sample, 3), in N."""


@dataclass(frozen=True, eq=False)
class Guard:
    """Conditions that must hold during a state, beyond live devices."""

    force: float = np.inf
    """Largest force, in N."""
    line: ApproachLine | None = None
    """Line that the tool must keep to."""
    beam: bool = False
    """Whether the marker must be seen."""
    pressing: bool = False
    """Whether the tool may press: a sensor that is overloaded then ends the run."""
    free: bool = False
    """Whether the tool moves through the air, so that it feels its weight alone."""


class Watchdog:
    """Remembers when each device last had news.

    Parameters
    ----------
    stale : float
        Oldest data that are trusted, in s.
    beam_timeout : float
        Longest time without beam, in s.
    collisions : CollisionWatch
        Collisions of free moves.
    R_tcp_sensor : ndarray, shape (3, 3)
        Axes of the sensor in the tcp frame.
    """

    def __init__(
        self,
        stale: float,
        beam_timeout: float,
        collisions: CollisionWatch,
        R_tcp_sensor: FloatArray,
    ) -> None:
        self.collisions, self._R_tcp_sensor = collisions, R_tcp_sensor
        self._stale, self._beam_timeout = stale, beam_timeout
        self._sensor_time = self._last_sample = -np.inf
        self._changed = self._point_time = -np.inf
        self._row: tuple[float, ...] = ()
        self._lost_at: float | None = None
        self._looked_at = -np.inf
        self.station: str | None = None
        """Station that is to measure; None: any."""
        self.breaks = 0
        """Number of breaks of the beam so far."""

    def restart(self, now: float) -> None:
        """Give every device ``stale`` seconds from now to deliver data."""
        self._sensor_time = self._changed = now
        self.expect_points(now)

    def expect_points(self, now: float) -> None:
        """Give the tracker its time to find the marker, from now on."""
        self._point_time, self._lost_at, self._looked_at = now, None, now

    @property
    def sees(self) -> bool:
        """Whether the beam held in the last cycle in which it was required."""
        return self._lost_at is None

    def check(self, seen: Snapshot, guard: Guard) -> bool:
        """Refuse unsafe or missing data; return whether the tracker needs another search command.

        Raises
        ------
        FaultError
            With what is wrong.
        """
        self._check_arm(seen.arm, seen.time)
        self._check_sensor(seen.wrenches, seen.time, guard.pressing)
        self._check_force(seen.force_tcp, guard.force)
        if guard.free:
            self._check_collision(seen)
        if guard.line is not None:
            guard.line.check(seen.arm.T_base_tcp)
        return guard.beam and self._check_beam(seen.points, seen.time)

    def _check_arm(self, state: ArmState, now: float) -> None:
        if state.fault is not None or state.motion in (Motion.STOPPED, Motion.DISARMED):
            reason = state.fault or f"it is {state.motion.value}"
            raise FaultError(Fault.ARM_STOPPED, f"{state.source} says: {reason}")
        self._check_age(Fault.ARM_STALE, state.source, state.time, now)

    def _check_sensor(self, block: WrenchBlock, now: float, pressing: bool) -> None:
        if block.status is not SensorStatus.OK:
            fault = Fault.SENSOR_FAULT
            if block.status is SensorStatus.SATURATED:
                fault = Fault.SENSOR_OVERLOAD if pressing else Fault.SENSOR_SATURATED
            raise FaultError(fault, f"{block.source} says: {block.status.value}")
        if len(block):
            if not math.isfinite(block.moment.sum()):
                raise FaultError(Fault.SENSOR_FAULT, f"{block.source}: its moment is not finite")
            first = float(block.time[0])
            # Samples from an unsupervised period, such as a slow disk access, are not too early.
            if not first >= self._last_sample - self._stale:
                text = f"{block.source}: {first:.3f} s after {self._last_sample:.3f} s"
                raise FaultError(Fault.CLOCK, text)
            self._sensor_time = self._last_sample = float(block.time[-1])
            # A live sensor has noise. Values that stay equal to the last digit are those of a
            # frozen stream, which new time stamps would hide.
            row = (*block.force[-1].tolist(), *block.moment[-1].tolist())
            if row != self._row:
                self._row, self._changed = row, now
        self._check_age(Fault.SENSOR_STALE, block.source, self._sensor_time, now)
        if not now - self._changed <= self._stale:
            text = f"{block.source} repeats itself for {now - self._changed:.2f} s"
            raise FaultError(Fault.SENSOR_FROZEN, text)

    def _check_force(self, force_tcp: FloatArray, limit: float) -> None:
        if not len(force_tcp):
            return
        # A NaN passes through the maximum and then fails the comparison below.
        largest = float(np.sqrt((force_tcp * force_tcp).sum(axis=1).max()))
        if not largest <= limit:
            if np.isnan(largest):
                raise FaultError(Fault.SENSOR_FAULT, "it says NaN")
            raise FaultError(Fault.FORCE_LIMIT, f"{largest:.0f} N, limit {limit:.0f} N")

    def _check_collision(self, seen: Snapshot) -> None:
        block, R_base_tcp = seen.wrenches, seen.arm.T_base_tcp[:3, :3]
        R_base_sensor = R_base_tcp @ self._R_tcp_sensor
        # Samples are skipped so that a fast sensor, or a late cycle, does not prolong the cycle.
        for i in range(0, len(block), 1 + len(block) // _MOST_LOOKED_AT):
            hit = self.collisions.look(float(block.time[i]), block.force[i], R_base_sensor)
            if hit is not None:
                raise FaultError(Fault.COLLISION, hit)

    def _check_beam(self, block: PointBlock, now: float) -> bool:
        if block.beam is BeamState.LOCKED:
            self._lost_at = None
            if len(block):
                self._check_points(block, now)
                self._point_time = float(block.time[-1])
            self._check_age(Fault.TRACKER_STALE, block.source, self._point_time, now)
            return False
        # Without a beam there are no points: their age counts from its return.
        self._point_time = now
        if self._lost_at is None:
            self._lost_at, self._looked_at, self.breaks = now, now, self.breaks + 1
            return True
        if not now - self._lost_at <= self._beam_timeout:
            text = f"{block.station} sees no marker for {now - self._lost_at:.1f} s"
            raise FaultError(Fault.BEAM_LOST, f"{text}: {block.note}" if block.note else text)
        if now - self._looked_at >= _LOOK_AGAIN:
            self._looked_at = now
            return True
        return False

    def _check_points(self, block: PointBlock, now: float) -> None:
        if not math.isfinite(block.position.sum()):
            text = f"{block.source} is locked, but its positions are not finite"
            raise FaultError(Fault.TRACKER_FAULT, text)
        # Another station may deliver for a moment after the command to stop.
        late = now - self._looked_at > self._stale
        if late and self.station is not None and block.station != self.station:
            text = f"{block.source}: {block.station} measures, not {self.station}"
            raise FaultError(Fault.TRACKER_FAULT, text)

    def _check_age(self, fault: Fault, source: str, time: float, now: float) -> None:
        if not now - time <= self._stale:
            raise FaultError(fault, f"{source}: newest data are {now - time:.2f} s old")
        # Data from the future mean that two clocks disagree, so that no age can be trusted.
        if not time - now <= self._stale:
            raise FaultError(Fault.CLOCK, f"{source}: its time is {time - now:.2f} s ahead")


def check_arm(state: ArmState, joints: int) -> None:
    """Refuse a state that names no place.

    Parameters
    ----------
    state : ArmState
        State of the arm.
    joints : int
        Number of its joints.

    Raises
    ------
    FaultError
        With what is wrong.
    """
    for name, values, shape in (
        ("joint positions", state.q, (joints,)),
        ("tool frame", state.T_base_tcp, (4, 4)),
    ):
        if values.shape != shape:
            text = f"{state.source}: {name} of shape {values.shape}, not {shape}"
            raise FaultError(Fault.ARM_FAULT, text)
        if not math.isfinite(values.sum()):
            raise FaultError(Fault.ARM_FAULT, f"{state.source}: {name} are not finite numbers")


def check_wrenches(block: WrenchBlock) -> None:
    """Refuse a block whose samples are no wrenches or have no time.

    Raises
    ------
    FaultError
        With what is wrong.
    """
    fault = Fault.SENSOR_FAULT
    _check_rows(fault, block.source, block.time, {"forces": block.force, "moments": block.moment})


def check_points(block: PointBlock) -> None:
    """Refuse a block whose samples are no points or have no time.

    Raises
    ------
    FaultError
        With what is wrong.
    """
    rows = {"positions": block.position, "sigmas": block.sigma}
    _check_rows(Fault.TRACKER_FAULT, block.source, block.time, rows)


def _check_rows(fault: Fault, source: str, time: FloatArray, rows: dict[str, FloatArray]) -> None:
    if time.ndim != 1 or not math.isfinite(time.sum()):
        raise FaultError(fault, f"{source}: its times are not a row of finite numbers")
    for name, values in rows.items():
        if values.shape != (len(time), 3):
            text = f"{source}: {name} of shape {values.shape}, not {(len(time), 3)}"
            raise FaultError(fault, text)
