"""Rule for outputs: no command overwrites an input, a record of a run, or a foreign file.

The rule holds for every command. `elastocal.workflows` applies it to the work with the paths that
the settings name, and `elastocal.files`, through which every file is read and written, checks it:
every file that was read is an input.

An input is identified by its inode and by its name without regard to case: controllers and two of
three operating systems take ``A.SRC`` for ``a.src``. Files that belong together, such as a
program's ``.src`` and ``.dat``, are treated as one.
"""

import contextlib
import errno
import os
from collections.abc import Iterable, Iterator
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path

from elastocal.errors import FileAccessError

RUN_RECORD = (
    *("journal.jsonl", "cell", "plan", "streams", "dataset.nc", "summary.json", "signature.json"),
)
"""Files that make up the record of a run in its folder; the first, the journal, identifies it."""
FIGURE_MARKS = ("<dc:title>elastocal</dc:title>", "Software\0elastocal", "/Creator (elastocal)")
"""Marks that identify figures of elastocal: SVG, PNG and PDF."""
_TWINS = {".dat": ".src", ".csv": ".nc"}
"""Suffixes of files that belong to those of the same name with another: program, dataset."""
_LOOKED_AT = 1 << 20
"""Number of bytes at both ends of a file that are searched for the mark."""

_Key = tuple[int, int] | str


@dataclass
class OutputRule:
    """The rule for the outputs of the current command."""

    force: bool = False
    """Replace foreign files, too."""
    has_force: bool = True
    """Whether the user can request that."""
    marks: tuple[str, ...] = ()
    """Texts by one of which a former output of this command is known."""
    folder: Path | None = None
    """Folder of the outputs; the caller has refused one with foreign files."""
    record: Path | None = None
    """Folder of a run whose record this command writes."""
    _inputs: dict[_Key, Path] = field(default_factory=dict)
    _written: set[_Key] = field(default_factory=set)
    """Names alone."""

    def note_input(self, path: Path) -> None:
        """Remember a file or folder that is read; what the command wrote itself is no input."""
        keys = _keys(path)
        if keys[0] not in self._written:
            self._inputs |= dict.fromkeys(keys, path)

    def note_output(self, path: Path) -> None:
        """Remember a file that was written: it may be read, and replaced."""
        self._written.add(_keys(path)[0])

    def require(self, path: Path) -> None:
        """Refuse a place for an output.

        Raises
        ------
        FileAccessError
            If it is an input or belongs to one; if it belongs to the record of a run; if a foreign
            file is there.
        """
        keys = _keys(path)
        if keys[0] in self._written:
            return
        for key in keys:
            if (found := self._inputs.get(key)) is not None:
                other = _keys(found)
                is_same = other[0] == keys[0] or (other[2:] == keys[2:] != ())
                same = "it is" if is_same else f"it stands for {found}, which is"
                raise FileAccessError(
                    f"cannot write {path}: {same} an input of this command; name another file"
                )
        if (run := _run_of(path)) is not None and not _same(run, self.record):
            raise FileAccessError(
                f"cannot write {path}: it is in the record of the run {run}; name another file"
            )
        inside = any(_same(above, self.folder) for above in path.parents)
        if not self.force and not inside and path.is_file() and not self._is_ours(path):
            known = ", and no former output of this command" if self.marks else ""
            or_force = ", or give --force to replace it" if self.has_force else ""
            raise FileAccessError(
                f"cannot write {path}: it is there already{known}; name another file{or_force}"
            )

    def _is_ours(self, path: Path) -> bool:
        """Return whether a file has the mark of this command, or nothing in it."""
        try:
            with path.open("rb") as file:
                found = file.read(_LOOKED_AT)
                file.seek(max(len(found), os.fstat(file.fileno()).st_size - _LOOKED_AT))
                found += file.read(_LOOKED_AT)
        except OSError as error:
            raise FileAccessError(f"cannot read {path}: {error.strerror or error}") from error
        return not found or any(mark.encode() in found for mark in self.marks)


_AT_WORK: ContextVar[OutputRule | None] = ContextVar("output_rule", default=None)


@contextlib.contextmanager
def ruled(
    rule: OutputRule, inputs: Iterable[Path] = (), outputs: Iterable[Path] = ()
) -> Iterator[None]:
    """Apply a rule to a command; its outputs are checked before it begins.

    Parameters
    ----------
    inputs, outputs : iterable of Path
        Paths that the settings name.

    Raises
    ------
    FileAccessError
        If an output may not be written (see `OutputRule.require`), or two are one file.
    """
    for path in inputs:
        rule.note_input(path)
    named: set[_Key] = set()
    for path in outputs:
        rule.require(path)
        name = _keys(path)[0]
        if name in named:
            raise FileAccessError(f"cannot write two outputs to {path}; name another file")
        named.add(name)
    token = _AT_WORK.set(rule)
    try:
        yield
    finally:
        _AT_WORK.reset(token)


def current_rule() -> OutputRule | None:
    """Return the rule of the current command; None outside of one, as in library use."""
    return _AT_WORK.get()


def _keys(path: Path) -> tuple[_Key, ...]:
    """Return by what a file is known: its name, that of its twins, and its inode if it is there."""
    place = Path(os.path.realpath(path))
    suffix = place.suffix.lower()
    twin = place.with_suffix(_TWINS.get(suffix, suffix)) if suffix else place
    try:
        found = place.stat()
    except (OSError, ValueError) as error:
        if isinstance(error, OSError) and error.errno == errno.ELOOP:
            raise FileAccessError(f"cannot use {path}: {error.strerror}") from error
        return str(place).casefold(), str(twin).casefold()
    return str(place).casefold(), str(twin).casefold(), (found.st_dev, found.st_ino)


def _run_of(path: Path) -> Path | None:
    """Return the folder of the run to whose record a place belongs."""
    place = Path(os.path.realpath(path))
    for folder in place.parents:
        part = place.relative_to(folder).parts[0].casefold()
        if part in RUN_RECORD and (folder / RUN_RECORD[0]).is_file():
            return folder
    return None


def _same(path: Path, other: Path | None) -> bool:
    return other is not None and os.path.realpath(path) == os.path.realpath(other)
