"""Measured force on the tool, and its retreat from a surface: the force must not grow.

The state in the driver is not used, since a killed process has lost it.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell, Clock, ForceSensor, Motion, RobotArm, SensorStatus, WrenchBlock
from elastocal.errors import DeviceError
from elastocal.procedure.run.steps import Fault, FaultError
from elastocal.results import brief_repr

WRONG_WEIGHT = 0.35
"""Part of the weight that may be missing: a mass a quarter off, with a tool turned by 90 deg."""
STRAIGHT_TOLERANCE = 1e-3
"""Largest distance of a straight motion's end from its target, in m."""
BIAS = 0.1
"""Bias of a sensor that is let pass, as a part of the force limit."""


@brief_repr
@dataclass(frozen=True, eq=False)
class ToolLoad:
    """Separation of a contact force from the tool's weight."""

    weight_base: FloatArray
    """Weight of the tool, base, shape (3,), in N; zero where no mass is stated."""
    R_tcp_sensor: FloatArray
    """Axes of the sensor in the tcp frame, shape (3, 3)."""
    force_limit: float
    """Force limit of the procedure, in N."""

    @classmethod
    def of(cls, cell: Cell) -> "ToolLoad":
        """Return that of a cell; without a sensor its axes are those of the tcp."""
        T_sensor_tcp = cell.T_sensor_tcp
        R = np.eye(3) if T_sensor_tcp is None else T_sensor_tcp[:3, :3].T
        return cls(cell.file.tool.mass * cell.gravity_base, R, cell.force_limit)

    @property
    def tolerance(self) -> float:
        """Largest force that a wrong mass and a bias explain, in N; infinite without a mass."""
        weight = float(np.linalg.norm(self.weight_base))
        return WRONG_WEIGHT * weight + BIAS * self.force_limit if weight > 0.0 else math.inf

    def beyond_weight(self, block: WrenchBlock, T_base_tcp: FloatArray) -> FloatArray | None:
        """Return the mean force on the robot less the tool's weight, base, shape (3,), in N.

        None where no sample of the block can be trusted.
        """
        if not len(block) or block.status is not SensorStatus.OK:
            return None
        force = block.force.mean(axis=0)
        if not np.isfinite(force).all():
            return None
        left: FloatArray = T_base_tcp[:3, :3] @ self.R_tcp_sensor @ force - self.weight_base
        return left


class LeavingWatch:
    """Watches the force while a tool leaves a surface along its normal.

    Parameters
    ----------
    load : ToolLoad
        What is taken for contact.
    normal : ndarray, shape (3,)
        Direction in which the tool leaves, base.
    limit : float
        Growth of the force that is a collision, in N.
    """

    def __init__(self, load: ToolLoad, normal: FloatArray, limit: float) -> None:
        self._load, self._normal, self._limit = load, normal, limit
        self._least = math.inf
        self.force: float | None = None
        """Force along the normal at the last look, in N; None as long as none can be trusted."""

    def look(self, block: WrenchBlock, T_base_tcp: FloatArray) -> None:
        """Refuse a force that grows, or that holds the tool back.

        Raises
        ------
        FaultError
            With both forces.
        """
        beyond = self._load.beyond_weight(block, T_base_tcp)
        if beyond is None:
            return
        self.force = along = float(beyond @ self._normal)
        self._least = min(self._least, along)
        if not along <= self._least + self._limit:
            text = f"it grew from {self._least:.0f} N to {along:.0f} N"
        elif not along >= -(self._load.tolerance + self._limit):
            text = f"{-along:.0f} N hold the tool back"
        else:
            return
        raise FaultError(
            Fault.COLLISION,
            f"the force while the tool leaves the surface: {text}, limit {self._limit:.0f} N",
        )


@dataclass(frozen=True)
class ForceTap:
    """A force sensor that may be absent or fail; neither ends anything."""

    sensor: ForceSensor | None
    load: ToolLoad

    def block(self) -> WrenchBlock | None:
        """Return the samples since the last look; None where there is no sensor to ask."""
        try:
            return None if self.sensor is None else self.sensor.read()
        except (DeviceError, OSError):
            return None

    def beyond_weight(self, arm: RobotArm, clock: Clock, seconds: float) -> FloatArray | None:
        """Return the last force that could be trusted within a time, as `ToolLoad` does."""
        found, end = None, clock.now() + seconds
        self.block()
        while clock.now() < end:
            clock.sleep(_LOOK)
            block = self.block()
            if block is not None:
                now = self.load.beyond_weight(block, arm.state().T_base_tcp)
                found = found if now is None else now
        return found


_LOOK = 0.04
"""Interval at which arm and force are read, in s."""


def leave_surface(
    devices: tuple[RobotArm, ForceTap, Clock],
    way: FloatArray,
    speed: float,
    watch: LeavingWatch,
    interrupted: Callable[[], bool],
) -> None:
    """Retract an enabled arm by a vector, base, shape (3,), in m, and wait for the end.

    Parameters
    ----------
    devices : tuple
        Arm, force and clock. Without a force sensor there is no supervision, and the speed must be
        low.
    way : ndarray, shape (3,)
        Base, in m.
    speed : float
        In m/s.
    watch : LeavingWatch
        Refuses a force that grows.
    interrupted : callable
        Whether a person asked to stop.

    Raises
    ------
    FaultError
        If the force grows, the arm stops, or takes too long; the arm has been stopped.
    DeviceError
        If the arm does not answer.
    """
    arm, force, clock = devices
    distance, start = float(np.linalg.norm(way)), arm.state().T_base_tcp[:3, 3].copy()
    end = clock.now() + 2.0 * distance / speed + _PATIENCE
    arm.retract(way / distance, distance, speed)
    try:
        while True:
            clock.sleep(_LOOK)
            state, block = arm.state(), force.block()
            if block is not None:
                watch.look(block, state.T_base_tcp)
            gone = float(np.linalg.norm(state.T_base_tcp[:3, 3] - start))
            if state.motion is Motion.IDLE and gone > distance - STRAIGHT_TOLERANCE:
                return
            if state.fault is not None or state.motion is Motion.STOPPED:
                reason = state.fault or state.motion.value
                raise FaultError(Fault.ARM_STOPPED, f"{state.source} says: {reason}")
            if interrupted():
                raise FaultError(Fault.INTERRUPTED)
            if not clock.now() <= end:
                raise FaultError(Fault.TIME_LIMIT, f"{1e3 * gone:.1f} mm of {1e3 * distance:.1f}")
    except BaseException:
        arm.stop()
        raise


_PATIENCE = 10.0
"""Time that a retract may take beyond twice its own, in s."""
