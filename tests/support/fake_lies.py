"""Devices of the fake cell that break their contract: they raise, or say what cannot be."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from support.fake_devices import WEIGHT, FakeCell

Change = Callable[[FakeCell], None]


def raising(device: str, method: str, error: Exception) -> Change:
    """Make a method of a device raise from now on."""

    def fail(*_: Any) -> Any:
        raise error

    return lambda cell: setattr(getattr(cell, device), method, fail)


def saying(device: str, method: str, changed: Callable[[Any], Any]) -> Change:
    """Change what a method of a device returns from now on."""

    def change(cell: FakeCell) -> None:
        true = getattr(getattr(cell, device), method)
        setattr(getattr(cell, device), method, lambda: changed(true()))

    return change


def scaled(device: str, factor: Any, *names: str) -> Change:
    """Multiply arrays of what a device says by something, mostly NaN, from now on."""
    return saying(
        device,
        "state" if device == "arm" else "read",
        lambda said: replace(said, **{name: getattr(said, name) * factor for name in names}),
    )


def both(*changes: Change) -> Change:
    """Make several changes at once."""

    def change(cell: FakeCell) -> None:
        for one in changes:
            one(cell)

    return change


def numb_arm(cell: FakeCell) -> None:
    """Take the arm's own feeling away: its guarded moves do not end at a force."""
    approach = cell.arm.approach
    cell.arm.approach = lambda way, distance, speed, _: approach(way, distance, speed, 1e9)


def numb_sensor(cell: FakeCell) -> None:
    """Let the sensor feel its tool and noise only."""
    sensor, read = cell.sensor, cell.sensor.read

    def feel() -> Any:
        block = read()
        return replace(block, force=WEIGHT + 1e-3 * (block.force - WEIGHT))

    sensor.read = feel
