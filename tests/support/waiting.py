"""Wait for what threads and other processes do."""

import time
from collections.abc import Callable

from support.cli import PATIENCE

_PAUSE = 0.005


def until(holds: Callable[[], object]) -> None:
    """Wait until something holds, and fail where it never does."""
    end = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < end, "it never holds"
        time.sleep(_PAUSE)
