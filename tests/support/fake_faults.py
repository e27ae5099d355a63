"""Faults for the fake cell; each gives a function that a `FakeRun` prepares its devices with."""

from collections.abc import Callable
from functools import partial

import numpy as np

from elastocal.cell.devices import BeamState, Motion, SensorStatus
from support.fake_devices import FakeCell, World

Prepare = Callable[[FakeCell], None]
Change = Callable[[FakeCell], None]


def when(condition: Callable[[World], bool], change: Change, times: int = 1) -> Prepare:
    """Make a change at each of the first moments at which a condition begins to hold."""

    def prepare(cell: FakeCell) -> None:
        left, held = times, False

        def check(world: World) -> None:
            nonlocal left, held
            holds = condition(world)
            if holds and not held and left:
                left -= 1
                change(cell)
            held = holds

        cell.world.faults.append(check)

    return prepare


def once(cell: FakeCell, condition: Callable[[World], bool], change: Callable[[], None]) -> None:
    """Make a change the next time that a condition holds."""

    def check(world: World) -> None:
        if condition(world):
            world.faults.remove(check)
            change()

    cell.world.faults.append(check)


def pressing(hold: int = 1) -> Callable[[World], bool]:
    """While a load case is held with its full force; the first of a visit by default."""
    return lambda w: (
        w.motion is Motion.HOLDING and w.holds == hold and bool(np.all(w.force == w.wanted))
    )


def ramping(world: World) -> bool:
    return world.motion is Motion.HOLDING and 50.0 < -world.force[2] < 250.0


def approaching(world: World) -> bool:
    """On the way to near contact."""
    return world.motion is Motion.APPROACHING and world.q[2] > 0.01


def engaging(world: World) -> bool:
    return world.motion is Motion.APPROACHING and world.q[2] < 0.002


def retracting(world: World) -> bool:
    return world.motion is Motion.RETRACTING and world.q[2] > 0.01


def near(world: World) -> bool:
    """Standing where the unloaded reference is taken."""
    return world.motion is Motion.IDLE and 0.001 < world.q[2] < 0.01


def moving(world: World) -> bool:
    return world.motion is Motion.MOVING and world.age > 0.1


def hit_something(cell: FakeCell) -> None:
    cell.world.hit = np.array([220.0, 0.0, 0.0])


def break_beam(seconds: float = np.inf) -> Change:
    """Break the beam; the tracker finds the marker again when it looks after some time."""

    def change(cell: FakeCell) -> None:
        world, end = cell.world, cell.world.clock.now() + seconds
        world.beam, cell.tracker.finds = BeamState.BROKEN, False
        mend = partial(setattr, cell.tracker, "finds", True)
        once(cell, lambda world: world.clock.now() >= end, mend)

    return change


def silence_sensor(cell: FakeCell) -> None:
    cell.sensor.silent = True


def freeze_sensor(cell: FakeCell) -> None:
    cell.sensor.frozen = True


def saturate_sensor(cell: FakeCell) -> None:
    """For a tenth of a second."""
    sensor, end = cell.sensor, cell.world.clock.now() + 0.1
    sensor.status = SensorStatus.SATURATED
    recover = partial(setattr, sensor, "status", SensorStatus.OK)
    once(cell, lambda world: world.clock.now() > end, recover)


def break_sensor(cell: FakeCell) -> None:
    cell.sensor.status = SensorStatus.FAULT


def silence_tracker(cell: FakeCell) -> None:
    cell.tracker.silent = True


def silence_arm(cell: FakeCell) -> None:
    cell.arm.silent_since = cell.world.clock.now()


def stop_arm(cell: FakeCell) -> None:
    cell.world.fault = "safety gate opened"


def deafen_arm(cell: FakeCell) -> None:
    cell.arm.deaf = True


def stop_clock(cell: FakeCell) -> None:
    cell.world.clock.stands = True


def slip(cell: FakeCell) -> None:
    """Slide by a millimetre at once."""
    cell.world.aside += 1e-3


def wobble(cell: FakeCell) -> None:
    """Keep this load case from settling."""
    world, holds = cell.world, cell.world.holds
    world.wobble = 40.0
    calm = partial(setattr, world, "wobble", 0.0)
    once(cell, lambda w: w.holds != holds or w.motion is not Motion.HOLDING, calm)


def run_away(cell: FakeCell) -> None:
    cell.world.runaway = 1.0


def lower_floor(cell: FakeCell) -> None:
    """Take the surface away under one visit."""
    _move_floor(cell, -0.5)


def raise_floor(cell: FakeCell) -> None:
    """Put something on the surface during one visit, while the tool is above it."""
    if cell.world.q[2] > 0.025:
        _move_floor(cell, 0.02)


def _move_floor(cell: FakeCell, height: float) -> None:
    world, visits = cell.world, cell.world.visits
    world.floor = height
    once(cell, lambda w: w.visits != visits, partial(setattr, world, "floor", 0.0))


def shake(cell: FakeCell) -> None:
    """Make the tracker noisy for good."""
    cell.tracker.sigma = 1e-3
