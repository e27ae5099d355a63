"""Locks of files that end with their process: one interface for systems with and without `fcntl`.

On Windows no file can be moved or removed while it is open. There, what is being written carries no
lock, and what a killed writer has left is left alone.
"""

import contextlib
import errno
import hashlib
import os
import re
import stat
from collections.abc import Callable, Iterator
from pathlib import Path

POSIX = os.name == "posix"
"""Whether files are locked as on Linux and macOS."""
_PUBLIC = "/tmp" if POSIX else os.environ.get("PROGRAMDATA", "C:/ProgramData")
SHARED = Path(_PUBLIC, "elastocal-locks")
"""Folder of the locks that all users of this machine share; TMPDIR may be another for each."""
_OPEN_TO_ALL = 0o1777
"""Mode of that folder: every user may write, none may remove files of others."""
_MOST_TEXT = 400
"""Bytes that are read of what a holder has written about itself."""
_FAR = 0x7FFF_FFFE
"""Byte that represents a whole file on Windows, whose locks also prevent reading: one beyond the
end of all files of elastocal."""


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
    """Mark a temporary file or folder as in use by this process; return a function that ends it.

    On a file system without locks, unfinished files cannot be recognised and are left in place.

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
    """Yield whether a temporary file or folder has no writer, and keep it so meanwhile.

    Raises
    ------
    OSError
        If it is in use, missing, or a link.
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


def claim(name: str, holder: str) -> Callable[[], None]:
    """Take a lock that all users of this machine share; return a function that releases it.

    It ends with this process in any case. Its file may remain, without a holder.

    Parameters
    ----------
    name : str
        Name of the lock.
    holder : str
        Description of the holder for those who are refused, in one line.

    Raises
    ------
    BlockingIOError
        If it is taken; its ``strerror`` is the holder's description.
    OSError
        If locks are not available here.
    """
    known = hashlib.sha256(name.encode()).hexdigest()[:16]
    place = _shared_folder() / f"{re.sub(r'[^A-Za-z0-9.]+', '-', name)[:60]}-{known}"
    while True:
        handle = _open_shared(place)
        try:
            lock_file(handle)
        except (BlockingIOError, PermissionError) as error:
            text = os.read(handle, _MOST_TEXT).decode("utf-8", "replace")
            os.close(handle)
            said = "".join(each for each in text if each.isprintable()).strip()
            raise BlockingIOError(errno.EAGAIN, said or "another program") from error
        except OSError:
            os.close(handle)
            raise
        # Whoever held it may have removed it between our opening and locking it.
        if not POSIX or _is_there(place, handle):
            break
        os.close(handle)
    with contextlib.suppress(OSError):  # The text is for people; the lock holds without it.
        os.ftruncate(handle, 0)
        os.write(handle, holder.encode()[:_MOST_TEXT])

    def give_back() -> None:
        if POSIX:
            with contextlib.suppress(OSError):  # another user's, in a folder with the sticky bit
                place.unlink()
        os.close(handle)

    return give_back


def _shared_folder() -> Path:
    """Return the folder of shared locks: every user may write, none may remove others' files."""
    SHARED.mkdir(exist_ok=True)
    found = SHARED.lstat()
    if not stat.S_ISDIR(found.st_mode):
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(SHARED))
    if POSIX and found.st_uid == os.geteuid() and stat.S_IMODE(found.st_mode) != _OPEN_TO_ALL:
        SHARED.chmod(_OPEN_TO_ALL)
    return SHARED


def _open_shared(place: Path) -> int:
    """Return a descriptor of a file that every user may lock."""
    flags = os.O_RDWR | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    while True:
        # Without O_CREAT first: Linux refuses that for files of others in such folders.
        with contextlib.suppress(FileNotFoundError):
            return os.open(place, flags)
        with contextlib.suppress(FileExistsError):
            handle = os.open(place, flags | os.O_CREAT | os.O_EXCL, 0o666)
            if POSIX:
                os.fchmod(handle, 0o666)
            return handle


def _is_there(place: Path, handle: int) -> bool:
    """Return whether a path still names the file of a descriptor."""
    with contextlib.suppress(FileNotFoundError):
        return os.path.samestat(place.stat(), os.fstat(handle))
    return False
