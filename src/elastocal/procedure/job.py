"""What a run is asked to do, what it needs, and what it says at the end."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Protocol

from elastocal.planning import PlanResult
from elastocal.procedure.progress import Progress
from elastocal.procedure.run_folder import RunFolder
from elastocal.procedure.settings import Settings
from elastocal.procedure.stand import Stand
from elastocal.procedure.supervisor import Recorder
from elastocal.procedure.ways import WayHome


class SavingRecorder(Recorder, Protocol):
    """A recorder that can write what it has kept."""

    def save(self, path: Path) -> str | None:
        """Write everything, atomically, and wait until it is on the disk.

        Returns
        -------
        str or None
            SHA-256 of the file, for the journal; None from a recorder that keeps none.
        """


class End(Enum):
    """How a run ended."""

    DONE = "done"
    """Every pose was tried; the arm is at HOME."""
    STOPPED = "stopped"
    """By a fault."""
    INTERRUPTED = "interrupted"
    """By a person."""


@dataclass(frozen=True)
class Result:
    """How a run, or a stretch of it, ended."""

    end: End
    stand: Stand
    """Where the arm stands."""
    message: str
    """Why; empty when all went well."""
    given_up: tuple[int, ...]
    """Poses of this stretch that could not be had."""
    failed_attempts: int
    """Attempts of this stretch that failed."""


@dataclass(frozen=True, eq=False)
class Job:
    """What is to be done."""

    plan: PlanResult
    settings: Settings
    folder: RunFolder
    committed: frozenset[int] = frozenset()
    """Poses that are finished already."""
    attempts: Mapping[int, int] = field(default_factory=dict)
    """Attempts that each pose has seen already."""
    home: WayHome = field(default_factory=lambda: WayHome(None, ()))
    """The way to HOME, which comes first."""


@dataclass(frozen=True)
class Seams:
    """What a run needs from outside, beside devices."""

    recorder: Callable[[], SavingRecorder]
    """Makes the recorder of one attempt."""
    tell: Callable[[Progress], None] = lambda _: None
    interrupted: Callable[[], bool] = lambda: False
