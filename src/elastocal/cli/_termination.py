"""Ctrl-C, SIGTERM and a closed terminal: a command ends at once and leaves nothing half-written.

Each raises an exception in the main thread, so that whoever writes a folder cleans it up. Python
loses such an exception in two places, and a command would go on as if nothing had been said: in
finalisers and callbacks of weak references, where it is dropped, and in libraries that catch
everything while they are imported. So a signal that arrives during an import waits for its end,
and one that was dropped is sent once more. `elastocal run`, which has an arm to bring to safety,
has a way of its own: `elastocal.cli._operator`.
"""

import contextlib
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from types import FrameType

_Handler = Callable[[int, FrameType | None], None]
_PAUSE = 0.05
"""Until a signal is sent once more, in s."""
_IMPORTS = "<frozen importlib"
"""How the file names of Python's import machinery begin."""


@contextlib.contextmanager
def ended_cleanly() -> Iterator[None]:
    """Turn signals that end a program into exceptions that arrive.

    SIGINT raises KeyboardInterrupt, SIGTERM and SIGHUP raise SystemExit with 128 and their
    number. What ignores a signal already, as ``nohup`` does, goes on ignoring it.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handlers: dict[int, _Handler] = {signal.SIGINT: _interrupt, signal.SIGTERM: _leave}
    if hasattr(signal, "SIGHUP"):
        handlers[signal.SIGHUP] = _leave
    heeded = {n: h for n, h in handlers.items() if signal.getsignal(n) is not signal.SIG_IGN}
    before = {number: signal.signal(number, handler) for number, handler in heeded.items()}
    reported = sys.unraisablehook

    def again(dropped: "sys.UnraisableHookArgs") -> None:
        number = _number_of(dropped.exc_value)
        if number is None:
            reported(dropped)
            return
        signal.signal(number, handlers[number])
        _send_soon(number)

    sys.unraisablehook = again
    try:
        yield
    finally:
        sys.unraisablehook = reported
        for number, handler in before.items():
            signal.signal(number, handler)


def _interrupt(number: int, frame: FrameType | None) -> None:
    if _importing(frame):
        _send_soon(number)
    else:
        raise KeyboardInterrupt


def _leave(number: int, frame: FrameType | None) -> None:
    if _importing(frame):
        _send_soon(number)
        return
    # A second one must not break into the cleaning up.
    signal.signal(number, signal.SIG_IGN)
    sys.exit(128 + number)


def _importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.startswith(_IMPORTS):
            return True
        frame = frame.f_back
    return False


def _number_of(raised: BaseException | None) -> int | None:
    """Return the signal that raised an exception; None where none did."""
    if isinstance(raised, KeyboardInterrupt):
        return signal.SIGINT
    if isinstance(raised, SystemExit) and isinstance(raised.code, int) and raised.code > 128:
        return raised.code - 128
    return None


def _send_soon(number: int) -> None:
    # Sent to the main thread itself, or it would not wake up from what it waits for.
    timer = threading.Timer(_PAUSE, signal.pthread_kill, (threading.main_thread().ident, number))
    timer.daemon = True
    timer.start()
