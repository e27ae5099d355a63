"""The devices that a cell file can name: the only place that picks simulator or driver."""

from collections.abc import Callable
from dataclasses import dataclass

from elastocal.cell import SIMULATED, Cell, DeviceNames, Devices
from elastocal.errors import DeviceError, nearest

KINDS = tuple(DeviceNames.model_fields)
"""Kinds of device that a run needs."""


@dataclass(frozen=True)
class DeviceSource:
    """Where devices come from."""

    make: Callable[[Cell, int, float], Devices]
    """From cell, seed and the time at which the clock starts, in s."""
    real: bool
    """Whether something moves that can hurt: a person is asked first."""


def _simulated(cell: Cell, seed: int, start: float) -> Devices:
    from elastocal.sim.workcell import simulated_devices

    return simulated_devices(cell, seed, start)


SOURCES: dict[str, DeviceSource] = {SIMULATED: DeviceSource(_simulated, real=False)}
"""Sources by name. A source makes arm, sensor and metrology, as they share a clock."""


def device_source(cell: Cell) -> DeviceSource:
    """Return the source of the devices that a cell names.

    Raises
    ------
    DeviceError
        If a name is not known, or the devices are of different sources.
    """
    named = {kind: getattr(cell.file.devices, kind) for kind in KINDS}
    for kind, name in named.items():
        if name not in SOURCES:
            raise DeviceError(
                f"{cell.path}: devices.{kind}: {name!r} is not configured"
                f"{nearest(name, SOURCES)} (known: {', '.join(SOURCES)})"
            )
    if len(set(named.values())) > 1:
        parts = ", ".join(f"{kind} is {name!r}" for kind, name in named.items())
        raise DeviceError(
            f"{cell.path}: devices must be of one source, as they share a clock; {parts}"
        )
    return SOURCES[named["arm"]]
