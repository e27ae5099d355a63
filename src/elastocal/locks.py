"""Locks of files that end with their process: one interface for systems with and without `fcntl`.

On Windows no file can be moved or removed while it is open. There, what is being written carries no
lock, and what a killed writer has left is left alone.
"""

import contextlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path

POSIX = os.name == "posix"
"""Whether files are locked as on Linux and macOS."""
_FAR = 0x7FFF_FFFE
"""The byte that stands for a whole file on Windows, whose locks keep others from reading, too: one
that no file of ours reaches."""


def lock_file(handle: int) -> None:
    """Lock an open file for this process, until it is closed.

    Parameters
    ----------
    handle : int
        Descriptor, open for writing.

    Raises
    ------
    OSError
        If another process has locked it.
    """
    if POSIX:
        import fcntl

        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return
    import msvcrt

    place = os.lseek(handle, 0, os.SEEK_CUR)
    os.lseek(handle, _FAR, os.SEEK_SET)
    try:
        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined,unused-ignore]
    finally:
        os.lseek(handle, place, os.SEEK_SET)


def show_life(place: Path) -> Callable[[], None]:
    """Mark a temporary file or folder as one that a living process writes; return what ends that.

    Where a file system knows no locks, nobody can tell it from one at work, and it is left alone.

    Raises
    ------
    OSError
        If it is gone.
    """
    if not POSIX:
        return lambda: None
    import fcntl

    handle = os.open(place, os.O_RDONLY)
    with contextlib.suppress(OSError):
        fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
    return lambda: os.close(handle)


@contextlib.contextmanager
def taken_over(place: Path) -> Iterator[bool]:
    """Yield whether nobody writes a temporary file or folder any more; nobody does meanwhile.

    Raises
    ------
    OSError
        If it is at work, gone, or a link.
    """
    if not POSIX:
        yield False
        return
    import fcntl

    handle = os.open(place, os.O_RDONLY | os.O_NOFOLLOW)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield True
    finally:
        os.close(handle)
