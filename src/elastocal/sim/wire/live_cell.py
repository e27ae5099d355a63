"""The simulated cell, alive: it goes on with another clock, and threads may look into it."""

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import (
    ArmState,
    Cell,
    Clock,
    ForceSensor,
    Metrology,
    PointBlock,
    RobotArm,
    SensorStatus,
    WrenchBlock,
    WrenchSample,
)
from elastocal.sim.workcell import SimulatedCell

_BLOCKS = 512
"""Blocks kept for a tap that is not read; older ones are lost."""
_Result = TypeVar("_Result")
_Block = TypeVar("_Block", WrenchBlock, PointBlock)


class LiveCell:
    """The simulated plant under a lock, moved along by a clock.

    Whoever asks anything first lets pass what has passed meanwhile. Sensor and tracker may have
    several readers: each gets all samples, none takes them away from another.
    """

    def __init__(self, cell: Cell, seed: int, clock: Clock) -> None:
        """Set the cell up, the arm at HOME with its drives off.

        Raises
        ------
        DeviceError
            If the cell cannot be simulated; see `elastocal.sim.workcell.simulated_devices`.
        """
        self.cell, self.clock = cell, clock
        self.sim = SimulatedCell.of(cell, seed, clock.now())
        """The cell; look into it by `apart` alone."""
        self._lock = threading.RLock()
        self._newest: WrenchSample | None = None
        self._wrenches: list[_LiveSensor] = []
        self._points: list[_LiveTracker] = []

    def apart(self, act: Callable[[SimulatedCell], _Result]) -> _Result:
        """Call a function with exclusive access to the present cell; return its result.

        Parameters
        ----------
        act : callable
            From the simulated cell, at the time of the clock.
        """
        with self._lock:
            self._advance()
            return act(self.sim)

    def stack(self, disks: int) -> None:
        """Let so many disks be stacked between tool and tooling, from the next contact on."""
        self.apart(lambda sim: sim.devices.stack(disks))

    def _advance(self) -> None:
        sim_clock = self.sim.devices.clock
        behind = self.clock.now() - sim_clock.now()
        if behind > 0.0:
            sim_clock.sleep(behind)
        wrenches, points = self.sim.sensor.read(), self.sim.devices.metrology.read()
        if len(wrenches):
            last = (wrenches.force[-1], wrenches.moment[-1], wrenches.status)
            self._newest = WrenchSample(float(wrenches.time[-1]), *last)
        for sensor in self._wrenches:
            sensor.add(wrenches)
        for tracker in self._points:
            tracker.add(points)

    def arm(self) -> RobotArm:
        """Return the arm; any number of threads may command it."""
        return _LiveArm(self)

    def sensor(self) -> ForceSensor:
        """Return a sensor with a queue of its own, from now on."""
        sensor = _LiveSensor(self)
        self.apart(lambda _: self._wrenches.append(sensor))
        return sensor

    def metrology(self) -> Metrology:
        """Return the tracker with a queue of its own, from now on; its stations are shared."""
        tracker = _LiveTracker(self)
        self.apart(lambda _: self._points.append(tracker))
        return tracker

    def wrench(self) -> WrenchSample | None:
        """Return the newest sample of the force sensor; None before the first."""
        return self.apart(lambda _: self._newest)

    newest = wrench
    """Newest sample, as in `WrenchFeed`."""

    def marker(self) -> FloatArray:
        """Return the true position of the marker, in base, shape (3,), in m."""

        def seen(sim: SimulatedCell) -> FloatArray:
            now = np.array([sim.plant.now])
            marker: FloatArray = sim.plant.segment.seen(now)[0, :3].copy()
            return marker

        return self.apart(seen)

    def press(self) -> "TruePress":
        """Return the true position and force of the tool."""

        def seen(sim: SimulatedCell) -> TruePress:
            segment = sim.plant.segment
            knots, part = segment.path.knots, np.array([segment.progress(sim.plant.now)])
            q, force = knots.at(knots.q, part)[0], knots.at(knots.force, part)[0]
            tool = sim.plant.statics.robot.forward(q)[:3, 3]
            return TruePress(1e-6 * sim.plant.now, tool.copy(), force.copy())

        return self.apart(seen)


class TruePress(NamedTuple):
    """Truth of a press."""

    time: float
    """In s of the cell's clock."""
    tool: FloatArray
    """Commanded position of the tool centre point, in base, shape (3,), in m."""
    force: FloatArray
    """Force on the robot, in base, shape (3,), in N."""


class _Tap(Generic[_Block]):
    """Blocks that one reader has not seen yet."""

    def __init__(self, live: LiveCell) -> None:
        self._live = live
        self._blocks: deque[_Block] = deque(maxlen=_BLOCKS)

    def add(self, block: _Block) -> None:
        """Keep a block; the oldest is lost where too many wait."""
        self._blocks.append(block)

    def take(self) -> list[_Block]:
        """Return the blocks since the last call, at least one, and forget them."""

        def take(_: SimulatedCell) -> list[_Block]:
            blocks = list(self._blocks)
            self._blocks.clear()
            return blocks

        return self._live.apart(take)


class _LiveSensor(_Tap[WrenchBlock]):
    """See `elastocal.cell.devices.ForceSensor`."""

    @property
    def rate(self) -> float:
        return self._live.sim.sensor.rate

    def read(self) -> WrenchBlock:
        blocks = self.take()
        saturated = any(block.status is SensorStatus.SATURATED for block in blocks)
        return replace(
            blocks[-1],
            time=np.concatenate([block.time for block in blocks]),
            force=np.concatenate([block.force for block in blocks]),
            moment=np.concatenate([block.moment for block in blocks]),
            status=SensorStatus.SATURATED if saturated else blocks[-1].status,
        )


class _LiveTracker(_Tap[PointBlock]):
    """See `elastocal.cell.devices.Metrology`."""

    @property
    def stations(self) -> tuple[str, ...]:
        return self._live.sim.devices.metrology.stations

    @property
    def rate(self) -> float:
        return self._live.sim.devices.metrology.rate

    def look(self, station: str) -> None:
        self._live.apart(lambda sim: sim.devices.metrology.look(station))

    def read(self) -> PointBlock:
        blocks = self.take()
        last = blocks[-1]
        # What another station has seen is in another frame.
        blocks = [block for block in blocks if block.station == last.station]
        return replace(
            last,
            time=np.concatenate([block.time for block in blocks]),
            position=np.concatenate([block.position for block in blocks]),
            sigma=np.concatenate([block.sigma for block in blocks]),
        )


class _LiveArm:
    """See `elastocal.cell.devices.RobotArm`."""

    def __init__(self, live: LiveCell) -> None:
        self._live = live

    @property
    def joint_names(self) -> tuple[str, ...]:
        return self._live.sim.arm.joint_names

    def state(self) -> ArmState:
        return self._live.apart(lambda sim: sim.arm.state())

    def enable(self) -> None:
        self._live.apart(lambda sim: sim.arm.enable())

    def disable(self) -> None:
        self._live.apart(lambda sim: sim.arm.disable())

    def stop(self) -> None:
        self._live.apart(lambda sim: sim.arm.stop())

    def move_joints(self, q: FloatArray, speed: float) -> None:
        self._live.apart(lambda sim: sim.arm.move_joints(q, speed))

    def adopt_position(self) -> None:
        self._live.apart(lambda sim: sim.arm.adopt_position())

    def approach(
        self, direction_base: FloatArray, distance: float, speed: float, contact_force: float
    ) -> None:
        goal = (direction_base, distance, speed, contact_force)
        self._live.apart(lambda sim: sim.arm.approach(*goal))

    def hold(self, force_tcp: FloatArray, rate: float) -> None:
        self._live.apart(lambda sim: sim.arm.hold(force_tcp, rate))

    def release(self, rate: float) -> None:
        self._live.apart(lambda sim: sim.arm.release(rate))

    def retract(self, direction_base: FloatArray, distance: float, speed: float) -> None:
        self._live.apart(lambda sim: sim.arm.retract(direction_base, distance, speed))
