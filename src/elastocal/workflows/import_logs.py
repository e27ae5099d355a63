"""``import``: from foreign logs to a dataset, or positions, and a first map of their columns."""

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Annotated

import numpy as np

from elastocal import logs as foreign
from elastocal.cell import load_cell
from elastocal.dataset import MADE_FROM, Dataset, write
from elastocal.errors import FileAccessError, LogError
from elastocal.files import write_text
from elastocal.logs import ClockFit, GuessedLog, ImportedLogs, ImportedPositions, log_sha256
from elastocal.options import Option
from elastocal.outputs import FIGURE_MARKS
from elastocal.progress import Progress
from elastocal.records import record
from elastocal.report.plots import require_kind, write_timeline_figure
from elastocal.results import Result, brief_repr
from elastocal.wording import counted
from elastocal.workflows._map_questions import answered, map_text
from elastocal.workflows._workflow import workflow


@brief_repr
@dataclass(frozen=True)
class ImportLogsSettings:
    """Settings of an import: logs, map, and dataset."""

    logs: Annotated[Sequence[str | PathLike[str]], Option(argument=True)]
    """CSV or text, Excel, MCAP, ROS 1 and 2 bags; one or several."""
    map: Path
    """Map of their columns."""
    out: Annotated[Path | None, Option(ends=(".nc", ".csv"))] = None
    """Dataset to write (.nc or .csv); none: it is only returned."""
    picture: Path | None = None
    """Figure of the merged time lines (.png, .svg, .pdf); by default beside the dataset."""
    force: bool = False
    """Replace a file that is no former output of this command."""


@brief_repr
@record()
class ImportFigures:
    """The figures of ``import --json``."""

    dataset: str | None
    picture: str | None
    poses: int
    readings: int
    load_cases: tuple[str, ...]
    plateaus: int
    """All that were found, those of no use included."""
    clocks: tuple[ClockFit, ...]
    warnings: tuple[str, ...]


@dataclass(frozen=True, eq=False, repr=False)
class ImportLogsResult(Result):
    """The dataset of some logs, and how it came about."""

    found: ImportedLogs
    figures: ImportFigures

    @property
    def dataset(self) -> Dataset:
        """The dataset."""
        return self.found.dataset

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        figures = self.figures
        return (
            (
                "found",
                f"{counted(figures.readings, 'reading')} at {counted(figures.poses, 'pose')} in"
                f" {counted(figures.plateaus, 'plateau')}",
            ),
            ("load cases", ", ".join(map(self._load, figures.load_cases))),
            *(("clock", each.sentence) for each in figures.clocks),
            *(("warning", text) for text in figures.warnings),
        )

    def _load(self, name: str) -> str:
        """Return a load case with its mean force on the robot in the tcp."""
        forces = [each.force_tcp for each in self.found.plateaus if each.load == name]
        x, y, z = (np.round(np.array(forces).mean(axis=0)) + 0.0).tolist()
        return f"{name} ({x:.0f}, {y:.0f}, {z:.0f} N)"

    def pictured(self) -> object:
        """Return the merged logs."""
        return self.found


@workflow(
    ImportLogsSettings, outputs=("out", "picture"), marks=("elastocal.dataset/", *FIGURE_MARKS)
)
def import_logs(settings: ImportLogsSettings, progress: Progress) -> ImportLogsResult:
    """Merge the logs of controller, force sensor and tracker; find the readings; write a dataset.

    Raises
    ------
    LogError
        If a log cannot be read as the map says, or no dataset can be made of them.
    DatasetError
        If the numbers look like a unit mistake.
    SchemaError
        If the map does not fit.
    FileAccessError
        If a file cannot be read or written.
    """
    files, path = _files(settings.logs), Path(settings.map)
    if settings.picture is not None:
        require_kind(Path(settings.picture))
    log_map = foreign.read_map(path)
    found = foreign.import_streams(log_map, foreign.site(path, log_map), files, progress)
    picture = settings.picture
    if settings.out is not None:
        found = replace(found, dataset=_stating(found.dataset, settings.out, (path, *files)))
        write(found.dataset, settings.out)
        picture = picture or settings.out.with_suffix(".png")
    if picture is not None:
        names = ", ".join(file.name for file in files[:4]) + (" …" if len(files) > 4 else "")
        write_timeline_figure(picture, found, f"Merged logs: {names}")
    dataset = found.dataset
    figures = ImportFigures(
        dataset=None if settings.out is None else str(settings.out),
        picture=None if picture is None else str(picture),
        poses=len(dataset.poses),
        readings=int(dataset.usable.sum()),
        load_cases=dataset.load_cases,
        plateaus=len(found.plateaus),
        clocks=found.clocks,
        warnings=found.warnings,
    )
    return ImportLogsResult(found, figures)


def _stating(dataset: Dataset, out: Path, files: Sequence[Path]) -> Dataset:
    """Return a dataset that states the hashes of the map, which comes first, and of each log.

    Their names are relative to the dataset, so that the folder contains the evidence.
    """
    folder = os.path.realpath(out.parent)
    made_from = {
        Path(os.path.relpath(os.path.realpath(file), folder)).as_posix(): log_sha256(file)
        for file in files
    }
    attributes = {**dataset.attributes, MADE_FROM: json.dumps(made_from)}
    return replace(dataset, attributes=attributes)


@brief_repr
@dataclass(frozen=True)
class ImportPositionsSettings:
    """Settings of an import of positions: logs, map, and table."""

    logs: Annotated[Sequence[str | PathLike[str]], Option(argument=True)]
    """As for `import_logs`; none needs to hold a force."""
    map: Path
    """Map of their columns."""
    out: Annotated[Path | None, Option(ends=(".csv",))] = None
    """Table to write (.csv); none: it is only returned."""
    force: bool = False
    """Replace a file that is no former output of this command."""


@brief_repr
@record()
class PositionFigures:
    """The figures of ``import --for geometry --json``."""

    table: str | None
    rows: int
    poses: int
    markers: int
    stations: tuple[str, ...]
    plateaus: int
    """All that were found, loaded ones included."""
    clocks: tuple[ClockFit, ...]
    warnings: tuple[str, ...]


@dataclass(frozen=True, eq=False, repr=False)
class ImportPositionsResult(Result):
    """The positions of some logs, and how they came about."""

    found: ImportedPositions
    figures: PositionFigures

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        figures = self.figures
        return (
            (
                "found",
                f"{counted(figures.rows, 'row')} of {counted(figures.markers, 'marker')} at"
                f" {counted(figures.poses, 'pose')} in {counted(figures.plateaus, 'plateau')}",
            ),
            ("stations", ", ".join(figures.stations)),
            *(("clock", each.sentence) for each in figures.clocks),
            *(("warning", text) for text in figures.warnings),
        )


@workflow(ImportPositionsSettings)
def import_positions(
    settings: ImportPositionsSettings, progress: Progress
) -> ImportPositionsResult:
    """Merge the logs of controller and tracker; find where the arm stood; write positions.

    The table is that of `geometry`. Where the logs hold forces, plateaus under load do not count.

    Raises
    ------
    LogError
        If a log cannot be read as the map says, or there are too few poses.
    SchemaError
        If the map does not fit.
    FileAccessError
        If a file cannot be read or written, or its name says another kind.
    """
    files, path = _files(settings.logs), Path(settings.map)
    log_map = foreign.read_map(path)
    found = foreign.import_positions(log_map, foreign.site(path, log_map), files, progress)
    if settings.out is not None:
        found.write(settings.out)
    figures = PositionFigures(
        table=None if settings.out is None else str(settings.out),
        rows=len(found),
        poses=len(np.unique(found.pose)),
        markers=found.markers.shape[1],
        stations=tuple(dict.fromkeys(found.station.tolist())),
        plateaus=found.plateaus,
        clocks=found.clocks,
        warnings=found.warnings,
    )
    return ImportPositionsResult(found, figures)


@brief_repr
@dataclass(frozen=True)
class GuessMapSettings:
    """Settings of a first map of logs."""

    logs: Sequence[str | PathLike[str]]
    """Files; folders of ROS 2 bags."""
    out: Path | None = None
    """Map to write; none: its text is only returned."""
    cell: Path | None = None
    """Cell file that says robot, tool, sensor and marker."""
    force: bool = False
    """Replace a map that is there."""
    ask: Callable[[str], str] | None = None
    """Function that asks a person what the logs do not tell (units; without ``cell`` also robot,
    tool, sensor and marker), and returns the answer; an empty one leaves it to be written. None:
    nobody is asked."""


@dataclass(frozen=True, eq=False, repr=False)
class GuessMapResult(Result):
    """Guessed meaning of some logs."""

    logs: tuple[GuessedLog, ...]
    text: str
    """The map."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the meaning that each column was given, and why."""
        return tuple(
            (
                each.log if each.topic is None else f"{each.log} {each.topic}",
                f"{columns.key}: {', '.join(columns.columns)}"
                f"{'' if columns.unit is None else f' in {columns.unit}'} ({columns.why})",
            )
            for each in self.logs
            for columns in each.columns
        )


@workflow(GuessMapSettings)
def guess_map(settings: GuessMapSettings, progress: Progress) -> GuessMapResult:
    """Write a first map of logs, by names and sizes of their columns, for a person to correct.

    Raises
    ------
    LogError
        If a log cannot be read, or none looks like one of a calibration.
    FileAccessError
        If a file cannot be read, or the map is there already.
    """
    files, out = _files(settings.logs), settings.out
    if out is not None and out.exists() and not settings.force:
        raise FileAccessError(f"{out} is there already: name another file, or give --force")
    progress("logs", 0, 1)
    arm = None if settings.cell is None else load_cell(Path(settings.cell), production=False).robot
    joints = None if arm is None else dict(zip(arm.joint_names, arm.revolute, strict=True))
    guessed = foreign.guess_logs(files, joints)
    site: Mapping[str, str] = {}
    folder = Path() if out is None else out.parent
    if settings.ask is not None:
        guessed, site = answered(guessed, settings.ask, folder, about_cell=settings.cell is None)
    progress("logs", 1, 1)
    text = map_text(guessed, site, settings.cell, folder)
    if out is not None:
        write_text(out, text)
    return GuessMapResult(guessed, text)


def _files(logs: Sequence[str | PathLike[str]]) -> list[Path]:
    """Return the files of some logs, each once.

    Raises
    ------
    LogError
        If there is none, or two have the same name, which the map could not distinguish.
    """
    several = (logs,) if isinstance(logs, str | PathLike) else logs
    files = list(dict.fromkeys(Path(log) for log in several))
    if not files:
        raise LogError("no log is given")
    names = [file.name for file in files]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise LogError(f"two logs are named {twice!r}: rename one, the map names logs by file")
    return files
