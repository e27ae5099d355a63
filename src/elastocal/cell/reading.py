"""Present state of a device, as `elastocal watch` shows it.

A driver reports it by `DeviceSet.readings`; otherwise it is polled through the protocols of
`elastocal.cell.devices` (`polled_readings`).
"""

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell.devices import (
    AskedMetrology,
    BeamState,
    ForceSensor,
    Metrology,
    RobotArm,
    SensorStatus,
)
from elastocal.cell.line_counts import LineCounts
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.robot import xyzabc_from_T

if TYPE_CHECKING:
    from elastocal.cell.rig import DeviceSet

_DAY = 86_400.0
"""A device whose time is farther from the PC's, in s, counts from an origin of its own."""
Three = tuple[float, float, float]
"""x, y, z or a, b, c."""


@brief_repr
@record()
class DeviceReading:
    """Present state of one device. None marks a value that the device does not state."""

    COLUMNS = ("state", "now", "line", "clock against the PC")
    """Headings of `cells`."""

    kind: str
    """One of `elastocal.cell.KINDS`."""
    device: str
    """Name of the device with its address."""
    heard: bool
    """Whether anything that could be read has come from it."""
    problem: str = ""
    """Why it is not heard, or not to be relied on; empty where nothing is known to be wrong."""
    state: str = ""
    """Activity of the device."""
    counts: LineCounts | None = None
    """Counts on its line since it was opened."""
    rate: float | None = None
    """Messages, samples or points a second, over the last two seconds."""
    cycle: tuple[float, float] | None = None
    """Time between messages, median and longest, in s."""
    delay: int | None = None
    """``Delay D`` of a KUKA, the largest: answers that came too late, as the controller counts."""
    offset: float | None = None
    """Time of its clock minus that of the PC, in s. A driver states it relative to the rig's clock;
    `elastocal watch` converts it to the PC's time of day, from 1970-01-01 UTC."""
    drift: float | None = None
    """Rate of its clock relative to the PC's, minus 1, dimensionless; None: too early to
    estimate."""
    position: Three | None = None
    """Position of the tool in base, or of the marker in the station's frame, in m."""
    turn: Three | None = None
    """Orientation of the tool in base: a, b, c (Z-Y'-X''), in rad."""
    force: Three | None = None
    """Raw, in the sensor's frame, in N."""
    moment: Three | None = None
    """About the sensor's origin, in N·m."""

    def cells(self) -> tuple[str, ...]:
        """Return the reading in words, one text for each of `COLUMNS`."""
        state = "; ".join(each for each in (self.problem, self.state) if each)
        return state, "; ".join(self._values()), "; ".join(self._line()), self._clock()

    def _values(self) -> Iterator[str]:
        for values, scale, digits, unit in (
            (self.position, 1e3, 3, "mm"),
            (self.turn, float(np.degrees(1.0)), 3, "deg"),
            (self.force, 1.0, 1, "N"),
            (self.moment, 1.0, 2, "N·m"),
        ):
            if values is not None:
                yield f"{', '.join(f'{scale * each:.{digits}f}' for each in values)} {unit}"

    def _line(self) -> Iterator[str]:
        if self.rate is not None:
            yield f"{self.rate:.1f} a second"
        if self.cycle is not None:
            yield "cycle {:.2f} ms (longest {:.2f})".format(*(1e3 * each for each in self.cycle))
        if self.delay is not None:
            yield f"Delay D {self.delay}"
        if self.counts is not None:
            yield self.counts.figures()

    def _clock(self) -> str:
        if self.offset is None:
            return ""
        drift = "" if self.drift is None else f", {1e6 * self.drift:+.0f} ppm"
        own = not abs(self.offset) <= _DAY
        return f"{'no time of day' if own else f'{self.offset:+.3f} s'}{drift}"


def three(values: FloatArray) -> Three | None:
    """Return the numbers of an array, shape (3,); None if one of them is not finite."""
    x, y, z = map(float, values)
    return (x, y, z) if np.isfinite(values).all() else None


def polled_readings(found: "DeviceSet") -> Callable[[], tuple[DeviceReading, ...]]:
    """Return the function that polls the devices of a set by their protocols, one after another.

    Parameters
    ----------
    found : DeviceSet
        Devices without another reader.
    """
    made: list[Iterator[DeviceReading]] = []
    if found.arm is not None:
        made.append(_arm(found.arm))
    if found.sensor is not None:
        made.append(_sensor(found.sensor))
    if found.metrology is not None:
        made.append(_metrology(found.metrology))
    return lambda: tuple(next(each) for each in made)


def _arm(arm: RobotArm) -> Iterator[DeviceReading]:
    while True:
        state = arm.state()
        pose = xyzabc_from_T(state.T_base_tcp)
        yield DeviceReading(
            kind="arm",
            device=state.source,
            heard=True,
            problem=state.fault or "",
            state=state.motion.value,
            position=three(pose[:3]),
            turn=three(pose[3:]),
        )


def _sensor(sensor: ForceSensor) -> Iterator[DeviceReading]:
    received, last = 0, None
    while True:
        block = sensor.read()
        received += len(block)
        last = block if len(block) else last
        is_good = block.status is SensorStatus.OK
        yield DeviceReading(
            kind="sensor",
            device=block.source,
            heard=received > 0,
            problem="" if is_good else f"status {block.status.value}",
            state=f"status {block.status.value}" if is_good else "",
            counts=LineCounts(block.source, received),
            force=None if last is None else three(last.force[-1]),
            moment=None if last is None else three(last.moment[-1]),
        )


def _metrology(metrology: Metrology) -> Iterator[DeviceReading]:
    received, last = 0, None
    is_asked = isinstance(metrology, AskedMetrology)
    while True:
        block = metrology.read()
        received += len(block)
        last = block if len(block) else last
        locked = block.beam is BeamState.LOCKED
        state = "locked" if locked else f"not locked: {block.note or 'no reason given'}"
        yield DeviceReading(
            kind="metrology",
            device=f"{block.source}: {block.station}",
            heard=received > 0 or is_asked,
            state="a person reads it when a run asks" if is_asked else state,
            counts=LineCounts(block.source, received),
            position=three(last.position[-1]) if locked and last is not None else None,
        )
