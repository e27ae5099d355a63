"""Ctrl-C during a run, a terminal that is closed: the arm is brought to safety first."""

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from types import FrameType

NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP")
"""What a person, a terminal or a system sends to end a program, or to halt it, which would leave
the arm pressing with nobody to watch. Not every system has all of them."""


@contextlib.contextmanager
def interruption() -> Iterator[Callable[[], bool]]:
    """Yield a function that says whether somebody wants the run to stop.

    Meanwhile the signals of `NAMES` do not break into the middle of a step: the runner asks once
    a cycle, releases, retracts and stops.
    """
    asked = threading.Event()

    def note(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - signal's form
        asked.set()

    if threading.current_thread() is not threading.main_thread():
        yield asked.is_set
        return
    numbers = [getattr(signal, name) for name in NAMES if hasattr(signal, name)]
    before = {number: signal.signal(number, note) for number in numbers}
    try:
        yield asked.is_set
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
