"""``derive``: from a run's journal and raw streams to its dataset, again."""

from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Annotated

from elastocal.cell import SensorLoad
from elastocal.compensation.conditioning import read_sensor_load
from elastocal.dataset import Dataset
from elastocal.errors import ProcedureError
from elastocal.options import Option
from elastocal.procedure import (
    RunFolder,
    RunSummary,
    derive_run,
    read_copies,
    read_journal,
    write_derived,
)
from elastocal.progress import Progress
from elastocal.results import Result
from elastocal.wording import counted
from elastocal.workflows._workflow import workflow


@dataclass(frozen=True)
class DeriveSettings:
    """Settings of ``derive``: the run."""

    run: Annotated[str | PathLike[str], Option(argument=True)]
    """Folder of the run; dataset and summary in it are replaced."""
    tool: Path | None = None
    """Tool file of `tool`, whose sensor rotation and matrix correct the readings; the compensator
    must have the same."""


@dataclass(frozen=True, eq=False, repr=False)
class DeriveResult(Result):
    """The dataset and summary that the raw streams of a run give."""

    folder: RunFolder
    dataset: Dataset
    summary: RunSummary

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        return (
            ("measured", self.poses()),
            ("readings", self.counts()),
            *(("warning", text) for text in self.summary.warnings),
        )

    def pictured(self) -> object:
        """Return the readings: the picture shows their deflections."""
        return self.dataset

    def poses(self) -> str:
        """Return the number of committed poses, with that of the plan where some are missing."""
        found = self.summary.poses
        if not found.missing:
            return counted(found.committed, "pose")
        return f"{found.committed} of {found.planned} planned poses"

    def counts(self) -> str:
        """Return the number of readings of each status, as a phrase."""
        counts = self.summary.readings.counts
        return ", ".join(f"{number} {status}" for status, number in counts.items() if number)


@workflow(DeriveSettings, record="run")
def derive(settings: DeriveSettings, progress: Progress) -> DeriveResult:  # noqa: ARG001 - an instant
    """Derive ``dataset.nc`` and ``summary.json`` of a run again from its raw streams.

    Raises
    ------
    ElastocalError
        If the folder holds no run, or its streams cannot be derived.
    FileAccessError
        If a file cannot be read or written.

    Examples
    --------
    >>> import elastocal as ec
    >>> run = ec.datasets.afp_run("afp", poses=4)
    >>> dict(ec.derive(run).facts())["readings"]
    '32 ok'
    """
    folder = RunFolder(Path(settings.run))
    derived = derive_run(folder.path, _sensor(folder, settings.tool), settings.tool)
    derived = write_derived(folder.path, derived)
    return DeriveResult(folder, derived.dataset, derived.summary)


def _sensor(folder: RunFolder, tool: Path | None) -> SensorLoad | None:
    """Return the tool of a file on the sensor of a run's cell; None for no file."""
    if tool is None:
        return None
    entries = read_journal(folder.journal)
    if not entries or entries[0].run is None:
        raise ProcedureError(f"{folder.journal}: no pose is committed: there is nothing to derive")
    cell, _ = read_copies(folder, entries[0].run)
    return read_sensor_load(tool, cell.robot)
