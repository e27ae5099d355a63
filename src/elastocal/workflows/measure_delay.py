"""``measure-delay``: how long a KUKA takes from command to motion, for its commissioning record."""

import contextlib
from dataclasses import dataclass, field
from datetime import UTC, datetime
from os import PathLike
from pathlib import Path
from typing import Annotated

import numpy as np

from elastocal.cell import Cell, Clock, Motion, load_cell
from elastocal.drivers.kuka_rsi import (
    CommissioningRecord,
    DelayEstimate,
    KukaArm,
    RsiSettings,
    chirp,
    estimate_delay,
)
from elastocal.errors import DeviceError, of_kind, present
from elastocal.options import Option
from elastocal.progress import Progress
from elastocal.records import write_json
from elastocal.results import Result
from elastocal.sim import truth_of
from elastocal.units import in_unit, parse_quantity, quantity
from elastocal.workflows._operator_and_devices import Operator, Unattended, arm_devices, rig_of
from elastocal.workflows._workflow import workflow
from elastocal.workflows.krc_config import kuka_settings

_MOST_AMPLITUDE = 2e-3
"""In m: the program does not know the free space around the tool."""
_LOOK = 0.02
"""Time between two looks at the arm, in s."""
_SLACK = 10.0
"""Time that a chirp may take beyond its own, in s."""


@dataclass(frozen=True)
class MeasureDelaySettings:
    """Settings of ``measure-delay``: the cell and observers."""

    cell: Annotated[str | PathLike[str], Option(argument=True)]
    """Cell file, ``.yaml``, whose arm is a KUKA in mode ``contact``."""
    out: Annotated[str | PathLike[str], Option(metavar="RECORD.json", ends=(".json",))]
    """Commissioning record, ``.json``."""
    amplitude: str = "0.5 mm"
    """Amplitude of the movement about the tool's present position, with its unit."""
    seconds: float = 6.0
    """Duration of each of the three movements, in s."""
    confirmed: Annotated[bool, Option("--yes")] = False
    """A person has looked at the cell: do not ask."""
    operator: Operator = field(default_factory=Unattended)
    """Person who is asked and warned; by default nobody, and what asks is refused."""
    force: bool = False
    """Replace a file that is there."""


@dataclass(frozen=True, eq=False, repr=False)
class MeasureDelayResult(Result):
    """The delay, and how the arm and its line were meanwhile."""

    out: Path
    measured: CommissioningRecord

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        found, chirps = self.measured, self.measured.chirps
        each = ", ".join(f"{in_unit(chirp.delay, 'ms'):.1f}" for chirp in chirps)
        lag = max(chirp.lag for chirp in chirps)
        return (
            ("delay to motion", f"{quantity(found.delay, 'ms', '.1f')} (x, y, z: {each} ms)"),
            ("of it lag", quantity(lag, "ms", ".1f")),
            ("gain", ", ".join(f"{chirp.gain:.3f}" for chirp in chirps)),
            ("line", found.link.sentence()),
            ("record", str(self.out)),
        )


@workflow(MeasureDelaySettings, marks=("elastocal.commissioning/",))
def measure_delay(settings: MeasureDelaySettings, progress: Progress) -> MeasureDelayResult:
    """Measure the delay from command to motion of a KUKA, with the tool free in the air.

    The tool follows a chirp along each axis of base. Nothing is pressed; a blow stops the arm.

    Raises
    ------
    DeviceError
        If the arm is no KUKA in mode ``contact``, refuses, stops, or does not follow.
    ProcedureError
        If the operator does not agree.
    FileAccessError
        If the record cannot be written.
    """
    cell = load_cell(Path(settings.cell))
    arm_settings = kuka_settings(cell)
    amplitude = parse_quantity(settings.amplitude, "length")
    if not 0.0 < amplitude <= _MOST_AMPLITUDE:
        raise DeviceError(
            f"amplitude {settings.amplitude} must be above 0 and at most"
            f" {quantity(_MOST_AMPLITUDE, 'mm')}"
        )
    if not 2.0 <= settings.seconds <= 60.0:
        raise DeviceError(f"{settings.seconds:g} seconds: must be from 2 to 60")
    rig = rig_of(cell)
    with (
        rig.reserved("measure-delay") as reserved,
        contextlib.closing(reserved.connect(truth_of(cell).seed, 0.0)) as devices,
    ):
        arm = of_kind(devices.arm, KukaArm, "arm")
        settings.operator.warn(
            [f"the tool moves by {settings.amplitude} about where it stands: it must be free there"]
        )
        arm_devices(rig, devices.arm, settings.operator, settings.confirmed)
        arm.enable()
        chirps = []
        for number, axis in enumerate(np.eye(3)):
            progress("chirps", number, 3)
            places = np.outer(chirp(amplitude, settings.seconds, arm_settings.cycle), axis)
            chirps.append(_follow(arm, places, devices.clock, settings.seconds + _SLACK))
        progress("chirps", 3, 3)
        arm.disable()
        found = _record(cell, arm, arm_settings, amplitude, chirps)
    out = Path(settings.out)
    write_json(out, found)
    return MeasureDelayResult(out, found)


def _follow(arm: KukaArm, places: np.ndarray, clock: Clock, most: float) -> DelayEstimate:
    """Return the response of the arm to a chirp, shape (cycle, 3), in m."""
    recorder, begun = arm.excite(places), clock.now()
    while (excitation := recorder.excitation()) is None or arm.state().motion is Motion.MOVING:
        state = arm.state()
        if state.fault is not None or not clock.now() - begun <= most:
            arm.stop()
            raise DeviceError(f"the chirp was not followed: {state.fault or 'it takes too long'}")
        clock.sleep(_LOOK)
    return estimate_delay(excitation)


def _record(
    cell: Cell,
    arm: KukaArm,
    settings: RsiSettings,
    amplitude: float,
    chirps: list[DelayEstimate],
) -> CommissioningRecord:
    return CommissioningRecord(
        cell=cell.name,
        robot=cell.robot.name,
        controller=settings.robot,
        made=datetime.now(UTC).isoformat(timespec="seconds"),
        cycle=settings.cycle,
        delay=max(each.delay for each in chirps),
        amplitude=amplitude,
        chirps=tuple(chirps),
        link=present(arm.link, "link").statistics(),
    )
