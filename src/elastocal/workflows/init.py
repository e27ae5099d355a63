"""``init``: a commented example cell with its mesh, to be edited into one's own."""

from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from elastocal.cell import write_example
from elastocal.progress import Progress
from elastocal.results import Result
from elastocal.workflows._workflow import workflow


@dataclass(frozen=True)
class InitSettings:
    """Which example goes where."""

    out: str | PathLike[str]
    """Folder to write into."""
    kind: str = "afp"
    """``afp`` or ``machining``."""
    force: bool = False
    """Replace files that are there."""


@dataclass(frozen=True, repr=False)
class InitResult(Result):
    """The files of an example cell."""

    cell: Path
    meshes: tuple[Path, ...]

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return what was written."""
        return (("cell", str(self.cell)), ("meshes", ", ".join(map(str, self.meshes)) or "none"))


@workflow(InitSettings)
def init(settings: InitSettings, progress: Progress) -> InitResult:  # noqa: ARG001 - an instant
    """Write a commented example cell with its mesh.

    Parameters
    ----------
    settings : InitSettings
        Or its ``out``, and the other fields by name.
    progress : Progress, optional
        Called with stage, done and total.

    Raises
    ------
    SchemaError
        If there is no such example.
    FileAccessError
        If a file is there already or cannot be written.
    """
    cell, *meshes = write_example(Path(settings.out), settings.kind, settings.force)
    return InitResult(cell, tuple(meshes))
