"""The supervision cycle: read every device, record its state, let the watchdog judge it.

The order within a cycle matters. Time passes first, so that the readings are new. Every device is
read and recorded before anything is judged, so that the streams contain the cause of a fault. Only
then may the watchdog refuse, and an interruption comes last, so that it hides neither a reading nor
a fault.
"""

import contextlib
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import (
    ArmState,
    AskedMetrology,
    BeamState,
    Devices,
    PointBlock,
    SensorStatus,
    WrenchBlock,
)
from elastocal.errors import DeviceError
from elastocal.procedure.record import Action, Logbook, StreamRecorder
from elastocal.procedure.run._watchdog import (
    Guard,
    Snapshot,
    Watchdog,
    check_arm,
    check_points,
    check_wrenches,
)
from elastocal.procedure.run.settings import RunSettings
from elastocal.procedure.run.steps import Fault, FaultError, FaultScope

_FORCE_CYCLES = 5
"""Cycles for which the force is looked at before anything moves."""
TIME_SLACK = 1e-6
"""Times that differ by less are equal, in s: sums of cycles are not exact."""
DEVICE_ERRORS = (DeviceError, FaultError, OSError)
"""A device that is out of order raises one of these."""


@dataclass(frozen=True)
class Observers:
    """Listeners of the cycle, who may also interrupt."""

    report: Callable[[Snapshot], None]
    """Called each cycle."""
    interrupted: Callable[[], bool]
    """Whether the run was asked to stop."""
    fault: Callable[[str], None] = lambda _: None
    """Called when a fault is seen, before anything is done about it."""


class Supervisor:
    """Runs the cycle. All waiting of a run happens in `wait`, and all waits end.

    Parameters
    ----------
    settings : RunSettings
        The run's figures.
    logbook : Logbook
        Where actuations are written.
    observers : Observers
        Who looks on.
    """

    def __init__(
        self, devices: Devices, settings: RunSettings, logbook: Logbook, observers: Observers
    ) -> None:
        self.devices, self.settings, self.logbook = devices, settings, logbook
        self._observers = observers
        procedure = settings.procedure
        self.watchdog = Watchdog(
            procedure.stale,
            procedure.beam_timeout,
            settings.collision_watch(),
            settings.R_tcp_sensor,
        )
        self.recorder: StreamRecorder | None = None
        self.station: str | None = None
        self._tare = np.zeros(3)
        self._R_sensor_tcp = settings.R_tcp_sensor.T
        self._still = 0
        self._joints = len(devices.arm.joint_names)
        self._last_read: float | None = None
        self.arm: ArmState | None = None
        """The last state of the arm; None before the first."""
        self.wrenches: WrenchBlock | None = None
        """The last samples of the force sensor; None where it has failed."""

    @property
    def now(self) -> float:
        """Time in s of the devices' clock."""
        return self.devices.clock.now()

    def start(self) -> None:
        """Drop what has come before the run, and start to watch."""
        self.devices.sensor.read()
        self.devices.metrology.read()
        self.restart_watching()

    def restart_watching(self) -> None:
        """Restart the time limits of all devices now."""
        self.watchdog.restart(self.now)
        self.pause()

    def pause(self) -> None:
        """Pause the supervision until the next cycle: the arm stands still, off the surface."""
        self._last_read = None

    def tare(self, force_sensor: FloatArray) -> None:
        """Take a force in the sensor's frame, shape (3,), as that of the free tool, in N."""
        self._tare = force_sensor

    def tell_fault(self, text: str) -> None:
        """Report a fault at once, since the reaction may take long."""
        self._observers.fault(text)

    def feels_free(self) -> bool:
        """Return whether the force on the tool is that at the beginning of the joint move."""
        arm, block = self.arm, self.wrenches
        if arm is None or block is None or block.status is not SensorStatus.OK or not len(block):
            return False
        age, force = abs(self.now - float(block.time[-1])), block.force[-1]
        R_base_sensor = arm.T_base_tcp[:3, :3] @ self.settings.R_tcp_sensor
        departure = self.watchdog.collisions.departure(force, R_base_sensor)
        procedure = self.settings.procedure
        return age <= procedure.stale and departure <= procedure.contact_force

    def beyond_weight(self) -> FloatArray | None:
        """Return the force that presses on the tool, base, shape (3,), in N, after some cycles.

        None where no force can be trusted. Nothing is refused.
        """
        found = None
        for _ in range(_FORCE_CYCLES):
            arm = self.arm_cycle()
            if arm is not None and self.wrenches is not None:
                now = self.settings.tool_load.beyond_weight(self.wrenches, arm.T_base_tcp)
                found = now if now is not None else found
        return found

    def aim(self, station: str) -> None:
        """Let a tracker station search the marker."""
        self.station = self.watchdog.station = station
        if self.settings.tracked:
            self.devices.metrology.look(station)
        self.watchdog.expect_points(self.now)

    def ask(self, what: str) -> bool:
        """Request a measurement of the marker if a person makes it; return whether one does."""
        metrology = self.devices.metrology
        if not isinstance(metrology, AskedMetrology):
            return False
        metrology.ask(what)
        return True

    def cycle(self, guard: Guard) -> Snapshot:
        """Let one cycle pass and return the readings of the devices.

        Raises
        ------
        FaultError
            If the watchdog refuses a reading, or the run was asked to stop.
        DeviceError
            If a device does not answer.
        """
        seen = self._read_devices()
        # Shown before it is judged, so that a person sees the state that led to a fault.
        self._observers.report(seen)
        try:
            marker_lost = self.watchdog.check(seen, guard)
        except FaultError as error:
            # After a fault of the attempt alone the arm would move on to another one.
            if error.fault.scope is FaultScope.ATTEMPT and self._observers.interrupted():
                raise FaultError(Fault.INTERRUPTED, f"; {error}") from error
            raise
        if self._observers.interrupted():
            raise FaultError(Fault.INTERRUPTED)
        if marker_lost and self.station is not None and self.settings.tracked:
            self.devices.metrology.look(self.station)
        return seen

    def arm_cycle(self) -> ArmState | None:
        """Let one cycle pass and return the arm's state; None if it does not answer.

        It is used for the retreat after a fault: the other devices and the clock may be the cause,
        so they are ignored.
        """
        # The time since the last cycle must not be refused now: the retreat has to go on.
        self.pause()
        with contextlib.suppress(*DEVICE_ERRORS):
            self._pass_time()
        for read in (self._read_sensor, self._read_metrology):
            with contextlib.suppress(*DEVICE_ERRORS):
                read()
        return self.arm_state()

    def arm_state(self) -> ArmState | None:
        """Return the state of the arm; None when it does not answer."""
        with contextlib.suppress(*DEVICE_ERRORS):
            return self._read_arm()
        return None

    def wait_for_person(self, is_done: Callable[[], bool]) -> None:
        """Let cycles pass until a person has done something in the cell, the arm disarmed.

        Devices are read so that nothing piles up on their lines, and are not judged: a gate that
        is opened may silence them.

        Raises
        ------
        FaultError
            If the run is asked to stop.
        """
        while not self._observers.interrupted():
            if is_done():
                return
            self.arm_cycle()
        raise FaultError(Fault.INTERRUPTED)

    def _read_devices(self) -> Snapshot:
        """Let one cycle pass and return the readings of the devices."""
        self._pass_time()
        arm, wrenches, points = (
            self._read_arm(),
            self._read_sensor(),
            self._read_metrology(),
        )
        force_tcp = (wrenches.force - self._tare) @ self._R_sensor_tcp
        # The time from here to the next cycle is not supervised.
        self._last_read = now = self.devices.clock.now()
        return Snapshot(now, arm, wrenches, points, force_tcp)

    # What has no form is not recorded either: it could not be written.
    def _read_arm(self) -> ArmState:
        state = self.devices.arm.state()
        check_arm(state, self._joints)
        self.arm = state
        if self.recorder is not None:
            self.recorder.arm(state)
        return state

    def _read_sensor(self) -> WrenchBlock:
        # Cleared first: if the sensor fails, its last samples must not count as new ones.
        self.wrenches = None
        block = self.devices.sensor.read()
        check_wrenches(block)
        self.wrenches = block
        if self.recorder is not None:
            self.recorder.wrenches(block)
        return block

    def _read_metrology(self) -> PointBlock:
        if not self.settings.tracked:
            return _tool_point(self.arm)
        block = self.devices.metrology.read()
        check_points(block)
        if self.recorder is not None:
            self.recorder.points(block)
        return block

    def wait(
        self, guard: Guard, done: Callable[[Snapshot], bool], limit: float, what: str
    ) -> Snapshot:
        """Let cycles pass until a condition holds; return the readings of that cycle.

        Raises
        ------
        FaultError
            If it takes longer than ``limit`` seconds; also see `cycle`.
        """
        # Cycles are counted, too: a clock that runs slow must not make the wait endless.
        start, cycles = self.now, 2 * math.ceil(limit / self.settings.procedure.cycle) + 10
        for _ in range(cycles):
            seen = self.cycle(guard)
            if done(seen):
                return seen
            # Tested after the condition: what was done in the last cycle in time is no timeout.
            if not seen.time - start <= limit:
                break
        raise FaultError(Fault.TIME_LIMIT, f"{what} is not done after {limit:.1f} s")

    def stay(self, guard: Guard, duration: float) -> Iterator[Snapshot]:
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
        # Whatever kept the program busy between two cycles (a disk, a suspended process), nobody
        # supervised the arm meanwhile.
        if self._last_read is not None and not before - self._last_read <= longest:
            text = f"{before - self._last_read:.2f} s passed between two cycles"
            raise FaultError(Fault.CLOCK, text)
        clock.sleep(procedure.cycle)
        passed = clock.now() - before
        # With a clock that has stopped, no limit in time would ever be reached.
        self._still = 0 if passed > 0.0 else self._still + 1
        if not self._still * procedure.cycle <= procedure.stale:
            raise FaultError(Fault.CLOCK, f"it stands at {before:.3f} s")
        if not 0.0 <= passed <= longest:
            raise FaultError(Fault.CLOCK, f"{passed:.2f} s passed in a cycle")


def _tool_point(arm: ArmState | None) -> PointBlock:
    """Return the tool point as the controller has it, in base, where no tracker measures.

    It is not recorded: the arm's stream has it.
    """
    if arm is None:
        none = np.empty((0, 3))
        return PointBlock(np.empty(0), none, none, BeamState.BROKEN, "", "no tracker")
    point, unknown = arm.T_base_tcp[None, :3, 3], np.full((1, 3), np.nan)
    return PointBlock(np.array([arm.time]), point, unknown, BeamState.LOCKED, "", arm.source)
