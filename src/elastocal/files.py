"""Files: written atomically, and identified by their content.

A file that is being written lives beside its target under a temporary name and takes the target's
name only after it has reached the disk, so that neither a crash nor Ctrl-C leaves half a file. It
is locked while its writer lives, so that the leftovers of a killed writer are recognised;
`remove_leftovers` removes them.

Reading and writing obey the rule of the current command, `elastocal.outputs`.

The memory and time that a file may need are bounded (`Limit`), since a few hundred bytes of a
foreign file can request more than there is.
"""

import contextlib
import glob
import hashlib
import json
import os
import secrets
import shutil
import stat
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from elastocal.errors import FileAccessError, SchemaError, require_type
from elastocal.locks import show_life, taken_over
from elastocal.outputs import current_rule

_STANDARD_INPUT = Path("/dev/stdin")
_DESCRIPTORS = (Path("/dev/fd"), Path("/proc/self/fd"))
"""Folder where a shell places what it pipes into a command by name (``<(...)``)."""
_UNDER_WAY = ".elastocal-"
"""Part of the name of a file that is being written, after a dot and its final name."""
_NO_FILE = "it is a folder or a device, not a file"
_LONGEST_NAME = 200
"""Letters of a name that are kept there: file systems take 255 bytes."""


@dataclass(frozen=True)
class Limit:
    """A bound on what a file may ask for, which an environment variable raises."""

    variable: str
    """Name of the environment variable."""
    default: int
    """The bound when it is not set."""
    unit: str
    """Name of the counted quantity."""

    @property
    def most(self) -> int:
        """The bound.

        Raises
        ------
        FileAccessError
            If the environment variable is not a whole number above 0.
        """
        text = os.environ.get(self.variable, str(self.default))
        if not (text.isascii() and text.isdigit() and int(text[:18]) > 0):
            raise FileAccessError(
                f"{self.variable} is {text!r:.40}: it must be a whole number above 0"
            )
        return int(text[:18])

    def require(self, found: float, what: str) -> None:
        """Refuse what is more than the bound.

        Raises
        ------
        SchemaError
            With the bound and how to raise it.
        """
        if not found <= self.most:
            raise SchemaError(f"{what} {self.exceeded}")

    @property
    def exceeded(self) -> str:
        """The end of a sentence on what is more than the bound."""
        return f"is more than {self.most} {self.unit} (the variable {self.variable} raises this)"


_MOST_READ = Limit("ELASTOCAL_MAX_FILE_MB", 100, "MB")
"""Size of a file that is read whole: texts, meshes, streams."""
_MEGABYTE = 1_000_000


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path that becomes ``path`` when the block ends without an error.

    Raises
    ------
    FileAccessError
        If the folder does not exist or cannot be written, or the command at work must not write
        there.
    """
    path, rule = Path(path), current_rule()
    try:
        if path.exists() and not path.is_file():
            raise IsADirectoryError(_NO_FILE)
        if rule is not None:
            rule.require(path)
            # A command makes the folder that an output is named in; a function of the library
            # writes where it is told.
            path.parent.mkdir(parents=True, exist_ok=True)
        with _under_way(path, _make_file, path.suffix) as temporary:
            yield temporary
            _flush_to_disk(temporary)
            temporary.chmod(0o666 & ~_umask())
            temporary.replace(path)
            if rule is not None:
                rule.note_output(path)
    except FileAccessError:
        raise  # of another file: it says so itself
    except UnicodeEncodeError as error:
        raise FileAccessError(
            f"cannot write {path}: a name in it is no text in UTF-8: rename that file"
        ) from error
    except OSError as error:
        raise FileAccessError(f"cannot write {path}: {error.strerror or error}") from error


def as_path(given: Any, name: str, *others: str) -> Path:
    """Return the path that an argument of a public function is.

    Parameters
    ----------
    name : str
        The argument, for the message.
    others : str
        What the function takes beside a path, for the message.

    Raises
    ------
    TypeError
        If it is neither a text nor a path.
    """
    require_type(given, (str, os.PathLike), name, ", ".join(("path", *others)))
    return Path(given)


def path_from(folder: Path, file: str | os.PathLike[str]) -> str:
    """Return the path of a file from a folder, as every system reads it."""
    try:
        return Path(os.path.relpath(file, folder)).as_posix()
    except ValueError:  # on another drive
        return Path(file).resolve().as_posix()


def require_place(path: Path) -> None:
    """Refuse a place at which no file can be written, before there is anything to write.

    Raises
    ------
    FileAccessError
        If its folder cannot be made or written into, it is itself no file, or the command at work
        must not write there.
    """
    path = Path(path)
    if (rule := current_rule()) is not None:
        rule.require(path)
    try:
        folder = next((each for each in path.parents if os.path.lexists(each)), Path())
        if not stat.S_ISDIR(folder.stat().st_mode):
            raise NotADirectoryError(f"{folder} is a file, not a folder")
        if path.exists() and not path.is_file():
            raise IsADirectoryError(_NO_FILE)
        if not os.access(folder, os.W_OK | os.X_OK):
            raise PermissionError(f"nobody may write into {folder}")
    except OSError as error:
        raise FileAccessError(f"cannot write {path}: {error.strerror or error}") from error


@contextlib.contextmanager
def filling(folder: Path, last: str, force: bool = False) -> Iterator[Path]:
    """Yield a temporary folder whose files move into ``folder`` when the block ends without error.

    The file named ``last`` is moved last, and one of that name that is there already is removed
    first: where it is, the files around it belong to it.

    Parameters
    ----------
    folder : Path
        Made if it is not there.
    last : str
        Name of the file by which the folder is known.
    force : bool
        Whether files in the folder may be replaced; those with other names stay.

    Raises
    ------
    FileAccessError
        If the folder holds files and ``force`` is not given, it or a file cannot be written, or
        the command at work must not write there.
    """
    folder, rule = Path(folder), current_rule()
    for place in (folder, *folder.parents):
        if place.is_file():
            raise FileAccessError(f"cannot write {folder}: {place} is a file, not a folder")
    try:
        holds = sorted(entry.name for entry in folder.iterdir()) if folder.exists() else []
        if holds and not force:
            raise FileAccessError(
                f"{folder} holds files already ({holds[0]}{' and others' if holds[1:] else ''}):"
                " name another folder, or give --force to replace what is in it"
            )
        if rule is not None:
            rule.require(folder / last)
        folder.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        if isinstance(error, FileAccessError):
            raise
        raise FileAccessError(f"cannot write {folder}: {error.strerror or error}") from error
    temporary = None
    try:
        with _under_way(folder, _make_folder) as temporary:
            yield temporary
            _move_all(temporary, folder, last)
    except FileAccessError as error:
        # Nobody has asked for the temporary folder, and it is gone when this is read.
        raise FileAccessError(str(error).replace(str(temporary), str(folder))) from error
    except OSError as error:
        if error.filename is not None and _prefix(folder) not in str(error.filename):
            raise  # of a file elsewhere, which its name says
        raise FileAccessError(f"cannot write {folder}: {error.strerror or error}") from error


def _move_all(source: Path, folder: Path, last: str) -> None:
    """Move what a folder holds into another, one of it last; all of it, or nothing, is allowed."""
    names, rule = sorted(entry.name for entry in source.iterdir()), current_rule()
    if rule is not None:
        for name in names:
            rule.require(folder / name)
    folder.mkdir(exist_ok=True)
    (folder / last).unlink(missing_ok=True)
    for name in sorted(names, key=lambda name: name == last):
        (source / name).replace(folder / name)
        if rule is not None:
            rule.note_output(folder / name)


def remove_leftovers(output: Path) -> None:
    """Remove what writers that were killed left beside an output and in it, if it is a folder.

    What is at work is left alone.
    """
    pattern = f".*{_UNDER_WAY}*"
    inside = [*output.glob(pattern), *output.glob(f"*/{pattern}")]
    for place in (*output.parent.glob(f"{glob.escape(_prefix(output))}*"), *inside):
        with contextlib.suppress(OSError), taken_over(place) as abandoned:
            if abandoned and place.is_dir():
                shutil.rmtree(place)
            elif abandoned:
                place.unlink()


@contextlib.contextmanager
def _under_way(path: Path, make: Callable[[Path], None], suffix: str = "") -> Iterator[Path]:
    """Yield a new temporary file or folder beside ``path`` that shows that we live.

    Its name is known before it is made, so that it is removed even where a signal arrives then.
    """
    # The folder that one is in has a name, too, but for the root of all.
    path = path if path.name else path.absolute()
    if not path.name:
        raise FileAccessError(f"cannot write {path}: it is the root of all folders")
    made = False
    while not made:
        place = path.with_name(f"{_prefix(path)}{secrets.token_urlsafe(6)}{suffix}")
        with contextlib.ExitStack() as ending:
            ending.callback(_remove, place)
            make(place)
            ending.callback(show_life(place))
            # Between the two, another process may have taken it for a leftover.
            made = place.exists()
            if made:
                yield place


def _make_file(place: Path) -> None:
    os.close(os.open(place, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o600))


def _make_folder(place: Path) -> None:
    place.mkdir(0o700)


def _remove(place: Path) -> None:
    if place.is_dir():
        shutil.rmtree(place, ignore_errors=True)
    else:
        place.unlink(missing_ok=True)


def _prefix(path: Path) -> str:
    return f".{path.name[:_LONGEST_NAME]}{_UNDER_WAY}"


def write_bytes(path: Path, data: bytes | memoryview) -> None:
    """Write ``data`` to ``path`` atomically."""
    with replacing(path) as temporary:
        temporary.write_bytes(data)


def write_text(path: Path, text: str) -> None:
    """Write ``text`` to ``path`` atomically, as UTF-8."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="")


def write_json(path: Path, data: Any) -> None:
    """Write ``data`` to ``path`` atomically, as `json_text`, with the same refusals."""
    write_text(path, json_text(data))


def json_text(data: Any) -> str:
    """Return ``data`` as JSON, one key or item a line; ValueError where a number is not finite."""
    return json.dumps(data, indent=1, allow_nan=False) + "\n"


@contextlib.contextmanager
def readable(path: Path) -> Iterator[None]:
    """Refuse what is no file (`require_file`), and say in our words that reading it failed.

    Raises
    ------
    FileAccessError
        In place of any `OSError` of the block.
    """
    require_file(path)
    try:
        yield
    except FileAccessError:
        raise  # of another file: it says so itself
    except OSError as error:
        raise FileAccessError(f"cannot read {path}: {error.strerror or error}") from error


def read_text(path: Path) -> str:
    """Return the text of a UTF-8 file.

    Raises
    ------
    FileAccessError
        If the file is missing, unreadable, empty, or not text.
    SchemaError
        If it is too large to be read whole.
    """
    try:
        with readable(path):
            require_size(path)
            text = Path(path).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileAccessError(f"cannot read {path}: not a UTF-8 text file") from error
    if not text.strip():
        raise FileAccessError(f"cannot read {path}: the file is empty")
    return text


def read_bytes(path: Path, most: Limit | None = None) -> bytes:
    """Return the content of a file.

    Parameters
    ----------
    path : Path
        The file.
    most : Limit, optional
        Its largest size in MB; by default that of every file that is read whole.

    Raises
    ------
    FileAccessError
        If the file is missing or unreadable, or is a pipe or a device.
    SchemaError
        If it is too large to be read whole.
    """
    with readable(path):
        require_size(path, most or _MOST_READ)
        return Path(path).read_bytes()


def require_file(path: Path) -> None:
    """Refuse a pipe, a socket or a device: reading it may block, or never end.

    A file becomes an input of the current command.

    A missing file and a folder are left to the caller that opens them; standard input may be read.

    Raises
    ------
    FileAccessError
        If the path leads to one.
    """
    path = Path(path)
    if path == _STANDARD_INPUT or path.parent in _DESCRIPTORS:
        return
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):
        return
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        raise FileAccessError(f"cannot read {path}: it is a pipe or a device, not a file")
    if (rule := current_rule()) is not None and stat.S_ISREG(mode):
        rule.note_input(path)


def require_size(path: Path, most: Limit = _MOST_READ) -> None:
    """Refuse a file that is too large to be read whole.

    Raises
    ------
    SchemaError
        With the bound and how to raise it.
    OSError
        If it is not there.
    """
    size = Path(path).stat().st_size / _MEGABYTE
    most.require(size, f"{path} has {size:.0f} MB, which")


def sha256(text: str) -> str:
    """Return the hexadecimal SHA-256 of a text, by which files refer to one another."""
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def _flush_to_disk(path: Path) -> None:
    descriptor = os.open(path, os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
