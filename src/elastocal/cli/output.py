"""Where output goes: people read standard error, programs read standard output."""

import contextlib
import json
import sys
from collections.abc import Iterator
from contextvars import ContextVar

from rich.console import Console

from elastocal.records import to_data

_CONSOLE: ContextVar[Console | None] = ContextVar("console", default=None)


def console() -> Console:
    """Return the console that people read; standard output stays free for data."""
    return _CONSOLE.get() or Console(stderr=True, highlight=False, soft_wrap=False)


@contextlib.contextmanager
def printing_to(listener: Console) -> Iterator[None]:
    """Have commands print for people on another console meanwhile."""
    token = _CONSOLE.set(listener)
    try:
        yield
    finally:
        _CONSOLE.reset(token)


def print_json(data: object) -> None:
    """Print a record as one JSON object on standard output, and nothing else there."""
    sys.stdout.write(json.dumps(to_data(data), allow_nan=False) + "\n")
    # A disk that is full is to be known now, not when Python ends.
    sys.stdout.flush()
