"""Signals that end a program: each arrives, and ends it with its own exit code and no traceback.

Importing this module makes Ctrl-C end the program at once until `heard_again`, because a traceback
from within the imports of the command line would be of no use.
"""

import _thread
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
"""Prefix of the file names of Python's import machinery."""
_waiting: set[int] = set()
"""Signals that came at a bad moment, and are going to be sent once more."""


def _is_pythons(handler: object) -> bool:
    """Return whether Ctrl-C is as Python or `_elastocal_program` has it, and may be set here."""
    is_main = threading.current_thread() is threading.main_thread()
    return is_main and handler in (signal.default_int_handler, signal.SIG_DFL)


_QUIET = _is_pythons(signal.getsignal(signal.SIGINT))
if _QUIET:
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def heard_again() -> None:
    """Make Ctrl-C raise KeyboardInterrupt again, as Python has it."""
    if _QUIET:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@contextlib.contextmanager
def ended_cleanly() -> Iterator[None]:
    """Turn signals that end a program into exceptions that reach the program.

    SIGINT raises KeyboardInterrupt, SIGTERM, SIGHUP and SIGXCPU (``ulimit -t``) raise SystemExit
    with 128 and their number, so that unfinished folders are removed. A signal that is already
    ignored, as by ``nohup``, stays ignored.

    Python loses such an exception in two places, after which a command would continue: in
    finalisers and callbacks of weak references, where it is dropped, and in libraries that catch
    everything while they are imported. So a signal that arrives during an import waits for its end,
    and one that was dropped is sent once more; where the command has ended before, it ends by the
    signal. `elastocal run`, which has an arm to bring to safety, handles signals itself:
    `elastocal.cli._operator`.

    Afterwards there is nothing left to clean up, and Ctrl-C ends the program at once.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handlers: dict[int, _Handler] = {signal.SIGINT: _interrupt, signal.SIGTERM: _leave}
    for name in ("SIGHUP", "SIGXCPU"):
        if hasattr(signal, name):
            handlers[getattr(signal, name)] = _leave
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
        with _warned_of_its_time():
            yield
    finally:
        sys.unraisablehook = reported
        for number, handler in before.items():
            at_once = handler is signal.default_int_handler
            signal.signal(number, signal.SIG_DFL if at_once else handler)
        if _waiting:
            sys.exit(128 + _waiting.pop())


@contextlib.contextmanager
def _warned_of_its_time() -> Iterator[None]:
    """Let the system signal a second before it kills the process that its time limit is reached."""
    if not hasattr(signal, "SIGXCPU"):
        yield
        return
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_CPU)
    if soft != hard or hard in (0, 1, resource.RLIM_INFINITY):
        yield
        return
    resource.setrlimit(resource.RLIMIT_CPU, (hard - 1, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_CPU, (soft, hard))


def _interrupt(number: int, frame: FrameType | None) -> None:
    _waiting.discard(number)
    if _importing(frame):
        _send_soon(number)
    else:
        raise KeyboardInterrupt


def _leave(number: int, frame: FrameType | None) -> None:
    _waiting.discard(number)
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


def _send(number: int) -> None:
    ident = threading.main_thread().ident
    if hasattr(signal, "pthread_kill") and ident is not None:
        signal.pthread_kill(ident, number)
    else:
        _thread.interrupt_main(signal.Signals(number))


def _send_soon(number: int) -> None:
    _waiting.add(number)
    # Sent to the main thread itself, or it would not wake up from what it waits for.
    timer = threading.Timer(_PAUSE, _send, (number,))
    timer.daemon = True
    timer.start()
