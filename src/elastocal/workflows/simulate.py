"""``simulate``: the simulated cell on the wire, as its controllers, sensors and trackers speak."""

import contextlib
import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Annotated

from elastocal.cell import LOOPBACK, SIMULATED, WallClock, load_cell
from elastocal.errors import DeviceError, nearest
from elastocal.options import Option
from elastocal.progress import Progress
from elastocal.records import record, write_json
from elastocal.results import Result, brief_repr
from elastocal.sim import truth_of
from elastocal.sim.wire import LiveCell, Told, WireServer, suited_servers, wire_servers
from elastocal.workflows._device_locks import devices_to_oneself
from elastocal.workflows._operator_and_devices import Rig, rig_of
from elastocal.workflows._workflow import workflow


@brief_repr
@dataclass(frozen=True)
class SimulateSettings:
    """Settings of ``simulate``: the cell and the duration."""

    cell: Annotated[str | PathLike[str], Option(argument=True)]
    """Cell file, ``.yaml``."""
    out: Annotated[Path | None, Option("--ports", metavar="FILE")] = None
    """JSON file for the ports; none: they are only returned."""
    devices: Annotated[
        tuple[str, ...],
        Option(
            read="list", help="Drivers to answer, with commas; default: those of the cell file."
        ),
    ] = ()
    """Drivers whose devices are served; by default those that the cell file names, and where it
    names none but simulated ones all that can carry its robot."""
    rate: float | None = None
    """Seconds of the cell a second of the wall; by default `clock_rate` of the cell file."""
    seed: Annotated[int | None, Option(least=0)] = None
    """Seed; by default the cell's."""
    force: bool = False
    """Replace a file that is no former output of this command."""
    meanwhile: Callable[["SimulateResult"], None] = lambda found: found.wait()
    """Function that runs while the servers answer; they close when it returns. By default: wait for
    Ctrl-C."""


@brief_repr
@record("elastocal.ports/1")
class Ports:
    """The file of ``simulate --ports``."""

    address: str
    ports: dict[str, dict[str, int]]
    """Number of the port, by protocol, by driver."""


@dataclass(frozen=True, eq=False, repr=False)
class SimulateResult(Result):
    """Addresses of the devices of a simulated cell."""

    cell: str
    rate: float
    ports: Ports
    stack: Callable[[int], None] | None
    """Stacks so many disks between tool and tooling, as a person would; None: the cell has none."""

    def lines(self) -> list[str]:
        """Return a line a device: driver, and each protocol with its address and port."""
        return [f"{name} {self._places(name)}" for name in self.ports.ports]

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        return (
            ("cell", self.cell),
            ("seconds a second of the wall", f"{self.rate:g}"),
            *((name, self._places(name)) for name in self.ports.ports),
        )

    def wait(self) -> None:
        """Wait for Ctrl-C."""
        with contextlib.suppress(KeyboardInterrupt):
            threading.Event().wait()

    def _places(self, driver: str) -> str:
        ports = self.ports.ports[driver]
        return " ".join(f"{name} {self.ports.address}:{port}" for name, port in ports.items())


@workflow(SimulateSettings, marks=("elastocal.ports/",))
def simulate(
    settings: SimulateSettings,
    progress: Progress,  # noqa: ARG001 - it runs until it is stopped
) -> SimulateResult:
    """Serve the devices of a simulated cell on this machine until stopped.

    Raises
    ------
    DeviceError
        If the cell cannot be simulated, there is no simulator of a device, or the rate is not
        positive.
    ElastocalError
        If the cell cannot be used.
    """
    cell = load_cell(Path(settings.cell))
    rig = rig_of(cell)
    told = _told(rig, settings.devices)
    rate = cell.file.devices.clock_rate if settings.rate is None else settings.rate
    if not 0.0 < rate <= 1000.0:
        raise DeviceError(f"rate is {rate:g}: must be above 0, at most 1000")
    seed = truth_of(cell).seed if settings.seed is None else settings.seed
    live = LiveCell(cell, seed, WallClock(rate=rate))
    makers = wire_servers()
    servers = dict[str, WireServer]()
    with contextlib.ExitStack() as opened:
        served = {k: each for name in told for k, each in rig.wanted.get(name, {}).items()}
        opened.enter_context(devices_to_oneself(cell, served, "simulate", "simulated"))
        for name, each in told.items():
            servers[name] = makers[name](live, each)
            opened.callback(servers[name].close)
        ports = Ports(LOOPBACK, {name: dict(server.ports) for name, server in servers.items()})
        for server in servers.values():
            server.start()
        if settings.out is not None:
            write_json(settings.out, ports)
        has_disks = cell.file.engagement.disk_thickness is not None
        result = SimulateResult(cell.name, rate, ports, live.stack if has_disks else None)
        settings.meanwhile(result)
    return result


def _told(rig: Rig, devices: Iterable[str]) -> Mapping[str, Told]:
    """Return the settings handed to each server, by driver."""
    known = wire_servers()
    named = [name for name in rig.wanted if name != SIMULATED]
    chosen = list(devices) or named or list(suited_servers(rig.cell.robot))
    for name in chosen:
        if name not in known:
            raise DeviceError(
                f"there is no simulator of {name!r}{nearest(name, known)}"
                f" (known: {', '.join(known) or 'none'})"
            )
    return {
        name: Told(
            settings={
                key: value
                for settings in rig.wanted.get(name, {}).values()
                for key, value in settings
            }
        )
        for name in chosen
    }
