"""``watch``: every device of a cell, live, without a run; nothing is moved."""

import contextlib
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Annotated

from elastocal.cell import (
    KINDS,
    Clock,
    DeviceReading,
    DeviceSet,
    RigContext,
    WallClock,
    load_cell,
    polled_readings,
)
from elastocal.errors import ElastocalError
from elastocal.options import Option
from elastocal.progress import Progress
from elastocal.records import record
from elastocal.results import Result, brief_repr
from elastocal.sim import truth_of
from elastocal.workflows._inputs import seconds_of
from elastocal.workflows._operator_and_devices import ReservedRig, Rig, rig_of
from elastocal.workflows._workflow import workflow

_LOOK = 0.2
"""Between two looks at a device, in s of the wall."""
_AGAIN = 1.0
"""Until a device that failed is connected again, in s of the wall."""
_OVER = 2.0
"""Time over which a rate is taken, in s of the clock."""
_ENDING = 3.0
"""Time for a line to end, in s of wall time; one that waits for its device ends by itself."""


@brief_repr
@record()
class WatchFigures:
    """Output of ``watch --json``."""

    cell: str
    seconds: float
    """Time for which the devices were watched, in s of wall time."""
    devices: tuple[DeviceReading, ...]
    """Arm, sensor, metrology; one for each station of the latter."""


@dataclass(frozen=True, eq=False, repr=False)
class WatchResult(Result):
    """State of the devices of a cell."""

    figures: WatchFigures

    @property
    def problem(self) -> str | None:
        """Devices that never sent anything, and why, in one line; None if all did."""
        silent = [each for each in self.figures.devices if not each.heard]
        whys = "; ".join(f"{each.kind} {each.device}: {each.cells()[0]}" for each in silent)
        return f"not heard: {whys}" if silent else None

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts: a line a device."""
        return tuple(
            (f"{each.kind} {each.device}", "  ".join(filter(None, each.cells())))
            for each in self.figures.devices
        )


@brief_repr
@dataclass(frozen=True)
class WatchSettings:
    """Settings of ``watch``: the cell and the duration."""

    cell: Annotated[str | PathLike[str], Option(argument=True)]
    """Cell file, ``.yaml``."""
    duration: Annotated[str | float | None, Option("--for")] = None
    """Time with its unit, or in s, after which it ends; none: when it is interrupted."""
    show: Callable[[WatchResult], None] = lambda _result: None
    """Called five times a second."""
    interrupted: Callable[[], bool] = lambda: False
    """Whether it is to end now; Ctrl-C ends it, too."""


@workflow(WatchSettings)
def watch(settings: WatchSettings, progress: Progress) -> WatchResult:  # noqa: ARG001 - no stages
    """Show every device of a cell: what it says, how often, what is wrong with it, its clock.

    No arm is commanded. RSI demands an answer in each cycle: a KUKA in mode ``contact`` gets that
    of an arm that is not enabled, which moves nothing; in mode ``compensation`` it gets none. A
    device that another program talks to is left to it, and one that fails is tried again.

    Raises
    ------
    ElastocalError
        If the cell file or the duration cannot be used; what a device refuses is in its reading.
    """
    cell, duration = load_cell(Path(settings.cell)), seconds_of(settings.duration)
    rig = rig_of(cell)
    clock, epoch = WallClock(0.0, cell.file.devices.clock_rate), time.time()
    over = threading.Event()
    lines = [_Line(rig, name, clock, epoch, over) for name in rig.drivers]
    begun = time.monotonic()

    def result() -> WatchResult:
        shown = [each for line in lines for each in line.shown]
        shown.sort(key=lambda each: KINDS.index(each.kind))
        return WatchResult(WatchFigures(cell.name, time.monotonic() - begun, tuple(shown)))

    for line in lines:
        line.start()
    try:
        with contextlib.suppress(KeyboardInterrupt):
            while time.monotonic() - begun < duration and not settings.interrupted():
                over.wait(min(_LOOK, duration))
                settings.show(result())
        return result()
    finally:
        over.set()
        for line in lines:
            line.join(_ENDING)


class _Line(threading.Thread):
    """The devices of one driver, connected again whenever they fail.

    Parameters
    ----------
    rig : Rig
        Rig of the cell.
    name : str
        Name of the driver.
    clock : Clock
        Clock of the rig.
    epoch : float
        Time of day of the PC where that shows 0, in s.
    over : Event
        Ends it.
    """

    def __init__(
        self, rig: Rig, name: str, clock: Clock, epoch: float, over: threading.Event
    ) -> None:
        super().__init__(name=f"watch {name}", daemon=True)
        self._epoch = epoch
        self._rig, self._driver, self._clock, self._over = rig, name, clock, over
        self._heard = set[str]()
        self._counted: dict[str, deque[tuple[float, int]]] = {}
        self.shown: tuple[DeviceReading, ...] = tuple(self._unheard("not connected yet"))
        """The newest readings."""

    def run(self) -> None:
        """Connect, look, connect again."""
        while not self._over.is_set():
            try:
                with self._rig.reserved("watch", self._rig.wanted[self._driver]) as reserved:
                    self._look(reserved)
            except (ElastocalError, OSError) as error:
                self._counted.clear()
                self.shown = tuple(self._unheard(str(error)))
            self._over.wait(_AGAIN)

    def _look(self, reserved: ReservedRig) -> None:
        """Show the devices until it is over."""
        rig, seed = self._rig, truth_of(self._rig.cell).seed
        context = RigContext(
            self._clock, seed, self._clock.now(), None, reserved.ports, watches=True
        )
        found = rig.drivers[self._driver].connect(rig.cell, rig.wanted[self._driver], context)
        with contextlib.ExitStack() as opened:
            opened.callback(_close, found)
            look = found.readings or polled_readings(found)
            while not self._over.is_set():
                self.shown = tuple(self._completed(each) for each in look())
                self._over.wait(_LOOK)
                if found.clock is not None:  # simulated devices, whose time passes by sleeping
                    found.clock.sleep(_LOOK)

    def _completed(self, reading: DeviceReading) -> DeviceReading:
        """Return a reading with its rate, and its clock against the PC's time of day."""
        if reading.heard:
            self._heard.add(reading.device)
        rate = None
        if reading.counts is not None:
            counted = self._counted.setdefault(f"{reading.kind} {reading.device}", deque())
            counted.append((self._clock.now(), reading.counts.received))
            while counted[-1][0] - counted[0][0] > _OVER:
                counted.popleft()
            (begin, before), (end, now) = counted[0], counted[-1]
            rate = (now - before) / (end - begin) if end > begin else None
        offset = None if reading.offset is None else reading.offset - self._epoch
        heard = reading.device in self._heard
        return replace(reading, rate=rate, heard=heard, offset=offset)

    def _unheard(self, problem: str) -> Iterator[DeviceReading]:
        """Yield a reading of each device that is not connected."""
        shown = getattr(self, "shown", ())
        for kind, settings in self._rig.wanted[self._driver].items():
            why = problem.removeprefix(f"{self._rig.cell.path}: devices.{kind}: ")
            known = [each.device for each in shown if each.kind == kind]
            places = ", ".join(map(str, settings.device_places()))
            for device in known or [f"{self._driver} {places}".strip()]:
                yield DeviceReading(kind, device, device in self._heard, why)


def _close(found: DeviceSet) -> None:
    """Close the line, ignoring its errors."""
    with contextlib.suppress(ElastocalError, OSError):
        found.close()
