"""Files: written whole or not at all, and known by their content.

A file that is being written lives beside its target under a temporary name and takes the
target's name only after it has reached the disk, so that neither a crash nor Ctrl-C leaves
half a file (spec section 3).
"""

import contextlib
import hashlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

from elastocal.errors import FileAccessError


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path that becomes ``path`` when the block ends without an error.

    Raises
    ------
    FileAccessError
        If the folder does not exist or cannot be written.
    """
    path = Path(path)
    try:
        if path.exists() and not path.is_file():
            raise IsADirectoryError("it is a folder or a device, not a file")
        handle, name = tempfile.mkstemp(path.suffix, f".{path.name}.", path.parent)
        os.close(handle)
    except OSError as error:
        raise FileAccessError(f"cannot write {path}: {error.strerror or error}") from error
    temporary = Path(name)
    try:
        yield temporary
        _flush_to_disk(temporary)
        temporary.chmod(0o666 & ~_umask())
        temporary.replace(path)
    except OSError as error:
        raise FileAccessError(f"cannot write {path}: {error.strerror or error}") from error
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write ``text`` to ``path`` atomically, as UTF-8."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="")


def read_text(path: Path) -> str:
    """Return the text of a UTF-8 file.

    Raises
    ------
    FileAccessError
        If the file is missing, unreadable, empty, or not text.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise FileAccessError(f"cannot read {path}: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise FileAccessError(f"cannot read {path}: not a UTF-8 text file") from error
    if not text.strip():
        raise FileAccessError(f"cannot read {path}: the file is empty")
    return text


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
