"""KRL files as bytes that come back unchanged, and the code on each of their lines."""

import re
from pathlib import Path

from elastocal.errors import FileAccessError

_CODE = re.compile(r'(?:"[^"]*"|[^";])*')


def read_lines(path: Path) -> list[str]:
    """Return the lines of a KRL file with their line ends; each character is one byte.

    Raises
    ------
    FileAccessError
        If the file cannot be read.
    """
    try:
        text = Path(path).read_bytes().decode("latin-1")
    except OSError as error:
        raise FileAccessError(f"cannot read {path}: {error.strerror or error}") from error
    # Not splitlines(): it also splits at bytes that only look like line ends, such as 0x85.
    return re.findall(r"[^\n]*\n|[^\n]+", text)


def code_of(line: str) -> str:
    """Return what stands on a line before its comment.

    >>> code_of('LIN XP1 ; not "this"')
    'LIN XP1'
    """
    match = _CODE.match(line)
    return match[0].strip() if match else ""
