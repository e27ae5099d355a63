"""A cell of almost nothing: a Cartesian arm over a flat spring, a sensor, a tracker, a clock.

The joints are the coordinates of the tool centre point. Everything repeats itself: what the
devices say depends on the time since the arm was last sent to a pose and not on what was before.
Faults are scripted by pose, motion and time; every command and force is remembered.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from elastocal.cell.devices import (
    ArmState,
    BeamState,
    Devices,
    Motion,
    PointBlock,
    SensorStatus,
    WrenchBlock,
)
from elastocal.errors import DeviceError

DOWN = np.diag([1.0, -1.0, -1.0])
"""Tool frame in base: z into the floor."""
R_BASE_TRACKER = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])
RATE = 100.0
STIFFNESS = 1e6
"""Of the floor, in N/m."""
WEIGHT = np.array([3.0, -2.0, 588.0])
"""Of the tool and bias, sensor frame, in N."""
BLOCK = 0.01
NOISE = np.random.default_rng(7).standard_normal((9973, 3)).clip(-3.0, 3.0)


class FakeClock:
    """Whole microseconds; whatever listens is moved along in steps of one sample."""

    def __init__(self, start: float = 0.0) -> None:
        self.ticks = round(start * 1e6)
        self.stands = False
        self.listeners: list[Callable[[], None]] = []

    def now(self) -> float:
        return self.ticks / 1e6

    def sleep(self, seconds: float) -> None:
        if self.stands:
            return
        for _ in range(round(seconds / BLOCK)):
            self.ticks += round(BLOCK * 1e6)
            for listener in self.listeners:
                listener()


@dataclass
class World:
    """The arm, the floor, and what is wrong."""

    clock: FakeClock
    q: np.ndarray
    floor: float = 0.0
    """Height of the surface, in m."""
    motion: Motion = Motion.DISARMED
    in_contact: bool = False
    fault: str | None = None
    target: np.ndarray = field(default_factory=lambda: np.zeros(3))
    speed: float = 0.0
    guard: float = math.inf
    force: np.ndarray = field(default_factory=lambda: np.zeros(3))
    wanted: np.ndarray = field(default_factory=lambda: np.zeros(3))
    ramp: float = 0.0
    hit: np.ndarray = field(default_factory=lambda: np.zeros(3))
    """Force of what the tool has run into, in N."""
    aside: float = 0.0
    """Slip so far, in m."""
    since: int = 0
    """Ticks since the arm was last sent to a pose."""
    place: int = 0
    """Which pose that was, as a number that seeds the noise."""
    beam: BeamState = BeamState.LOCKED
    runaway: float = 0.0
    """Rate at which the force grows by itself, in N/s."""
    wobble: float = 0.0
    """Amplitude of a force that never settles, in N."""
    commands: list[str] = field(default_factory=list)
    contacts_kept: int = 0
    """How often a move or another approach was begun without a retract after contact."""
    largest_force: float = 0.0
    faults: list[Callable[["World"], None]] = field(default_factory=list)
    holds: int = 0
    """Load cases since the last move in joint space."""
    visits: int = 0
    """Moves in joint space so far."""

    def __post_init__(self) -> None:
        self.clock.listeners.append(self.tick)

    @property
    def age(self) -> float:
        """Time since the arm was last sent to a pose, in s."""
        return (self.clock.ticks - self.since) / 1e6

    def tick(self) -> None:
        for change in tuple(self.faults):
            change(self)
        if self.fault is not None and self.motion is not Motion.DISARMED:
            self.motion = Motion.STOPPED
        moves = {
            Motion.MOVING: self._travel,
            Motion.RETRACTING: self._travel,
            Motion.APPROACHING: self._approach,
            Motion.HOLDING: self._press,
            Motion.RELEASING: self._release,
        }
        moves.get(self.motion, lambda: None)()
        self.largest_force = max(self.largest_force, math.hypot(*self.force.tolist()))

    def _travel(self) -> None:
        self._step_towards()
        self._let_go()

    def _let_go(self) -> None:
        if self.q[2] > self.floor:
            self.force = np.zeros(3)

    def _step_towards(self) -> None:
        way = self.target - self.q
        length, step = math.hypot(*way.tolist()), self.speed * BLOCK
        if length <= step:
            self.q = self.target.copy()
            if self.motion is Motion.RETRACTING:
                self.in_contact = False
            self.motion = Motion.IDLE
        else:
            self.q = self.q + way * (step / length)

    def _approach(self) -> None:
        self._step_towards()
        depth = self.floor - self.q[2]
        self.force = np.array([0.0, 0.0, -max(depth, 0.0) * STIFFNESS])
        if -self.force[2] >= self.guard:
            self.in_contact, self.motion = True, Motion.IDLE

    def _press(self) -> None:
        self.force = _towards(self.force, self.wanted, self.ramp * BLOCK)
        if self.runaway:
            self.wanted = self.wanted * 1.5
        self.q[2] = self.floor + self.force[2] / STIFFNESS

    def _release(self) -> None:
        self.force = _towards(self.force, np.zeros(3), self.ramp * BLOCK)
        self.q[2] = self.floor + self.force[2] / STIFFNESS
        if not self.force.any():
            self.motion = Motion.IDLE


def _towards(value: np.ndarray, goal: np.ndarray, step: float) -> np.ndarray:
    way = goal - value
    length = math.hypot(*way.tolist())
    return goal.copy() if length <= step else value + way * (step / length)


class FakeArm:
    """Refuses what the contract refuses."""

    joint_names = ("x", "y", "z")

    def __init__(self, world: World) -> None:
        self.world = world
        self.silent_since: float | None = None
        self.deaf = False

    def state(self) -> ArmState:
        w = self.world
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = DOWN, w.q
        time = w.clock.now() if self.silent_since is None else self.silent_since
        return ArmState(time, w.q.copy(), T, w.motion, w.in_contact, w.fault, "arm")

    def enable(self) -> None:
        self._listen("enable")
        if self.world.fault is not None:
            raise DeviceError(f"arm: enable is refused: {self.world.fault}")
        self.world.motion = Motion.IDLE

    def disable(self) -> None:
        self._listen("disable")
        self.world.motion = Motion.DISARMED

    def move_joints(self, q: np.ndarray, speed: float) -> None:
        self._command("move", Motion.IDLE)
        w = self.world
        w.contacts_kept += w.in_contact
        w.target, w.speed, w.motion = np.array(q), speed, Motion.MOVING
        w.since, w.place, w.holds = w.clock.ticks, hash(tuple(np.round(q, 9))), 0
        w.visits, w.aside = w.visits + 1, 0.0

    def adopt_position(self) -> None:
        self._command("adopt_position", Motion.IDLE)

    def approach(
        self, direction_base: np.ndarray, distance: float, speed: float, contact_force: float
    ) -> None:
        self._command("approach", Motion.IDLE)
        w = self.world
        w.contacts_kept += w.in_contact
        w.target, w.speed, w.guard = w.q + distance * direction_base, speed, contact_force
        w.motion = Motion.APPROACHING

    def hold(self, force_tcp: np.ndarray, rate: float) -> None:
        self._command("hold", Motion.IDLE, Motion.HOLDING)
        w = self.world
        w.wanted, w.ramp, w.motion, w.holds = np.array(force_tcp), rate, Motion.HOLDING, w.holds + 1

    def release(self, rate: float) -> None:
        self._command("release", Motion.IDLE, Motion.HOLDING)
        self.world.ramp, self.world.motion = rate, Motion.RELEASING

    def retract(self, direction_base: np.ndarray, distance: float, speed: float) -> None:
        self._command("retract", Motion.IDLE)
        w = self.world
        w.target, w.speed = w.q + distance * direction_base, speed
        w.motion = Motion.RETRACTING

    def stop(self) -> None:
        self._listen("stop")
        if self.world.motion is not Motion.DISARMED:
            self.world.motion = Motion.STOPPED

    def _listen(self, command: str) -> None:
        if self.deaf:
            raise DeviceError("arm: the line is dead")
        self.world.commands.append(command)

    def _command(self, command: str, *allowed: Motion) -> None:
        self._listen(command)
        if self.world.motion not in allowed:
            raise DeviceError(f"arm: {command} is refused while it is {self.world.motion.value}")


class _Sampled:
    """Samples since the last look, on the grid of the rate."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.times: list[int] = []
        self.silent = False
        world.clock.listeners.append(self.tick)

    def tick(self) -> None:
        if not self.silent:
            self.sample()

    def noise(self, channel: int) -> np.ndarray:
        """Numbers about 0 that depend on the pose and the time since it was chosen."""
        w = self.world
        key = (w.clock.ticks - w.since) // 10_000 * 31 + channel * 1009 + w.place
        return NOISE[key % len(NOISE)]


class FakeSensor(_Sampled):
    """Its axes are those of the tool."""

    rate = RATE

    def __init__(self, world: World) -> None:
        super().__init__(world)
        self.forces: list[np.ndarray] = []
        self.newest = WEIGHT
        self.status = SensorStatus.OK
        self.frozen = False

    def sample(self) -> None:
        w = self.world
        self.times.append(w.clock.ticks)
        force = w.force + w.hit + WEIGHT + 0.5 * self.noise(1)
        if w.motion is Motion.HOLDING:
            force = force + np.array([0.0, 0.0, w.wobble * math.sin(9.0 * w.age)])
        if not self.frozen:
            self.newest = force
        self.forces.append(self.newest)

    def read(self) -> WrenchBlock:
        force = np.array(self.forces).reshape(-1, 3)
        block = WrenchBlock(
            np.array(self.times) / 1e6, force, force * 0.1, 0.5, 0.05, self.status, "sensor"
        )
        self.times, self.forces = [], []
        return block


class FakeTracker(_Sampled):
    """Sees the marker 0.1 m above the tool centre point; the arm bends by 1 um/N."""

    rate = RATE
    stations = ("station_1",)

    def __init__(self, world: World) -> None:
        super().__init__(world)
        self.points: list[np.ndarray] = []
        self.sigma = 20e-6
        self.looks = 0
        self.finds = True

    def look(self, station: str) -> None:
        assert station in self.stations
        self.looks += 1
        if self.finds:
            self.world.beam = BeamState.LOCKED

    def sample(self) -> None:
        w = self.world
        if w.beam is BeamState.BROKEN:
            return
        self.times.append(w.clock.ticks)
        marker = w.q + [w.aside, 0.0, 0.1] + 1e-6 * (DOWN @ w.force) + self.sigma * self.noise(2)
        self.points.append(R_BASE_TRACKER.T @ marker)

    def read(self) -> PointBlock:
        position = np.array(self.points).reshape(-1, 3)
        sigma = np.full_like(position, self.sigma)
        block = PointBlock(
            np.array(self.times) / 1e6, position, sigma, self.world.beam, "station_1", "tracker"
        )
        self.times, self.points = [], []
        return block


@dataclass
class FakeCell:
    """All devices with what they share."""

    world: World
    arm: FakeArm
    sensor: FakeSensor
    tracker: FakeTracker

    @property
    def devices(self) -> Devices:
        return Devices(self.arm, self.sensor, self.tracker, self.world.clock)


def fake_cell(home: tuple[float, ...], start: float = 0.0) -> FakeCell:
    """Return fresh devices; the arm stands at HOME, disarmed."""
    world = World(FakeClock(start), np.array(home))
    return FakeCell(world, FakeArm(world), FakeSensor(world), FakeTracker(world))
