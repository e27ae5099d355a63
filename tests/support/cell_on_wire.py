"""A run whose tracker is behind a driver, on the wire; arm and sensor are of the same live cell.

The driver `DRIVER` of these tests makes all three, and a clock that waits for the wire: so that no
test depends on how fast a machine is.
"""

import queue
import threading
import time
from pathlib import Path

from elastocal.cell import BeamState, DeviceSet, DeviceSettings, Metrology, RigContext
from elastocal.drivers import DRIVERS
from elastocal.drivers.operator_entry.entry import OperatorEntry, OperatorEntrySettings
from elastocal.sim.wire import LiveCell, Told, wire_servers
from elastocal.sim.workcell import SimClock, SimulatedCell
from support import drivers
from support.run_cells import PlannedCell

_PATIENCE = 20.0
_LATE = 0.1
_READ = 3
"""Samples that the display of an instrument averages."""


class _Settings(DeviceSettings):
    tracker: str = "line_stream"


class _Clock:
    """Lets time pass in small steps, each when what was measured before has come over the wire."""

    def __init__(self, start: float) -> None:
        self._own, self._lock = SimClock(start), threading.Lock()
        self.metrology: Metrology | None = None

    def now(self) -> float:
        with self._lock:
            return self._own.now()

    def sleep(self, seconds: float) -> None:
        with self._lock:
            self._own.sleep(seconds)
        end = time.monotonic() + _PATIENCE
        while time.monotonic() < end and not self._is_up_to_date():
            time.sleep(0.002)

    def _is_up_to_date(self) -> bool:
        feeds = getattr(self.metrology, "_feeds", {})
        return all(
            feed._beam is BeamState.BROKEN or feed._heard > self.now() - _LATE
            for feed in feeds.values()
        )


class _LoopCell:
    kinds = frozenset({"arm", "sensor", "metrology"})
    real = False

    def settings(self, _kind: str) -> type[DeviceSettings]:
        return _Settings

    def connect(self, cell, wanted, context: RigContext) -> DeviceSet:
        clock, asked = _Clock(context.start), wanted["metrology"]
        if asked.tracker == "operator_entry":
            return _typed(cell, context)
        live = LiveCell(cell, context.seed, clock)
        server = wire_servers()[asked.tracker](live, Told())
        server.start()
        driver = DRIVERS.named(asked.tracker)
        settings = driver.settings("metrology").model_validate({"port": server.ports["tcp"]})
        tracker = driver.connect(
            cell, {"metrology": settings}, RigContext(clock, 0, context.start, None)
        )
        clock.metrology = tracker.metrology

        def close() -> None:
            tracker.close()
            server.close()

        return DeviceSet(live.arm(), live.sensor(), tracker.metrology, clock=clock, close=close)


def _typed(cell, context: RigContext) -> DeviceSet:
    """Return the simulated devices, the tracker read by a person who reads to a micrometre."""
    sim = SimulatedCell.of(cell, context.seed, context.start)
    lines: queue.Queue[str] = queue.Queue()

    def hears(text: str) -> None:
        if "x y z of the marker" in text:
            x, y, z = 1e3 * sim.tracker.read().position[-_READ:].mean(axis=0)
            lines.put(f"{x:.3f} {y:.3f} {z:.3f}")

    clock = sim.devices.clock
    metrology = OperatorEntry(cell, OperatorEntrySettings(), clock, iter(lines.get, None), hears)
    return DeviceSet(sim.arm, sim.sensor, metrology, clock=clock)


DRIVER = _LoopCell()


def on_wire(folder: Path, monkeypatch, planned: PlannedCell, tracker: str) -> PlannedCell:
    """Return a planned cell with its tracker behind a driver."""
    source = "from support.cell_on_wire import DRIVER"
    drivers.install(folder, monkeypatch, "loop_cell", source)
    return planned.with_text(
        f"{tracker}.yaml",
        "devices:\n"
        "  arm: loop_cell\n"
        "  sensor: loop_cell\n"
        f"  metrology: {{driver: loop_cell, tracker: {tracker}}}\n"
        "procedure: {beam_timeout: 600 s}\n",
    )
