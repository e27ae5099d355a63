"""The run folder: cell and plan as used, journal, raw streams, and what is derived from them.

Cell, plan and streams are known by their SHA-256 in the journal: what was changed since is refused.
"""

import hashlib
import os
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from elastocal.cell import Cell, fingerprint, load_cell, named_files
from elastocal.errors import FileAccessError, SchemaError
from elastocal.files import read_bytes, read_text, replacing, sha256
from elastocal.findings import Finding, Kind, as_count
from elastocal.planning import PLAN, POOL, PlanResult, read_plan
from elastocal.procedure.record.history import RunRecord
from elastocal.procedure.record.journal import Entry

JOURNAL = "journal.jsonl"

_TORN = Kind("run.journal-torn", "line {line} of {journal}, its last, is torn and left out")
_CUT = Kind(
    "run.journal-cut",
    "{journal} was cut, or is not of this run: it does not name {lost} of {recordings}"
    " ({first} the first): their poses are left out",
    shown={"recordings": as_count("recording")},
)


@dataclass(frozen=True)
class RunFolder:
    """Places in a run's folder."""

    path: Path

    @property
    def cell(self) -> Path:
        """Folder with the cell file and the files that it names."""
        return self.path / "cell"

    @property
    def plan(self) -> Path:
        """Folder with the plan."""
        return self.path / "plan"

    @property
    def journal(self) -> Path:
        """The journal."""
        return self.path / JOURNAL

    @property
    def streams(self) -> Path:
        """Folder with the raw streams."""
        return self.path / "streams"

    @property
    def dataset(self) -> Path:
        """The dataset, derived."""
        return self.path / "dataset.nc"

    @property
    def summary(self) -> Path:
        """The summary, derived."""
        return self.path / "summary.json"

    @property
    def signature(self) -> Path:
        """Signature of the journal, if the run is signed."""
        return self.path / "signature.json"

    def stream(self, pose: int, attempt: int) -> Path:
        """Return the place of the raw streams of an attempt at a pose.

        >>> RunFolder(Path("run")).stream(7, 1).name
        'pose_0007_1.mcap'
        """
        return self.streams / f"pose_{pose:04d}_{attempt}.mcap"


def cell_path_in_run(cell: Cell) -> str:
    """Return the path of the cell file in the run's folder ``cell``.

    Relative paths to the files that it names are the same as in the original, so that the copy can
    be read in the same way.
    """
    return os.path.relpath(_absolute(cell.path), _root(cell))


def fill_folder(folder: RunFolder, cell: Cell, plan: Path) -> None:
    """Put cell and plan into a run's folder, as they are now.

    The journal must be locked: two runs could otherwise fill one folder with two cells.
    Files that the cell names by an absolute path stay where they are.

    Parameters
    ----------
    folder : RunFolder
        Made if it is not there.
    plan : Path
        Folder with the plan.

    Raises
    ------
    FileAccessError
        If something cannot be read or written.
    """
    root = _root(cell)
    for source in (_absolute(cell.path), *_relative_files(cell)):
        _copy(source, folder.cell / os.path.relpath(source, root))
    for name in (PLAN, POOL):
        if (plan / name).is_file():
            _copy(plan / name, folder.plan / name)
    make_folder(folder.streams)


def copies_sha256(folder: RunFolder) -> dict[str, str]:
    """Return the SHA-256 of every file of cell and plan in a run's folder, by its path there.

    Raises
    ------
    FileAccessError
        If one cannot be read.
    """
    places = sorted(place for part in (folder.cell, folder.plan) for place in part.rglob("*"))
    files = (place for place in places if place.is_file())
    return {file.relative_to(folder.path).as_posix(): file_sha256(file) for file in files}


def refuse_foreign_files(folder: RunFolder) -> None:
    """Refuse a folder that holds anything but the beginnings of a run.

    A run that was killed before its first journal entry leaves such beginnings; nothing has moved
    then.

    Raises
    ------
    FileAccessError
        With a name that does not belong there.
    """
    ours = {place.name for place in (folder.cell, folder.plan, folder.journal, folder.streams)}
    try:
        found = {entry.name for entry in folder.path.iterdir()} if folder.path.exists() else set()
    except OSError as error:
        raise FileAccessError(f"cannot read {folder.path}: {error.strerror or error}") from error
    foreign = sorted(found - ours)
    if foreign:
        raise FileAccessError(
            f"{folder.path} holds {foreign[0]!r}, which is no part of a run: name another folder"
        )


def _root(cell: Cell) -> str:
    """Return the deepest folder that holds the cell file and all that it names."""
    folders = [_absolute(cell.path).parent, *(file.parent for file in _relative_files(cell))]
    return os.path.commonpath(folders)


def _relative_files(cell: Cell) -> list[Path]:
    names = dict.fromkeys(named_files(cell))
    return [_absolute(cell.find(name)) for name in names if not Path(name).is_absolute()]


def _absolute(path: Path) -> Path:
    # Not resolve(): a link to a mesh is copied under the name that the cell file knows.
    return Path(os.path.abspath(path))  # noqa: PTH100


def _copy(source: Path, target: Path) -> None:
    make_folder(target.parent)
    with replacing(target) as temporary:
        shutil.copyfile(source, temporary)


def make_folder(folder: Path) -> None:
    """Make a folder and those above it; one that is there is left as it is.

    Raises
    ------
    FileAccessError
        If it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileAccessError(f"cannot make {folder}: {error.strerror or error}") from error


def read_copies(folder: RunFolder, record: RunRecord) -> tuple[Cell, PlanResult]:
    """Return the cell and the plan of a run, from the copies in its folder.

    Parameters
    ----------
    folder : RunFolder
        Folder of the run.
    record : RunRecord
        First entry of its journal, which knows both.

    Raises
    ------
    SchemaError
        If one of them was changed since the run began, or is damaged.
    FileAccessError
        If a file cannot be read.
    """
    check_plan(folder, record)
    cell = load_cell(folder.cell / record.cell_file)
    _refuse_changed(folder.cell, fingerprint(cell), record.cell)
    return cell, read_plan(folder.plan / PLAN)


def check_plan(folder: RunFolder, record: RunRecord) -> None:
    """Refuse a plan that is not the one that the run was made with.

    Parameters
    ----------
    folder : RunFolder
        Folder of the run.
    record : RunRecord
        First entry of its journal.

    Raises
    ------
    SchemaError
        If it was changed since the run began.
    FileAccessError
        If it cannot be read.
    """
    plan = folder.plan / PLAN
    _refuse_changed(plan, sha256(read_text(plan)), record.plan)


def signs_of_a_cut(folder: RunFolder, entries: Sequence[Entry]) -> tuple[Finding, ...]:
    """Return the signs that a journal has lost its end, a sentence each; none as a rule.

    Every attempt at a pose is in the journal before it moves anything, so that no recording is
    without an entry, and every entry ends its line.

    Parameters
    ----------
    folder : RunFolder
        Folder of the run.
    entries : sequence of Entry
        The whole entries of its journal.

    Raises
    ------
    FileAccessError
        If the journal or the folder of streams cannot be read.
    """
    data = read_bytes(folder.journal)
    try:
        recorded = {place.name for place in folder.streams.glob("pose_*.mcap")}
    except OSError as error:
        raise FileAccessError(f"cannot read {folder.path}: {error.strerror or error}") from error
    signs = []
    if not data.endswith(b"\n"):
        last = data.count(b"\n") + 1
        signs.append(_TORN(line=last, journal=JOURNAL))
    named = {entry.log.streams for entry in entries if entry.log is not None}
    named |= {
        folder.stream(entry.pose, entry.attempt).name
        for entry in entries
        if entry.pose is not None and entry.attempt is not None
    }
    if lost := sorted(recorded - named):
        count = len(recorded)
        signs.append(_CUT(journal=JOURNAL, lost=len(lost), recordings=count, first=lost[0]))
    return tuple(signs)


def check_stream(path: Path, known: str | None) -> None:
    """Refuse a stream file that is not the one that the run wrote.

    Parameters
    ----------
    path : Path
        The file.
    known : str or None
        SHA-256 by the journal; None where it knows none.

    Raises
    ------
    SchemaError
        If it was changed.
    FileAccessError
        If it cannot be read.
    """
    if known is not None:
        _refuse_changed(path, file_sha256(path), known)


def file_sha256(path: Path) -> str:
    """Return the hexadecimal SHA-256 of a file.

    Raises
    ------
    FileAccessError
        If it cannot be read.
    """
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise FileAccessError(f"cannot read {path}: {error.strerror or error}") from error


def _refuse_changed(path: Path, found: str, known: str) -> None:
    if found != known:
        raise SchemaError(
            f"{path} is not what the run wrote: its SHA-256 is {found[:12]}, the journal says"
            f" {known[:12]}; put the original back"
        )
