"""Journal of a run: JSON lines that are only appended, each on the disk before the run goes on.

Entries on the disk are complete: a line that a crash has truncated lacks its end and is removed
before the next entry is written. Each line ends with a checksum of itself and of the line before
it, which reveals changed and missing lines.
"""

import contextlib
import hashlib
import os
import re
from collections.abc import Callable, Iterator
from enum import Enum
from pathlib import Path
from typing import Any

from elastocal.cell import Clock, LineCounts
from elastocal.errors import FileAccessError, SchemaError
from elastocal.files import read_bytes
from elastocal.locks import lock_file
from elastocal.procedure.record.history import JOURNAL_SCHEMA, RunRecord
from elastocal.records import StrictModel, from_data, parse_json


class ReadingStatus(Enum):
    """Quality of a reading; the flags of ``status`` (docs/reference/files/dataset.md)."""

    OK = "ok"
    SLIPPED = "slipped"
    UNSTABLE = "unstable"
    ABORTED = "aborted"
    MISSING = "missing"


class Window(StrictModel):
    """A stretch of time over which the streams are averaged to one reading."""

    load_case: str | None
    """Name of the load case; None: the unloaded reference."""
    start: float
    """In s of the clock."""
    end: float
    """In s of the clock, after ``start``; equal to it where nothing could be averaged."""
    station: str | None
    """Tracker station that measured; None in a cell without metrology."""
    status: ReadingStatus
    note: str = ""
    """Why it is not ok."""


class PoseLog(StrictModel):
    """One committed pose: its unloaded reference first, then every load case in order."""

    pose: int
    """Id in the plan."""
    attempt: int
    """Number of the attempt, from 1; earlier attempts failed and were given up."""
    streams: str
    """Name of the file with the raw streams, in the run's folder ``streams``."""
    windows: tuple[Window, ...]


_BYTES: int = getattr(os, "O_BINARY", 0)
"""Keeps Windows from writing another line end than it is given."""
_CHECKED = re.compile(rb'(\{.+),"line_check":"([0-9a-f]{16})"\}')
"""A line with its checksum."""


class Event(Enum):
    """Why an entry was written."""

    START = "start"
    """First entry of a run; holds `RunRecord`."""
    RESUME = "resume"
    """A person let the run go on."""
    BEGIN = "begin"
    """Written before the devices receive a command to move or press."""
    END = "end"
    """Written after that is over."""
    FAULT = "fault"
    """Something made an attempt, or the run, fail."""
    COMMIT = "commit"
    """A pose is finished and its streams are on the disk; holds its `PoseLog`."""
    GIVEN_UP = "given up"
    """All attempts at a pose failed; the run goes on without it."""
    ASKED = "asked"
    """A person is asked to do something in the cell, the arm at HOME and disarmed."""
    HANDLED = "handled"
    """The person has said that it is done."""
    ENOUGH = "enough"
    """The run has what was wanted of it; the poses left are not measured."""
    FINISH = "finish"
    """Last entry of a session; holds what was counted on the lines of its devices."""


class Action(Enum):
    """Command to the arm between two entries."""

    ENABLE = "enable"
    MOVE = "move"
    APPROACH = "approach"
    HOLD = "hold"
    RELEASE = "release"
    RETRACT = "retract"
    STOP = "stop"
    DISABLE = "disable"


class Entry(StrictModel):
    """One line of a journal."""

    n: int
    """Running number, from 0."""
    time: float
    """In s of the devices' clock."""
    event: Event
    pose: int | None = None
    """Id in the plan; None between poses."""
    attempt: int | None = None
    """Number of the attempt at this pose, from 1."""
    step: str | None = None
    """State of the procedure."""
    action: Action | None = None
    target: str | tuple[float, ...] | None = None
    """Joint positions of a move in rad or m; name of the load case of a hold; distance of a
    straight motion in m."""
    text: str = ""
    """Text for people: what went wrong, the origin of a reading, or when a run was gone on with,
    ISO 8601, UTC."""
    run: RunRecord | None = None
    log: PoseLog | None = None
    streams_sha256: str | None = None
    """SHA-256 of the file with the raw streams of a finished pose."""
    lines: tuple[LineCounts, ...] = ()
    """Counts on the lines of the devices, at the end of a session."""


Sync = Callable[[int], None]
"""Forces the contents of an open file, given by its descriptor, to the disk."""


class Journal:
    """An open journal; use it as a context manager.

    A lock keeps a second process from the same run for as long as it is open.

    Parameters
    ----------
    path : Path
        File to append to; made when it is not there.
    sync : callable, optional
        ``os.fsync``, or what a test puts in its place. None where simulated devices are recorded:
        what a power failure takes of their run can be made again.

    Raises
    ------
    FileAccessError
        If the file cannot be opened, read, or is in use.
    SchemaError
        If it holds something else than a journal.
    """

    def __init__(self, path: Path, sync: Sync | None = os.fsync) -> None:
        self.path, self._sync = Path(path), sync
        try:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | _BYTES, 0o666)
        except OSError as error:
            raise _cannot("write", self.path, error) from error
        try:
            self._lock()
            entries, self._size, self._check = _read(self.path)
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
        """Append an entry and wait until it is on the disk; see ``sync``.

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
        body = entry.model_dump_json(exclude_defaults=True).encode()[:-1]
        check = _line_check(self._check, body)
        line = b'%s,"line_check":"%s"}\n' % (body, check)
        before = self._count, self._size, self._check
        try:
            rest = line
            while rest:  # A disk that is full says so when the rest is written.
                rest = rest[os.write(self._file, rest) :]
            # Counted before the sync: if that is interrupted, the line is written nevertheless.
            self._count, self._size = self._count + 1, self._size + len(line)
            self._check = check
            if self._sync is not None:
                self._sync(self._file)
        except OSError as error:
            self._count, self._size, self._check = before
            self._cut()
            raise _cannot("write", self.path, error) from error
        return entry

    def _lock(self) -> None:
        try:
            lock_file(self._file)
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


def why_enough(entries: tuple[Entry, ...]) -> str:
    """Return why a run has enough poses; empty: it has not, or has gone on since."""
    last = (e for e in reversed(entries) if e.event in (Event.ENOUGH, Event.COMMIT))
    found = next(last, None)
    return found.text if found is not None and found.event is Event.ENOUGH else ""


def _read(path: Path) -> tuple[tuple[Entry, ...], int, bytes]:
    """Return the complete entries, the bytes that they take, and the checksum of the last.

    Older journals have no checksums, up to the line where a later version continued them.
    """
    data = read_bytes(path)
    whole = data.rfind(b"\n") + 1
    entries, check = [], b""
    for number, line in enumerate(data[:whole].split(b"\n")[:-1]):
        what, checked = f"{path}: line {number + 1}", _CHECKED.fullmatch(line)
        if checked is not None:
            line, stated = checked[1] + b"}", checked[2]
            check = _line_check(check, checked[1])
        if check and (checked is None or stated != check):
            raise SchemaError(
                f"{what} was changed after it was written, or the one before it is gone: its"
                f" checksum is not {check.decode()}; put the original journal back"
            )
        entries.append(_entry(what, number, line))
    if entries and not _starts(entries[0]):
        raise SchemaError(f"{path}: line 1 is not the start of a run (schema {JOURNAL_SCHEMA!r})")
    return tuple(entries), whole, check


def _line_check(before: bytes, body: bytes) -> bytes:
    """Return the checksum of a line: of that of the line before it, and of its own text."""
    return hashlib.sha256(before + body).hexdigest()[:16].encode()


def _starts(entry: Entry) -> bool:
    """Return whether an entry is the start of a run, of the schema that is read here."""
    run = entry.run
    return (
        run is not None
        and run.schema_name == JOURNAL_SCHEMA
        and "schema_name" in run.model_fields_set
    )


def _entry(what: str, number: int, line: bytes) -> Entry:
    entry = from_data(Entry, parse_json(line, what), what)
    if entry.n != number:
        raise SchemaError(f"{what}: n must be {number}, got {entry.n}")
    return entry


def _cannot(verb: str, path: Path, error: OSError) -> FileAccessError:
    return FileAccessError(f"cannot {verb} {path}: {error.strerror or error}")


class Logbook:
    """Writes entries; knows pose, attempt and step.

    Parameters
    ----------
    journal : Journal
        Where to.
    clock : Clock
        Clock of the devices.
    """

    def __init__(self, journal: Journal, clock: Clock) -> None:
        self._journal, self._clock = journal, clock
        self.pose: int | None = None
        self.attempt: int | None = None
        self.step: str | None = None
        self.must_write = True
        """False while the cell is made safe: a full disk then must not stop that."""

    def write(self, event: Event, **fields: Any) -> None:
        """Append an entry; see `Journal.write`."""
        place = {"pose": self.pose, "attempt": self.attempt, "step": self.step}
        try:
            self._journal.write(self._clock.now(), event, **{**place, **fields})
        except FileAccessError:
            if self.must_write:
                raise

    @contextlib.contextmanager
    def actuation(
        self, action: Action, target: str | tuple[float, ...] | None = None
    ) -> Iterator[None]:
        """Write an entry before and, if nothing goes wrong in between, one after."""
        self.write(Event.BEGIN, action=action, target=target)
        yield
        self.write(Event.END, action=action)
