"""The rig of a cell: the drivers of arm, sensor and metrology, and the protocol of a driver.

A driver is one package, found by its name: an entry point of the group ``elastocal.drivers``. Arm,
sensor and metrology of different drivers make one rig. The driver's own settings validate the
section of a device in the cell file; `elastocal run` knows which drivers exist.
"""

import math
import socket
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, Protocol, runtime_checkable

from pydantic import (
    ConfigDict,
    Field,
    FiniteFloat,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)

from elastocal.arrays import FloatArray
from elastocal.cell.arming import Arming
from elastocal.cell.devices import (
    Clock,
    ForceSensor,
    Metrology,
    RobotArm,
    SensorStatus,
    close_nothing,
    require_duration,
    stack_nothing,
)
from elastocal.cell.line_counts import LineCounts, no_lines
from elastocal.cell.reading import DeviceReading
from elastocal.errors import DeviceError
from elastocal.records import StrictModel
from elastocal.results import brief_repr

if TYPE_CHECKING:
    from elastocal.cell.cell import Cell

SIMULATED = "simulated"
"""Name of the driver of each kind that needs no hardware."""
LOOPBACK = "127.0.0.1"
"""Address of this machine for itself, and the default of every device's `address`."""
KINDS = ("arm", "sensor", "metrology")
"""Kinds of device that a run needs."""


class DeviceChoice(StrictModel):
    """Driver of a device: its name, or a mapping with its name and its settings."""

    model_config = ConfigDict(extra="allow")

    driver: str

    @model_validator(mode="before")
    @classmethod
    def _from_name(cls, data: Any) -> Any:
        return {"driver": data} if isinstance(data, str) else data

    @model_serializer(mode="wrap")
    def _as_written(self, dump: SerializerFunctionWrapHandler) -> Any:
        return dump(self) if self.told else self.driver

    @property
    def told(self) -> Mapping[str, object]:
        """The other keys as given in the cell file; the driver's settings validate them."""
        return self.model_extra or {}

    def __str__(self) -> str:
        return self.driver


_Simulated = Field(default_factory=lambda: DeviceChoice(driver=SIMULATED))


class DeviceChoices(StrictModel):
    """Section ``devices`` of the cell file."""

    arm: DeviceChoice = _Simulated
    sensor: DeviceChoice = _Simulated
    """Force/torque sensor."""
    metrology: DeviceChoice = _Simulated
    """Laser trackers."""
    clock_rate: Annotated[FiniteFloat, Field(gt=0.0, le=1000.0)] = 1.0
    """Seconds of the run a second of the wall; for simulators that run as fast. Of no meaning where
    everything is `SIMULATED`: that cell has a clock of its own, which waits for nothing."""

    @property
    def by_kind(self) -> Mapping[str, DeviceChoice]:
        """The choice of each of `KINDS`."""
        return {kind: getattr(self, kind) for kind in KINDS}


class DevicePlace(NamedTuple):
    """Address of a device, which only one program may use at a time."""

    host: str
    port: int
    """0: the device has none that is known."""

    def __str__(self) -> str:
        return f"{self.host}:{self.port}" if self.port else self.host


class LocalPort(NamedTuple):
    """A port of this machine that a driver listens at."""

    kind: Literal["udp", "tcp"]
    address: str
    port: int
    """0: the system chooses one."""

    def bind(self) -> socket.socket:
        """Return a socket that has the port; one of TCP listens.

        Raises
        ------
        DeviceError
            If the address does not belong to this machine, or the port is taken.
        """
        place = (self.address, self.port)
        try:
            if self.kind == "tcp":
                return socket.create_server(place, backlog=1)
            line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            try:
                line.bind(place)
            except OSError:
                line.close()
                raise
        except OSError as error:
            raise DeviceError(
                f"cannot listen at {self.address}:{self.port}: {error.strerror or error}"
            ) from error
        return line


class DeviceSettings(StrictModel):
    """Base class of the settings of a device in the cell file, without the name of its driver."""

    def device_places(self) -> tuple[DevicePlace, ...]:
        """Return the addresses of the devices, which are locked while they are in use.

        By default what ``address`` (``robot``) and ``port`` name, for each station where there are
        several.
        """
        return tuple(_places(self))

    def own_ports(self) -> tuple[LocalPort, ...]:
        """Return the ports that the driver listens at, bound before any device is asked."""
        return ()


def _places(settings: StrictModel) -> Iterator[DevicePlace]:
    values = dict(settings)
    nested = [
        each
        for value in values.values()
        if isinstance(value, Mapping)
        for each in value.values()
        if isinstance(each, StrictModel)
    ]
    for each in nested:
        yield from _places(each)
    if not nested:
        for key in ("address", "robot"):
            if key in values:
                yield DevicePlace(str(values[key]), int(values.get("port", 0)))


@brief_repr
@dataclass(frozen=True, eq=False)
class WrenchSample:
    """One sample of a force sensor: raw, in the sensor's frame, bias and tool weight in."""

    time: float
    """In s of the clock."""
    force: FloatArray
    """Shape (3,), in N."""
    moment: FloatArray
    """About the sensor's origin, shape (3,), in N·m."""
    status: SensorStatus


class WrenchFeed(Protocol):
    """The newest wrench, for an arm whose force control runs on the PC.

    A second tap beside `ForceSensor.read`: neither takes samples away from the other.
    """

    def newest(self) -> WrenchSample | None:
        """Return the newest sample, including those already returned; None before the first."""


@brief_repr
@dataclass(frozen=True)
class RigContext:
    """Data that all drivers of a rig share."""

    clock: Clock
    seed: int
    """Seed of simulated devices."""
    start: float
    """Time of the clock at the creation of the rig, in s: later than all samples of a run that is
    resumed."""
    feed: WrenchFeed | None
    """Wrench feed of another driver of the rig; None where none has one."""
    ports: Mapping[LocalPort, socket.socket] = field(default_factory=dict)
    """Ports that are bound already, as `DeviceSettings.own_ports` names them."""

    arming: Arming = Arming()  # noqa: RUF009 - frozen
    """Arming of an arm that moves as soon as its path is corrected, see
    `elastocal.cell.PathDriver`."""
    watches: bool = False
    """Whether the rig only observes (`elastocal watch`): a driver then commands no arm, does not
    wait for a device, and keeps listening after errors."""

    def patience(self, seconds: float) -> float:
        """Return how long a device may be silent, in s: without limit when it is only watched."""
        return math.inf if self.watches else seconds

    def listener(self, port: LocalPort) -> socket.socket:
        """Return a socket for a port, which the caller closes.

        Raises
        ------
        DeviceError
            If it is not bound yet and is taken.
        """
        bound = self.ports.get(port)
        return port.bind() if bound is None else bound.dup()


@brief_repr
@dataclass(frozen=True, eq=False)
class DeviceSet:
    """Devices that one driver made: at least those requested."""

    arm: RobotArm | None = None
    sensor: ForceSensor | None = None
    metrology: Metrology | None = None
    feed: WrenchFeed | None = None
    """Wrench feed of a sensor that can be read beside `ForceSensor.read`."""
    clock: Clock | None = None
    """Takes the place of the rig's; only where one driver makes everything."""
    close: Callable[[], None] = close_nothing
    """Gives lines and threads back; called once."""
    lines: Callable[[], tuple[LineCounts, ...]] = no_lines
    """Function that returns the counts of its lines until `close`; never raises."""
    stack: Callable[[int], None] = stack_nothing
    """See `elastocal.cell.Devices.stack`."""
    readings: Callable[[], tuple[DeviceReading, ...]] | None = None
    """Function that returns the state of the devices if `RigContext.watches`; after a `DeviceError`
    they may be closed and reconnected. None: arm, sensor and metrology are polled."""


@runtime_checkable
class Driver(Protocol):
    """Makes devices of one family. An entry point of the group ``elastocal.drivers`` names it."""

    @property
    def kinds(self) -> frozenset[str]:
        """Members of `KINDS` that the driver provides."""

    @property
    def real(self) -> bool:
        """Whether a real arm moves: a person is asked before each run."""

    def settings(self, kind: str) -> type[DeviceSettings]:
        """Return the settings model of a device of a kind in the cell file."""

    def connect(
        self, cell: "Cell", wanted: Mapping[str, DeviceSettings], context: RigContext
    ) -> DeviceSet:
        """Make the requested devices; called once for each rig.

        Parameters
        ----------
        wanted : mapping
            Settings by kind, as `settings` has checked them.
        context : RigContext
            What the drivers share.

        Raises
        ------
        DeviceError
            If a device cannot be reached, or is in a wrong state.
        """


class WallClock:
    """The time of the wall, from a start, at a rate; see `elastocal.cell.devices.Clock`."""

    def __init__(
        self,
        start: float = 0.0,
        rate: float = 1.0,
        *,
        monotonic: Callable[[], float] = time.monotonic,
        pause: Callable[[float], None] = time.sleep,
    ) -> None:
        """Set the clock to ``start`` s.

        Parameters
        ----------
        start : float
            In s.
        rate : float
            Seconds that it shows a second of the wall.
        monotonic, pause : callable, optional
            Clock and sleep of the PC.
        """
        self.rate = rate
        self._start, self._monotonic, self._pause = start, monotonic, pause
        self._origin = monotonic()

    def now(self) -> float:
        """Return the time in s."""
        return self._start + self.rate * (self._monotonic() - self._origin)

    def sleep(self, seconds: float) -> None:
        """Wait.

        Raises
        ------
        DeviceError
            If the time is negative or not finite.
        """
        require_duration(seconds)
        self._pause(seconds / self.rate)
