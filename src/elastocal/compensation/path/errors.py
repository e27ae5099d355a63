"""What is refused of a path."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from elastocal.errors import CompensationError


class PathError(CompensationError):
    """A programmed path that cannot be corrected; the message names its line or point."""


@contextmanager
def in_file(path: Path) -> Iterator[None]:
    """Name the file in a refusal that comes up inside.

    Raises
    ------
    PathError
        The same with the file's name before it.
    """
    try:
        yield
    except PathError as error:
        raise PathError(f"{path}: {error}") from error
