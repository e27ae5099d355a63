"""Foreign files that a library reads: in a child process, of bounded time and memory.

A workbook, a bag or a recording is unpacked by code that trusts it: 60 kB may ask for gigabytes,
and what is damaged is raised as anything.
"""

import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeVar
from zipfile import BadZipFile

from elastocal.errors import ElastocalError, LogError
from elastocal.files import Limit, readable, require_file
from elastocal.parallel import GuardedError, guarded

_MOST_MEMORY = Limit("ELASTOCAL_MAX_LOG_MB", 500, "MB of memory")
_MOST_SECONDS = Limit("ELASTOCAL_MAX_SECONDS", 8, "s of reading")
_MEMORY_PER_SIZE, _SECONDS_PER_MEGABYTE = 100, 5
"""What reading an honest file may take beside these, in terms of its size: a packed workbook of
1 MB has some 100 000 cells, each an object of Python."""
_MEGABYTE = 1_000_000
_BEGINS = {".bag": b"#ROSBAG V", ".mcap": b"\x89MCAP0\r\n", ".db3": b"SQLite format 3\0"}
"""How files begin; a library may look for the end of the line in gigabytes without any."""
_DAMAGE = (
    OSError,
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    AssertionError,
    ArithmeticError,
    RuntimeError,
    SyntaxError,  # what XML that is not well-formed raises
    EOFError,
    MemoryError,
    struct.error,
    zlib.error,
    BadZipFile,
)
"""What libraries raise for damaged files; to a user all of it means the same."""
_Result = TypeVar("_Result")


def read_bounded(path: Path, what: str, read: Callable[[], _Result]) -> _Result:
    """Return what a library makes of a foreign file, read in a child of bounded time and memory.

    Parameters
    ----------
    path : Path
        The file, or the folder of a bag.
    what : str
        What it should be, for the message.
    read : callable
        Reads it.

    Raises
    ------
    LogError
        If it is damaged, or takes more time or memory than a file of its size may.
    ElastocalError
        Whatever ``read`` raises of ours.
    """
    with readable(path):
        parts = [*path.iterdir()] if path.is_dir() else [path]
        for part in parts:
            require_file(part)
            begin = _BEGINS.get(part.suffix.lower(), b"")
            if begin and part.is_file() and _first(part, len(begin)) != begin:
                raise LogError(f"{part} is no {what}, or damaged: it does not begin like one")
        size = sum(part.stat().st_size for part in parts) / _MEGABYTE
    seconds = _MOST_SECONDS.most + int(_SECONDS_PER_MEGABYTE * size)
    memory = _MOST_MEMORY.most + int(_MEMORY_PER_SIZE * size)
    try:
        found = guarded(partial(_read_or_refuse, read), seconds, memory)
    except GuardedError as error:
        raise LogError(
            f"{path} is no {what}, or damaged: {error} (the variables {_MOST_SECONDS.variable} and"
            f" {_MOST_MEMORY.variable} raise this)"
        ) from error
    if isinstance(found, _Refusal):
        if found.error is not None:
            raise found.error
        raise LogError(f"{path} is no {what}, or damaged: {found.reason}")
    return found


def _first(path: Path, count: int) -> bytes:
    with path.open("rb") as file:
        return file.read(count)


@dataclass(frozen=True)
class _Refusal:
    """Why a file was not read: an error of ours, or in the words of a library."""

    error: ElastocalError | None
    reason: str = ""


def _read_or_refuse(read: Callable[[], _Result]) -> _Result | _Refusal:
    try:
        return read()
    except ElastocalError as error:
        return _Refusal(error)
    except _DAMAGE as error:
        return _Refusal(None, " ".join(str(error).split())[:200] or type(error).__name__)
