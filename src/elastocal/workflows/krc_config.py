"""``krc-config``: files for a KUKA controller, and the sheet for the signature."""

from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Annotated

from elastocal.cell import LOOPBACK, Cell, load_cell
from elastocal.drivers.kuka_rsi import (
    SHEET,
    Bounds,
    RsiSettings,
    bounds_of,
    check_controller_file,
    controller_files,
    write_controller_files,
)
from elastocal.errors import DeviceError, present
from elastocal.files import read_text
from elastocal.options import Option
from elastocal.progress import Progress
from elastocal.records import record, validate
from elastocal.results import Result
from elastocal.units import in_unit, quantity
from elastocal.workflows._workflow import workflow

_DRIVER = "kuka_rsi"


@dataclass(frozen=True)
class KrcConfigSettings:
    """Settings of ``krc-config``: the cell and the folder."""

    cell: Annotated[str | PathLike[str], Option(argument=True)]
    """Cell file, ``.yaml``, whose arm is a KUKA."""
    out: Annotated[Path | None, Option(metavar="DIR")] = None
    """Folder to write into."""
    check: Annotated[Path | None, Option(metavar="FILE")] = None
    """ETHERNET file or RSI context of a controller, to be checked instead."""
    force: bool = False
    """Replace files that are there."""


@record()
class KrcConfigResult(Result):
    """The files that were written or checked, and the limits that they hold."""

    mode: str
    folder: str | None
    """None if a file was checked."""
    files: tuple[str, ...]
    bounds: Bounds
    delay: float
    """From command to motion, in s."""
    notes: tuple[str, ...]

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        bounds = self.bounds
        return (
            ("mode", self.mode),
            ("folder", self.folder or "nothing written"),
            ("files", ", ".join(self.files)),
            ("largest correction", quantity(bounds.correction, "mm", ".1f")),
            (
                "POSCORR, POSCORRMON",
                f"{in_unit(bounds.poscorr, 'mm'):.1f}, {quantity(bounds.monitor, 'mm', '.1f')}",
            ),
            ("fastest correction", quantity(bounds.speed, "mm/s")),
            ("delay to motion", quantity(self.delay, "ms", ".1f")),
            *(("note", text) for text in self.notes),
        )


@workflow(KrcConfigSettings)
def krc_config(settings: KrcConfigSettings, progress: Progress) -> KrcConfigResult:  # noqa: ARG001 - done in an instant
    """Write what a KUKA controller needs for RSI, and a sheet to be signed; or check a file of it.

    Raises
    ------
    DeviceError
        If the arm's driver is not `elastocal.drivers.kuka_rsi`, or the checked file does not
        provide what the arm's mode needs.
    SchemaError
        If the settings of the arm are invalid.
    FileAccessError
        If a file cannot be read or written, or is there and ``force`` is not given.
    """
    cell = load_cell(Path(settings.cell))
    arm = kuka_settings(cell)
    if (settings.out is None) is (settings.check is None):
        raise DeviceError("krc-config: give either a folder to write into, or a file to check")
    if settings.out is None:
        checked = present(settings.check, "file to check")
        text = read_text(checked)
        try:
            check_controller_file(text, cell, arm)
        except DeviceError as error:
            raise DeviceError(f"{checked}: {error}") from error
        files: tuple[str, ...] = (checked.name,)
    else:
        files = write_controller_files(settings.out, controller_files(cell, arm), settings.force)
    return KrcConfigResult(
        mode=arm.mode,
        folder=None if settings.check is not None else str(settings.out),
        files=files,
        bounds=bounds_of(cell, arm),
        delay=arm.motion_delay(cell),
        notes=_notes(arm),
    )


def kuka_settings(cell: Cell) -> RsiSettings:
    """Return the settings of RSI of a cell with a KUKA.

    Raises
    ------
    DeviceError
        If the arm has another driver.
    SchemaError
        If they are invalid.
    """
    choice, place = cell.file.devices.arm, f"{cell.path}: devices.arm"
    if choice.driver != _DRIVER:
        raise DeviceError(f"{place}: the driver is {choice.driver!r}: must be {_DRIVER!r}")
    return validate(dict(choice.told), RsiSettings, place)


def _notes(arm: RsiSettings) -> tuple[str, ...]:
    notes = [f"nothing of this was tried on a robot: sign {SHEET} line by line before use"]
    if arm.address == LOOPBACK:
        notes.append(f"devices.arm.address is {LOOPBACK}: a controller cannot reach it")
    if arm.commissioning is None and arm.delay is None:
        notes.append("the delay from command to motion is assumed: elastocal measure-delay")
    return tuple(notes)
