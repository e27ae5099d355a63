"""``init``: a commented example cell with its mesh and its production, to be edited."""

from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Annotated

from elastocal.cell import PROCESS_FILE, load_cell, name_process, write_example
from elastocal.compensation.process import PROCESSES, process_courses, write_programmed_path
from elastocal.dataset import joint_dimensions
from elastocal.errors import FileAccessError
from elastocal.files import read_text, write_text
from elastocal.options import Option
from elastocal.progress import Progress
from elastocal.results import Result
from elastocal.workflows._workflow import workflow

_SEED = 0
"""Seed of the forces of production."""


@dataclass(frozen=True)
class InitSettings:
    """Settings of ``init``: example and folder."""

    out: Annotated[str | PathLike[str], Option(argument=True, metavar="DIR")]
    """Folder to write into."""
    kind: Annotated[str, Option("--like", choices="example")] = "afp"
    """``afp``, ``machining`` or ``ur20``."""
    force: bool = False
    """Replace files that are there."""
    wire: bool = False
    """Name devices on the wire, as `simulate` serves them on this machine."""


@dataclass(frozen=True, repr=False)
class InitResult(Result):
    """The files of an example cell."""

    cell: Path
    meshes: tuple[Path, ...]
    process: Path | None
    """Production path: joints and forces; none where the example has none."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the files that were written."""
        return (
            ("cell", str(self.cell)),
            ("meshes", ", ".join(map(str, self.meshes)) or "none"),
            ("process", "none" if self.process is None else str(self.process)),
        )


@workflow(InitSettings)
def init(settings: InitSettings, progress: Progress) -> InitResult:  # noqa: ARG001 - seconds
    """Write a commented example cell with its mesh and its production path.

    The path is the one that ``simulate-process`` runs for seed 0.

    Raises
    ------
    SchemaError
        If there is no such example.
    FileAccessError
        If a file is there already or cannot be written.

    Examples
    --------
    >>> import elastocal as ec
    >>> ec.init("cell").facts()[0]
    ('cell', 'cell/cell.yaml')
    """
    path = Path(settings.out) / PROCESS_FILE
    if path.exists() and not settings.force:
        raise FileAccessError(f"{path} is there already: give --force to replace it")
    file, *meshes = write_example(Path(settings.out), settings.kind, settings.force, settings.wire)
    if settings.kind not in PROCESSES:
        return InitResult(file, tuple(meshes), None)
    cell = load_cell(file)
    courses = process_courses(settings.kind, cell, _SEED, None)
    units = joint_dimensions(cell.robot.joint_names, cell.robot.revolute)
    write_programmed_path(path, courses, units)
    # Last: a cell file that names a path has one.
    write_text(file, name_process(read_text(file)))
    return InitResult(file, tuple(meshes), path)
