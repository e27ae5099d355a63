"""The operator and the devices that a run needs.

The person at the cell is an argument, never a question asked from below. `rig_of` is the only
place that picks simulator or driver.
"""

import contextlib
import socket
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Any, Protocol

from elastocal.cell import (
    KINDS,
    Arming,
    Cell,
    Clock,
    Devices,
    DeviceSet,
    DeviceSettings,
    Driver,
    LineCounts,
    LocalPort,
    NoMetrology,
    PathDriver,
    RealArm,
    RigContext,
    RobotArm,
    WallClock,
)
from elastocal.drivers import DRIVERS
from elastocal.errors import DeviceError, ElastocalError, PluginError, ProcedureError
from elastocal.procedure import Progress as RunProgress
from elastocal.records import validate
from elastocal.results import brief_repr
from elastocal.workflows._device_locks import (
    at_device,
    devices_to_oneself,
    is_loopback,
    open_doors,
)


@dataclass(frozen=True)
class Supervision:
    """The operator's part while the arm moves."""

    show: Callable[[RunProgress], None]
    """Takes note of every step; never raises, never waits."""
    interrupted: Callable[[], bool]
    """Whether the run was asked to stop: it releases, retracts and stops."""
    ask: Callable[[str], Callable[[], bool]] = lambda _: lambda: False
    """Asks for something to be done in the cell, the arm disarmed; returns at once a function that
    says whether the person has said that it is done, and that the cell is clear. By default nobody
    ever does."""


class Operator(Protocol):
    """The person at the cell."""

    @property
    def answers(self) -> bool:
        """Whether there is somebody to ask while a run goes on."""

    def warn(self, lines: Sequence[str]) -> None:
        """Read what should be known before anything moves."""

    def confirm(self) -> None:
        """Agree that the cell is clear, or raise `ProcedureError`."""

    def identify(self, missing: Sequence[str]) -> Mapping[str, str]:
        """Return the missing entries of the certificate, by key; unknown ones are left out."""

    def supervise(self, poses: int) -> AbstractContextManager[Supervision]:
        """Watch while the arm moves to this number of poses."""


class Unattended:
    """Nobody: agrees to nothing, interrupts nothing, hears progress by the callable alone."""

    @property
    def answers(self) -> bool:
        """Whether there is somebody: no."""
        return False

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

    def identify(self, missing: Sequence[str]) -> Mapping[str, str]:  # noqa: ARG002 - likewise
        """State nothing."""
        return {}

    @contextmanager
    def supervise(self, poses: int) -> Iterator[Supervision]:  # noqa: ARG002 - the protocol's form
        """Watch nothing."""
        yield Supervision(lambda _step: None, lambda: False)


@brief_repr
@dataclass(frozen=True, eq=False)
class Rig:
    """Drivers that together make the devices of a cell, each with what is wanted of it."""

    cell: Cell
    drivers: Mapping[str, Driver]
    """Drivers by name, in the order of their creation: sensors first, the arm last."""
    wanted: Mapping[str, Mapping[str, DeviceSettings]]
    """Settings by kind of device, by name of the driver."""

    @property
    def real(self) -> bool:
        """Whether a real arm moves: a person is asked first."""
        return any(driver.real for driver in self.drivers.values())

    @property
    def by_kind(self) -> Mapping[str, DeviceSettings]:
        """The settings of each of `KINDS`."""
        return {kind: each for kinds in self.wanted.values() for kind, each in kinds.items()}

    @property
    def warnings(self) -> list[str]:
        """Warnings about the cell's addresses."""
        return open_doors(self.by_kind)

    @contextmanager
    def reserved(self, command: str, kinds: Collection[str] = KINDS) -> Iterator["ReservedRig"]:
        """Lock the devices and all ports that they need; the devices are not contacted yet.

        Parameters
        ----------
        command : str
            Which command has them, for others who want them.
        kinds : collection of str, optional
            Kinds of the devices that it talks to.

        Raises
        ------
        DeviceError
            If another program has a device, or a port is taken: nothing has happened then.
        """
        with contextlib.ExitStack() as opened:
            ports: dict[LocalPort, socket.socket] = {}
            devices = {kind: each for kind, each in self.by_kind.items() if kind in kinds}
            opened.enter_context(devices_to_oneself(self.cell, devices, command))
            for kind, settings in devices.items():
                for port in settings.own_ports():
                    with at_device(self.cell, kind):
                        ports[port] = opened.enter_context(port.bind())
            yield ReservedRig(self, ports)

    def path_arm(self) -> tuple[PathDriver, DeviceSettings]:
        """Return the driver of the arm, which takes corrections of a path, and its settings.

        Raises
        ------
        DeviceError
            If it takes none.
        """
        name = self.cell.file.devices.arm.driver
        driver = self.drivers[name]
        if not isinstance(driver, PathDriver):
            able = [each for each in DRIVERS if isinstance(DRIVERS.named(each), PathDriver)]
            raise DeviceError(
                f"{self.cell.path}: devices.arm: driver {name!r} takes no corrections of a path"
                f" ({', '.join(able)} does); other controllers run the C of `elastocal export`"
            )
        return driver, self.wanted[name]["arm"]


@brief_repr
@dataclass(frozen=True, eq=False)
class ReservedRig:
    """Rig of a cell with exclusive access, for the duration of `Rig.reserved`."""

    rig: Rig
    ports: Mapping[LocalPort, socket.socket]
    """Bound already."""

    def connect(self, seed: int, start: float) -> Devices:
        """Return the devices.

        Parameters
        ----------
        seed : int
            Seed of simulated devices.
        start : float
            What the clock shows at the beginning, in s.

        Raises
        ------
        ElastocalError
            If a device cannot be used; those that were made before are closed.
        """
        clock: Clock = WallClock(start, self.rig.cell.file.devices.clock_rate)
        made: list[DeviceSet] = []
        try:
            feed = None
            for name, driver in self.rig.drivers.items():
                context = RigContext(clock, seed, start, feed, self.ports)
                made.append(driver.connect(self.rig.cell, self.rig.wanted[name], context))
                feed = feed or made[-1].feed
            clocks = [each.clock for each in made if each.clock is not None]
            if clocks and len(made) > 1:
                raise DeviceError(
                    f"{self.rig.cell.path}: devices: a driver with a clock of its own"
                )
            arm, sensor = (self._only(kind, made) for kind in ("arm", "sensor"))
            tracked = bool(self.rig.cell.file.trackers)
            metrology = self._only("metrology", made) if tracked else NoMetrology()
        except BaseException:
            _refusals_to_close(made)
            raise
        running = clocks[0] if clocks else clock

        def lines() -> tuple[LineCounts, ...]:
            return tuple(counts for each in made for counts in each.lines())

        def stack(disks: int) -> None:
            for each in made:
                each.stack(disks)

        return Devices(arm, sensor, metrology, running, lambda: _close(made), lines, stack)

    def connect_sensor(self, context: RigContext) -> DeviceSet:
        """Return the force sensor alone, with its feed; the caller closes it.

        Raises
        ------
        DeviceError
            If it cannot be used, or its driver gives no newest wrench.
        """
        name = self.rig.cell.file.devices.sensor.driver
        found = self.rig.drivers[name].connect(
            self.rig.cell, {"sensor": self.rig.wanted[name]["sensor"]}, context
        )
        if found.sensor is None or found.feed is None:
            found.close()
            raise DeviceError(
                f"{self.rig.cell.path}: devices.sensor: driver {name!r} gives no newest wrench in"
                " between, which a correction needs each cycle"
            )
        return found

    def connect_tracker(self, context: RigContext) -> DeviceSet:
        """Return the tracker alone; the caller closes it.

        Raises
        ------
        DeviceError
            If it cannot be used.
        """
        cell, name = self.rig.cell, self.rig.cell.file.devices.metrology.driver
        driver, place = self.rig.drivers[name], f"{cell.path}: devices.metrology: driver {name!r}"
        if self.rig.real and not driver.real:
            raise DeviceError(f"{place} is simulated: it does not see this arm")
        found = driver.connect(cell, {"metrology": self.rig.wanted[name]["metrology"]}, context)
        if found.metrology is None:
            found.close()
            raise DeviceError(f"{place} made none")
        return found

    def _only(self, kind: str, made: Sequence[DeviceSet]) -> Any:
        (device,) = (
            getattr(each, kind)
            for name, each in zip(self.rig.drivers, made, strict=True)
            if kind in self.rig.wanted[name]
        )
        if device is None:
            driver = self.rig.cell.file.devices.by_kind[kind].driver
            raise DeviceError(f"{self.rig.cell.path}: devices.{kind}: driver {driver!r} made none")
        return device


def arm_devices(
    rig: Rig,
    arm: RobotArm,
    operator: Operator,
    confirmed: bool,
    arming: Arming | None = None,
    asks: bool = False,
) -> None:
    """Enable the motion of a cell's arm; only this function arms a real arm.

    Parameters
    ----------
    rig, arm : Rig, RobotArm
        Rig and arm of the cell.
    operator : Operator
        Asked if a real arm is to move and nobody has agreed yet.
    confirmed : bool
        A person has agreed to this command on the cell file as it is now.
    arming : Arming, optional
        Arming of a person who agreed earlier, to the cell file as it was then.
    asks : bool
        Whether agreement is needed even if no real arm moves.

    Raises
    ------
    ProcedureError
        If the operator does not agree.
    DeviceError
        If the cell file is not the one that was agreed to, or its arm takes no arming.
    """
    if (rig.real or asks) and not confirmed:
        operator.confirm()
    arming = arming or Arming.of(rig.cell)
    arming.require(rig.cell, rig.real)
    driver = rig.cell.file.devices.arm.driver
    if rig.drivers[driver].real:
        if not isinstance(arm, RealArm):
            raise DeviceError(
                f"{rig.cell.path}: devices.arm: driver {driver!r} can hurt, and its arm takes no"
                " arming (attribute 'arming', see elastocal.cell.RealArm)"
            )
        arm.arming = arming


def _close(made: Sequence[DeviceSet]) -> None:
    for refusal in _refusals_to_close(made):
        raise refusal


def _refusals_to_close(made: Sequence[DeviceSet]) -> list[Exception]:
    """Close all, the arm first, whatever one of them says."""
    refusals: list[Exception] = []
    for each in reversed(made):
        try:
            each.close()
        except (ElastocalError, OSError) as error:
            refusals.append(error)
    return refusals


def rig_of(cell: Cell) -> Rig:
    """Return the rig that a cell file describes; nothing is connected.

    Raises
    ------
    DeviceError
        If a driver is not known or does not make such a device.
    SchemaError
        If the settings of a device do not fit its driver.
    """
    choices = cell.file.devices
    found: dict[str, Driver] = {}
    wanted: dict[str, dict[str, DeviceSettings]] = {}
    # What may give a feed comes before what may need one.
    for kind in _kinds_of(cell):
        choice, place = choices.by_kind[kind], f"{cell.path}: devices.{kind}"
        try:
            driver = found.get(choice.driver) or DRIVERS.named(choice.driver)
        except (DeviceError, PluginError) as error:
            raise DeviceError(f"{place}: {error}") from error
        if kind not in driver.kinds:
            makes = ", ".join(sorted(driver.kinds))
            raise DeviceError(f"{place}: driver {choice.driver!r} makes none (it makes: {makes})")
        found[choice.driver] = driver
        settings = validate(dict(choice.told), driver.settings(kind), place)
        wanted.setdefault(choice.driver, {})[kind] = settings
    order = [name for name in wanted if name != choices.arm.driver] + [choices.arm.driver]
    rig = Rig(cell, {name: found[name] for name in order}, wanted)
    _require_real_time(rig)
    return rig


def _kinds_of(cell: Cell) -> tuple[str, ...]:
    """Return the kinds of devices of a cell: metrology only where there is a tracker to look."""
    trackers = ("metrology",) if cell.file.trackers else ()
    return ("sensor", *trackers, "arm")


def _require_real_time(rig: Rig) -> None:
    """Refuse a clock that is not the wall's where a device is on another machine."""
    rate = rig.cell.file.devices.clock_rate
    for kind, settings in rig.by_kind.items():
        hosts = [each.host for each in settings.device_places()]
        hosts += [each.address for each in settings.own_ports()]
        far = next((each for each in hosts if not is_loopback(each)), None)
        if rate != 1.0 and far is not None:
            raise DeviceError(
                f"{rig.cell.path}: devices.clock_rate is {rate:g}, for simulators on this"
                f" machine alone; devices.{kind} is at {far}"
            )
