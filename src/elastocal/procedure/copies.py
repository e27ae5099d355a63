"""Whether what a run folder holds is still what the run put there."""

import hashlib
from pathlib import Path

from elastocal.cell import Cell, fingerprint, load_cell
from elastocal.errors import FileAccessError, SchemaError
from elastocal.files import read_text, sha256
from elastocal.planning import PLAN, PlanResult, read_plan
from elastocal.procedure.entries import RunRecord
from elastocal.procedure.run_folder import RunFolder


def read_copies(folder: RunFolder, record: RunRecord) -> tuple[Cell, PlanResult]:
    """Return the cell and the plan that a run was made with, as they stand in its folder.

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
