"""The command line: collects the commands, ends them cleanly, turns every error into one line.

Exit codes: 0 done; 1 the work could not be done, with a one-line reason; 2 usage;
130 interrupted; 143 terminated. Commands import what they need when they run: help is quick.
"""

import atexit
import contextlib
import gc
import importlib
import os
import pkgutil
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from types import FrameType, ModuleType
from typing import Any

import typer
from typer.core import TyperGroup

from elastocal.cli import commands
from elastocal.errors import ElastocalError, FileAccessError

_Handler = Callable[[int, FrameType | None], None]
_PAUSE = 0.05
"""Until a signal is sent once more, in s."""
_GARBAGE = 50_000
"""Objects made before garbage is looked for: a short command makes fewer that are any."""
_IMPORTS = "<frozen importlib"
"""How the file names of Python's import machinery begin."""
_UNUSED_BY_HELP = {"rich.markdown": "Markdown", "rich.traceback": "Traceback"}
"""Modules that typer imports with its help and that ours never needs: Markdown, tracebacks."""


class _Commands(TyperGroup):
    """The commands; their help is drawn without importing a parser of Markdown first."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Draw the help; stand-ins for `_UNUSED_BY_HELP` halve what is imported for it."""
        absent = {name: kind for name, kind in _UNUSED_BY_HELP.items() if name not in sys.modules}
        for name, kind in absent.items():
            sys.modules[name] = ModuleType(name)
            setattr(sys.modules[name], kind, type(kind, (), {}))
        try:
            super().format_help(ctx, formatter)
        finally:
            for name in absent:
                del sys.modules[name]


app = typer.Typer(
    name="elastocal",
    cls=_Commands,
    help="In-situ elastic calibration of industrial robots.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
_ORDER = (
    "robots", "init", "check", "plan", "run", "derive", "import_", "geometry", "calibrate", "codec",
    "study", "predict", "tool", "compensate", "stiffness", "export", "simulate_process", "compare",
    "report", "demo",
)  # fmt: skip
"""The order in which help lists commands: that of the work; others follow by name."""


def _found_commands() -> dict[str, Callable[..., None]]:
    """Return the function of each file in ``commands``, by the name that people type."""
    names = {module.name for module in pkgutil.iter_modules(commands.__path__)}
    ordered = [*(name for name in _ORDER if name in names), *sorted(names - set(_ORDER))]
    package = commands.__name__
    # A module cannot be named as a word of Python: the command import is in import_.py.
    plain = {name: name.rstrip("_") for name in ordered}
    return {
        command.replace("_", "-"): getattr(
            importlib.import_module(f"{package}.{name}"), f"_{command}"
        )
        for name, command in plain.items()
    }


COMMANDS = _found_commands()
for name, command in COMMANDS.items():
    app.command(name)(command)


def _version(wanted: bool) -> None:
    if wanted:
        from elastocal import __version__

        typer.echo(f"elastocal {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    _: bool = typer.Option(
        False, "--version", callback=_version, is_eager=True, help="Show the version."
    ),
) -> None:
    """In-situ elastic calibration of industrial robots."""


def run() -> None:
    """Run the command line and exit with its code."""
    # What is imported stays to the end. To look through it for garbage again and again, the last
    # time when all is taken down, takes a sixth of the time of a calibration.
    gc.set_threshold(_GARBAGE)
    atexit.register(gc.freeze)
    try:
        _check_output()
        with _ended_cleanly():
            app()
    except ElastocalError as error:
        _complain(str(error))
        sys.exit(1)
    except OSError as error:
        # Standard output that is full or gone; nearly every file of ours has its own refusal.
        place = "cannot write output" if error.filename is None else f"cannot use {error.filename}"
        _complain(f"{place}: {error.strerror or error}")
        _drop_output()
        sys.exit(1)


def _check_output() -> None:
    """Refuse to begin when the result could not be handed over at the end.

    Python has no standard output where it was closed (``>&-``).
    """
    if sys.stdout is None and "--json" in sys.argv[1:]:
        raise FileAccessError("cannot write output: standard output is closed")


def _drop_output() -> None:
    """Lead standard output away, so that Python does not try once more at its end."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _complain(message: str) -> None:
    typer.echo(f"elastocal: {' '.join(message.split())}", err=True)


@contextlib.contextmanager
def _ended_cleanly() -> Iterator[None]:
    """Turn signals that end a program into exceptions that arrive.

    SIGINT raises KeyboardInterrupt, SIGTERM and SIGHUP raise SystemExit with 128 and their
    number, so that whoever writes a folder cleans it up. What ignores a signal already, as
    ``nohup`` does, goes on ignoring it.

    Python loses such an exception in two places, and a command would go on as if nothing had
    happened: in finalisers and callbacks of weak references, where it is dropped, and in libraries
    that catch everything while they are imported. So a signal that arrives during an import waits
    for its end, and one that was dropped is sent once more. `elastocal run`, which has an arm to
    bring to safety, has a way of its own: `elastocal.cli._operator`.
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
