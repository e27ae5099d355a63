"""The text of a path file, read in pieces so that a path of any length fits into memory."""

import csv
import itertools
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from elastocal.compensation.path.errors import PathError
from elastocal.errors import FileAccessError
from elastocal.tables import DELIMITERS

_BLOCK = 1 << 20


@dataclass(frozen=True)
class TextLayout:
    """How a file is written, so that it is written back the same way."""

    preamble: tuple[str, ...]
    """Comment and blank lines above the header, with their line ends."""
    header: tuple[str, ...]
    delimiter: str
    line_end: str


@dataclass(frozen=True)
class Piece:
    """Some consecutive rows."""

    cells: list[list[str]]
    """As they stand in the file."""
    lines: list[int]
    """Line of the file that each row ends on, from 1."""


def read_layout(path: Path) -> TextLayout:
    """Return how a path file is written.

    Raises
    ------
    PathError
        If it has no header.
    FileAccessError
        If it cannot be read.
    """
    with _opened(path) as file:
        preamble, line = _above(file)
    delimiter = max(DELIMITERS, key=line.count)
    bare = line.rstrip("\r\n")
    header = tuple(next(csv.reader([bare], delimiter=delimiter)))
    return TextLayout(tuple(preamble), header, delimiter, line[len(bare) :] or "\n")


def pieces(path: Path, layout: TextLayout, size: int) -> Iterator[Piece]:
    """Yield the rows of a path file, up to ``size`` at a time; blank lines are left out.

    Raises
    ------
    PathError
        If there is no row, a row is not as long as the header, or its quotes do not match.
    FileAccessError
        If the file cannot be read.
    """
    width, above, empty = len(layout.header), len(layout.preamble) + 1, True
    with _opened(path) as file:
        _above(file)
        reader = csv.reader(file, delimiter=layout.delimiter, strict=True)
        numbered = ((above + reader.line_num, row) for row in reader if any(map(str.strip, row)))
        while True:
            try:
                some = list(itertools.islice(numbered, size))
            except csv.Error as error:
                raise PathError(f"row {above + reader.line_num}: {error}") from error
            if not some:
                break
            empty = False
            for number, row in some:
                if len(row) != width:
                    raise PathError(
                        f"row {number} has {len(row)} cells, the header has {width}"
                        " (a decimal comma needs another delimiter, and the comma made a point)"
                    )
            yield Piece([row for _, row in some], [number for number, _ in some])
    if empty:
        raise PathError("path has a header but no row")


def count_lines(path: Path) -> int:
    """Return the number of lines of a file, for a progress bar.

    Raises
    ------
    FileAccessError
        If it cannot be read.
    """
    try:
        with Path(path).open("rb") as file:
            return sum(block.count(b"\n") for block in iter(lambda: file.read(_BLOCK), b""))
    except OSError as error:
        raise FileAccessError(f"cannot read {path}: {error.strerror or error}") from error


def _above(file: TextIO) -> tuple[list[str], str]:
    """Return the lines above the header, and the header's."""
    preamble: list[str] = []
    for line in file:
        if line.strip() and not line.startswith("#"):
            return preamble, line
        preamble.append(line)
    raise PathError("file has no header line")


@contextmanager
def _opened(path: Path) -> Iterator[TextIO]:
    """Yield a text file; its troubles are told as ours."""
    try:
        with Path(path).open(encoding="utf-8-sig", newline="") as file:
            yield file
    except UnicodeDecodeError as error:
        raise FileAccessError(f"cannot read {path}: not a UTF-8 text file") from error
    except OSError as error:
        if isinstance(error, FileAccessError):
            raise
        raise FileAccessError(f"cannot read {path}: {error.strerror or error}") from error
