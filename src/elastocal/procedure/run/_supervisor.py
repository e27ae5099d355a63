"""One supervision cycle after the other: read every device, record, watch."""

import contextlib
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell.devices import ArmState, Devices, PointBlock, WrenchBlock
from elastocal.errors import DeviceError
from elastocal.procedure.record.journal import Action, Logbook
from elastocal.procedure.run._watchdog import (
    Guard,
    Seen,
    Watch,
    check_arm,
    check_points,
    check_wrenches,
)
from elastocal.procedure.run.faults import Fault, FaultError
from elastocal.procedure.run.settings import Settings

TIME_SLACK = 1e-6
"""Times that differ by less are equal, in s: sums of cycles are not exact."""
BROKEN = (DeviceError, FaultError, OSError)
"""What a device that is out of order may raise."""


class Recorder(Protocol):
    """Keeps the raw streams of one attempt; see `elastocal.procedure.record.streams.PoseRecorder`."""

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
        self._joints = len(devices.arm.joint_names)
        self._last_end: float | None = None
        self.arm: ArmState | None = None
        """The last that the arm has said; None before the first."""

    @property
    def now(self) -> float:
        """Time in s of the devices' clock."""
        return self.devices.clock.now()

    def start(self) -> None:
        """Drop what has come before the run, and start to watch."""
        self.devices.sensor.read()
        self.devices.metrology.read()
        self.watch.restart(self.now)
        self.pause()

    def pause(self) -> None:
        """Say that until the next cycle nobody needs to watch: the arm stands off the surface."""
        self._last_end = None

    def tare(self, force_sensor: FloatArray) -> None:
        """Take a force in the sensor's frame, shape (3,), as that of the free tool, in N."""
        self._tare = force_sensor

    def aim(self, station: str) -> None:
        """Let a tracker station look for the marker."""
        self.station = self.watch.station = station
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
        seen = self._look()
        self._observers.tell(seen)
        if self._observers.interrupted():
            raise FaultError(Fault.INTERRUPTED)
        if self.watch.check(seen, guard) and self.station is not None:
            self.devices.metrology.look(self.station)
        return seen

    def look_at_arm(self) -> ArmState | None:
        """Let one cycle pass and return what the arm says; None when it does not answer.

        For the way off the surface after a fault: the other devices and the clock may be what is
        out of order, so what they do changes nothing.
        """
        self.pause()
        with contextlib.suppress(*BROKEN):
            self._pass_time()
        for look in (self._look_at_sensor, self._look_at_points):
            with contextlib.suppress(*BROKEN):
                look()
        return self.ask_arm()

    def ask_arm(self) -> ArmState | None:
        """Return what the arm says now; None when it does not answer."""
        with contextlib.suppress(*BROKEN):
            return self._look_at_arm()
        return None

    def _look(self) -> Seen:
        """Let one cycle pass and return what the devices say."""
        self._pass_time()
        arm, wrenches, points = (
            self._look_at_arm(),
            self._look_at_sensor(),
            self._look_at_points(),
        )
        force_tcp = (wrenches.force - self._tare) @ self._R_sensor_tcp
        # What happens from here to the next cycle, nobody watches.
        self._last_end = now = self.devices.clock.now()
        return Seen(now, arm, wrenches, points, force_tcp)

    # What has no form is not recorded either: it could not be written.
    def _look_at_arm(self) -> ArmState:
        state = self.devices.arm.state()
        check_arm(state, self._joints)
        self.arm = state
        if self.recorder is not None:
            self.recorder.arm(state)
        return state

    def _look_at_sensor(self) -> WrenchBlock:
        block = self.devices.sensor.read()
        check_wrenches(block)
        if self.recorder is not None:
            self.recorder.wrenches(block)
        return block

    def _look_at_points(self) -> PointBlock:
        block = self.devices.metrology.read()
        check_points(block)
        if self.recorder is not None:
            self.recorder.points(block)
        return block

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
        before, longest = clock.now(), max(procedure.stale, procedure.cycle * 5)
        if self._last_end is not None and not before - self._last_end <= longest:
            text = f"{before - self._last_end:.2f} s passed between two cycles"
            raise FaultError(Fault.CLOCK, text)
        clock.sleep(procedure.cycle)
        passed = clock.now() - before
        self._still = 0 if passed > 0.0 else self._still + 1
        if not self._still * procedure.cycle <= procedure.stale:
            raise FaultError(Fault.CLOCK, f"it stands at {before:.3f} s")
        if not 0.0 <= passed <= longest:
            raise FaultError(Fault.CLOCK, f"{passed:.2f} s passed in a cycle")
