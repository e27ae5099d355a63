"""The operator and the devices that a run needs.

The person at the cell is an argument, never a question asked from below. `SOURCES` is the only
place that picks simulator or driver.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Protocol

from elastocal.cell import SIMULATED, Cell, DeviceNames, Devices
from elastocal.errors import DeviceError, ProcedureError, nearest
from elastocal.procedure import Progress as RunProgress

KINDS = tuple(DeviceNames.model_fields)
"""Kinds of device that a run needs."""


@dataclass(frozen=True)
class Supervision:
    """The operator's part while the arm moves."""

    show: Callable[[RunProgress], None]
    """Takes note of every step; never raises, never waits."""
    interrupted: Callable[[], bool]
    """Whether somebody wants the run to stop: it releases, retracts and stops."""


class Operator(Protocol):
    """The person at the cell."""

    def warn(self, lines: Sequence[str]) -> None:
        """Read what should be known before anything moves."""

    def confirm(self) -> None:
        """Agree that the cell is clear, or raise `ProcedureError`."""

    def supervise(self, poses: int) -> AbstractContextManager[Supervision]:
        """Watch while the arm moves to this number of poses."""


class Unattended:
    """Nobody: agrees to nothing, interrupts nothing, hears progress by the callable alone."""

    def warn(self, lines: Sequence[str]) -> None:
        """Read nothing."""

    def confirm(self) -> None:
        """Refuse.

        Raises
        ------
        ProcedureError
            Always.
        """
        raise ProcedureError("a person must confirm that the cell is clear: give --yes")

    @contextmanager
    def supervise(self, poses: int) -> Iterator[Supervision]:  # noqa: ARG002 - the protocol's form
        """Watch nothing."""
        yield Supervision(lambda _step: None, lambda: False)


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
