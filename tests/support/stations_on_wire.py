"""Trackers on the wire for tests: one clock that a test moves along, no waiting for deadlines."""

import time
from collections.abc import Callable

from elastocal.cell import Cell, DeviceSet, Driver, PointBlock, RigContext
from elastocal.sim.workcell import SimClock

_TRIES = 2000
_PAUSE = 0.005
_STEP = 0.02


def connect(driver: Driver, cell: Cell, clock: SimClock, **settings: object) -> DeviceSet:
    """Return the metrology of a driver, by the settings as a cell file has them."""
    model = driver.settings("metrology").model_validate(settings)
    return driver.connect(cell, {"metrology": model}, RigContext(clock, 0, clock.now(), None))


def read_until(
    devices: DeviceSet, clock: SimClock, wanted: Callable[[PointBlock], bool]
) -> PointBlock:
    """Return the first block that is as wanted, letting time pass slowly meanwhile."""
    block = None
    for number in range(_TRIES):
        block = devices.metrology.read()
        if wanted(block):
            return block
        if number % 4 == 3:
            clock.sleep(_STEP)
        time.sleep(_PAUSE)
    raise AssertionError(f"never as wanted; last: {block.beam}, {len(block)} points, {block.note}")
