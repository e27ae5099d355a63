"""``touch``: how far the arm has grown since it was cold, by touching the tooling again."""

from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Annotated

from elastocal.cell import Arming
from elastocal.compensation import ArmGrowth, Touches, arm_growth, write_arm_growth
from elastocal.errors import ProcedureError
from elastocal.options import Option, Statements
from elastocal.procedure import (
    RunEnd,
    RunFolder,
    last_known,
    read_journal,
    read_touches,
    require_cold_touches,
)
from elastocal.progress import Progress
from elastocal.records import schema_of
from elastocal.results import brief_repr
from elastocal.workflows._operator_and_devices import Operator, Unattended
from elastocal.workflows._workflow import workflow
from elastocal.workflows.run import RunSettings, run

__all__ = ["ArmGrowth", "TouchSettings", "touch"]


@brief_repr
@dataclass(frozen=True)
class TouchSettings:
    """Settings of ``touch``: the warm cell, and the run of its cold touches."""

    cell: Annotated[str | PathLike[str], Option(argument=True)]
    """Cell file, ``.yaml``."""
    cold: Annotated[Path, Option(metavar="RUN")]
    """Folder of the cold touches, of `run --touch cold`; the same points are touched again."""
    out: Annotated[Path, Option(metavar="STATE.json", ends=(".json",))]
    """File to write the state into."""
    warm: Annotated[Path | None, Option(metavar="RUN")] = None
    """Folder of the warm touches; a run that is in it already is read, not made again. By default
    beside the state, with its name and ``-run``."""
    resume: bool = False
    """Go on with the run that is in that folder."""
    confirmed: Annotated[bool, Option("--yes")] = False
    """A person has looked at the cell: do not ask. On real devices this arms the arm."""
    seed: Annotated[int | None, Option(least=0)] = None
    """Seed of simulated devices; by default the cell's."""
    operator: Operator = field(default_factory=Unattended)
    """Person who is asked and warned; by default nobody, and what asks is refused."""
    state: Statements = field(default_factory=dict)
    """For the certificate, beside the cell file's: see `elastocal.cell.read_statements`."""
    arming: Arming | None = None
    """Arming by a person who agreed before: the cell file must still be the same, to the byte."""
    force: bool = False
    """Replace a state that is there."""

    @property
    def folder(self) -> Path:
        """Folder of the warm run."""
        return self.warm or self.out.with_name(f"{self.out.stem}-run")


@workflow(TouchSettings, marks=(schema_of(ArmGrowth),))
def touch(settings: TouchSettings, progress: Progress) -> ArmGrowth:
    """Touch the tooling warm where it was touched cold, and write how far the arm has grown.

    Raises
    ------
    ProcedureError
        As `run`; or if the two runs are not of the same points.
    CompensationError
        If the touches are too few, or say what is no arm's growth.
    ElastocalError
        If cell, run, a file or a device cannot be used.
    """
    _touch_warm(settings, progress)
    found = read_touches(settings.cold, settings.folder)
    touches = Touches(
        tuple(found.pose.tolist()),
        found.q,
        found.shift,
        found.normal,
        found.by_contact,
        found.lost,
        found.sessions,
        found.pause,
    )
    state = arm_growth(
        found.cell.robot,
        touches,
        cell=found.cell.name,
        times=(found.cold.started, found.warm.started, found.seconds),
    )
    write_arm_growth(settings.out, state)
    return state


def _touch_warm(settings: TouchSettings, progress: Progress) -> None:
    """Make the warm run, unless it has been made; refuse before anything moves for nothing."""
    require_cold_touches(settings.cold)
    folder, given = RunFolder(settings.folder), settings.warm is not None
    if given and folder.journal.is_file() and not settings.resume:
        _require_done(folder)
        return
    finished = run(
        RunSettings(
            settings.cell,
            RunFolder(settings.cold).plan,
            settings.folder,
            resume=settings.resume,
            confirmed=settings.confirmed,
            seed=settings.seed,
            operator=settings.operator,
            state=settings.state,
            touch="warm",
            arming=settings.arming,
        ),
        progress,
    )
    if finished.end is not RunEnd.DONE:
        raise ProcedureError(
            f"{settings.folder}: {finished.figures.message or finished.figures.state}: `--resume`"
            " goes on"
        )


def _require_done(folder: RunFolder) -> None:
    """Refuse a run that was stopped before its end: half of the points would be lost."""
    entries = read_journal(folder.journal)
    if entries and not last_known(entries).finished:
        raise ProcedureError(
            f"{folder.path}: the warm touches are not done: `--resume` goes on with them"
        )
