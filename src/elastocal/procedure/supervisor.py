"""One supervision cycle after the other: read every device, record, watch."""

import contextlib
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell.devices import ArmState, Devices, PointBlock, WrenchBlock
from elastocal.procedure.entries import Action
from elastocal.procedure.faults import Fault, FaultError
from elastocal.procedure.logbook import Logbook
from elastocal.procedure.settings import Settings
from elastocal.procedure.watch import Guard, Seen, Watch

TIME_SLACK = 1e-6
"""Times that differ by less are equal, in s: sums of cycles are not exact."""


class Recorder(Protocol):
    """Keeps the raw streams of one attempt; see `elastocal.procedure.streams.PoseRecorder`."""

    def arm(self, state: ArmState) -> None:
        """Keep a state of the arm."""

    def wrenches(self, block: WrenchBlock) -> None:
        """Keep a block of the force sensor."""

    def points(self, block: PointBlock) -> None:
        """Keep a block of the tracker."""

    def mark(self, time: float, text: str) -> None:
        """Keep a remark."""


@dataclass(frozen=True)
class Observers:
    """Who may look on, and interrupt."""

    tell: Callable[[Seen], None]
    """Called each cycle."""
    interrupted: Callable[[], bool]
    """Whether somebody wants the run to stop."""


class Supervisor:
    """Runs the cycle. All waiting of a run happens in `wait`, and all waits end.

    Parameters
    ----------
    devices : Devices
        The devices.
    settings : Settings
        The run's figures.
    logbook : Logbook
        Where actuations are written.
    observers : Observers
        Who looks on.
    """

    def __init__(
        self, devices: Devices, settings: Settings, logbook: Logbook, observers: Observers
    ) -> None:
        self.devices, self.settings, self.logbook = devices, settings, logbook
        self._observers = observers
        procedure = settings.procedure
        self.watch = Watch(procedure.stale, procedure.beam_timeout)
        self.recorder: Recorder | None = None
        self.station: str | None = None
        self._tare = np.zeros(3)
        self._R_sensor_tcp = settings.R_tcp_sensor.T
        self._still = 0

    @property
    def now(self) -> float:
        """Time in s of the devices' clock."""
        return self.devices.clock.now()

    def start(self) -> None:
        """Drop what has come before the run, and start to watch."""
        self.devices.sensor.read()
        self.devices.metrology.read()
        self.watch.restart(self.now)

    def tare(self, force_sensor: FloatArray) -> None:
        """Take a force in the sensor's frame, shape (3,), as that of the free tool, in N."""
        self._tare = force_sensor

    def aim(self, station: str) -> None:
        """Let a tracker station look for the marker."""
        self.station = station
        self.devices.metrology.look(station)
        self.watch.expect_points(self.now)

    def cycle(self, guard: Guard) -> Seen:
        """Let one cycle pass and return what the devices say.

        Raises
        ------
        FaultError
            If something is wrong, or somebody wants the run to stop.
        DeviceError
            If a device does not answer.
        """
        seen = self.look_blindly()
        self._observers.tell(seen)
        if self._observers.interrupted():
            raise FaultError(Fault.INTERRUPTED)
        if self.watch.check(seen, guard) and self.station is not None:
            self.devices.metrology.look(self.station)
        return seen

    def look_blindly(self) -> Seen:
        """Let one cycle pass and return what the devices say, right or wrong."""
        devices, recorder = self.devices, self.recorder
        self._pass_time()
        arm, wrenches, points = devices.arm.state(), devices.sensor.read(), devices.metrology.read()
        if recorder is not None:
            recorder.arm(arm)
            recorder.wrenches(wrenches)
            recorder.points(points)
        force_tcp = (wrenches.force - self._tare) @ self._R_sensor_tcp
        return Seen(devices.clock.now(), arm, wrenches, points, force_tcp)

    def wait(self, guard: Guard, done: Callable[[Seen], bool], limit: float, what: str) -> Seen:
        """Let cycles pass until something is done; return what was seen then.

        Raises
        ------
        FaultError
            If it takes longer than ``limit`` seconds; also see `cycle`.
        """
        start, cycles = self.now, 2 * math.ceil(limit / self.settings.procedure.cycle) + 10
        for _ in range(cycles):
            seen = self.cycle(guard)
            if done(seen):
                return seen
            if not seen.time - start <= limit:
                break
        raise FaultError(Fault.TIME_LIMIT, f"{what} is not done after {limit:.1f} s")

    def stay(self, guard: Guard, duration: float) -> Iterator[Seen]:
        """Yield what is seen each cycle until a duration is over."""
        start = self.now
        while self.now - start < duration - TIME_SLACK:
            yield self.cycle(guard)

    @contextlib.contextmanager
    def actuation(
        self, action: Action, target: str | tuple[float, ...] | None = None
    ) -> Iterator[None]:
        """Journal what happens in between; see `Logbook.actuation`."""
        with self.logbook.actuation(action, target):
            yield

    def _pass_time(self) -> None:
        clock, procedure = self.devices.clock, self.settings.procedure
        before = clock.now()
        clock.sleep(procedure.cycle)
        passed = clock.now() - before
        self._still = 0 if passed > 0.0 else self._still + 1
        if not self._still * procedure.cycle <= procedure.stale:
            raise FaultError(Fault.CLOCK, f"it stands at {before:.3f} s")
        if not 0.0 <= passed <= max(procedure.stale, procedure.cycle * 5):
            raise FaultError(Fault.CLOCK, f"{passed:.2f} s passed in a cycle")
