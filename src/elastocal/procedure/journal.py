"""Journal of a run: JSON lines, only ever appended to, on the disk before anything moves on.

An entry that is on the disk is complete: a line that a crash has torn is known by its missing end
and cut off before the next entry is written.
"""

import errno
import fcntl
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from elastocal.errors import FileAccessError, SchemaError
from elastocal.procedure.entries import SCHEMA, Entry, Event
from elastocal.procedure.pose_log import PoseLog

Sync = Callable[[int], None]
"""Forces the contents of an open file, given by its descriptor, to the disk."""


class Journal:
    """An open journal; use it as a context manager.

    A lock keeps a second process from the same run for as long as it is open.

    Parameters
    ----------
    path : Path
        File to append to; made when it is not there.
    sync : callable
        ``os.fsync``, or what a test puts in its place.

    Raises
    ------
    FileAccessError
        If the file cannot be opened, read, or is in use.
    SchemaError
        If it holds something else than a journal.
    """

    def __init__(self, path: Path, sync: Sync = os.fsync) -> None:
        self.path, self._sync = Path(path), sync
        try:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o666)
        except OSError as error:
            raise _cannot("write", self.path, error) from error
        try:
            self._lock()
            entries, self._size = _read(self.path)
            self._cut()
        except BaseException:
            os.close(self._file)
            raise
        self._count = len(entries)

    def __enter__(self) -> "Journal":
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._file)

    def write(self, time: float, event: Event, **fields: Any) -> Entry:
        """Append an entry and wait until it is on the disk.

        Parameters
        ----------
        time : float
            In s of the devices' clock.
        event : Event
            Why it is written.
        **fields : Any
            Other fields of `Entry`.

        Raises
        ------
        FileAccessError
            If it cannot be written whole; what was written of it is taken back.
        """
        entry = Entry(n=self._count, time=time, event=event, **fields)
        line = entry.model_dump_json(exclude_defaults=True).encode() + b"\n"
        before = self._count, self._size
        try:
            if os.write(self._file, line) < len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            # Counted before the sync: should that be interrupted, the line is there all the same.
            self._count, self._size = self._count + 1, self._size + len(line)
            self._sync(self._file)
        except OSError as error:
            self._count, self._size = before
            self._cut()
            raise _cannot("write", self.path, error) from error
        return entry

    def _lock(self) -> None:
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise FileAccessError(f"{self.path} is in use: another process runs here") from error

    def _cut(self) -> None:
        """Take a torn line back."""
        try:
            os.ftruncate(self._file, self._size)
        except OSError as error:
            raise _cannot("write", self.path, error) from error


def read_journal(path: Path) -> tuple[Entry, ...]:
    """Return the complete entries of a journal; a torn last line is left out.

    Raises
    ------
    SchemaError
        If it is not a journal, or a line before the last is damaged.
    FileAccessError
        If it cannot be read.
    """
    return _read(Path(path))[0]


def read_commits(path: Path) -> tuple[PoseLog, ...]:
    """Return the poses that a journal says are finished, in the order in which they were."""
    return commits(read_journal(path))


def commits(entries: tuple[Entry, ...]) -> tuple[PoseLog, ...]:
    """Return the finished poses among the entries of a journal."""
    return tuple(entry.log for entry in entries if entry.log is not None)


def _read(path: Path) -> tuple[tuple[Entry, ...], int]:
    """Return the complete entries and the number of bytes that they take."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise _cannot("read", path, error) from error
    whole = data.rfind(b"\n") + 1
    lines = data[:whole].splitlines()
    entries = tuple(_entry(path, number, line) for number, line in enumerate(lines))
    if entries and not _starts(entries[0]):
        raise SchemaError(f"{path}: line 1 is not the start of a run (schema {SCHEMA!r})")
    return entries, whole


def _starts(entry: Entry) -> bool:
    """Return whether an entry is the start of a run, of the schema that is read here."""
    run = entry.run
    return run is not None and run.schema_name == SCHEMA and "schema_name" in run.model_fields_set


def _entry(path: Path, number: int, line: bytes) -> Entry:
    try:
        entry = Entry.model_validate_json(line)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(map(str, first["loc"]))
        raise SchemaError(f"{path}: line {number + 1}: {place}: {first['msg']}") from error
    if entry.n != number:
        raise SchemaError(f"{path}: line {number + 1}: n must be {number}, got {entry.n}")
    return entry


def _cannot(verb: str, path: Path, error: OSError) -> FileAccessError:
    return FileAccessError(f"cannot {verb} {path}: {error.strerror or error}")
