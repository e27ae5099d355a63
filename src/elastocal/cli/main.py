"""The command line: collects the commands, ends them cleanly, turns every error into one line.

Exit codes: 0 done; 1 the work could not be done, with a one-line reason; 2 usage;
130 interrupted; 143 terminated. Commands import what they need when they run: help is quick.
"""

# First: Ctrl-C during the imports below ends the program without a traceback.
from elastocal.cli._signals import ended_cleanly, heard_again

# isort: split
import atexit
import contextlib
import gc
import inspect
import os
import sys
import warnings
from collections.abc import Iterator
from types import ModuleType
from typing import Any, cast, get_args

import typer
from typer.core import TyperCommand, TyperGroup

from elastocal import plugins
from elastocal.cli.commands import COMMANDS
from elastocal.cli.generator import OTHERS, Command, plugged
from elastocal.cli.output import visible
from elastocal.errors import ElastocalError, FileAccessError
from elastocal.units import parse_number

_GARBAGE = 50_000
"""Objects made before garbage is looked for: a short command makes fewer that are any."""
_UNUSED_BY_HELP = {"rich.markdown": "Markdown", "rich.traceback": "Traceback"}
"""Modules that typer imports with its help and that ours never needs: Markdown, tracebacks."""


class _Commands(TyperGroup):
    """Commands, each imported when needed; help needs their names and groups alone."""

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ARG002 - as click asks
        """Return the names of all commands, in the order of the work; those of others last."""
        return list(dict.fromkeys((*COMMANDS, *plugins.entries("command"))))

    def get_command(self, ctx: Any, cmd_name: str) -> TyperCommand | None:
        """Return a command; None if there is none of that name."""
        if cmd_name not in self.commands and cmd_name in self.list_commands(ctx):
            self.commands[cmd_name] = _made(cmd_name, COMMANDS.get(cmd_name) or plugged(cmd_name))
        return cast("TyperCommand | None", self.commands.get(cmd_name))

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Draw the help; stand-ins for `_UNUSED_BY_HELP` halve what is imported for it."""
        absent = {name: kind for name, kind in _UNUSED_BY_HELP.items() if name not in sys.modules}
        for name, kind in absent.items():
            sys.modules[name] = ModuleType(name)
            setattr(sys.modules[name], kind, type(kind, (), {}))
        # A line each is drawn: their parameters are not looked for, and no plug-in is imported.
        whole = self.commands
        self.commands = dict(whole) | {
            name: TyperCommand(name, help=help, rich_help_panel=group)
            for name, group, help in _lines()
        }
        try:
            super().format_help(ctx, formatter)
        finally:
            self.commands = whole
            for name in absent:
                del sys.modules[name]


def _lines() -> Iterator[tuple[str, str, str]]:
    """Yield name, group and sentence of each command."""
    yield from ((name, each.group, each.summary) for name, each in COMMANDS.items())
    for name, entries in plugins.entries("command").items():
        if name not in COMMANDS:
            yield name, OTHERS, f"Of {plugins.source_of(entries[0])}."


class _Command(TyperCommand):
    """A command whose numbers are written as those of every file: no ``1_000``.

    What it writes is named by ``-o``, too, whichever command it is.
    """

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        for param in self.params:
            if "--out" in param.opts:
                param.opts.append("-o")

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Refuse what Python would take for a number and `parse_number` does not."""
        given = self.make_parser(ctx).parse_args(args=list(args))[0]
        hints = inspect.get_annotations(self.callback) if self.callback else {}
        for param in self.params:
            kind, text = hints.get(str(param.name)), given.get(str(param.name))
            if isinstance(text, str) and {int, float} & {kind, *get_args(kind)}:
                try:
                    parse_number(text)
                except ValueError as error:
                    raise typer.BadParameter(str(error), param_hint=param.opts[0]) from error
        return super().parse_args(ctx, args)


_HELP_BY = {"help_option_names": ["-h", "--help"]}
app = typer.Typer(
    name="elastocal",
    cls=_Commands,
    help="In-situ elastic calibration of industrial robots.",
    no_args_is_help=True,
    context_settings=_HELP_BY,
    pretty_exceptions_enable=False,
)


def _made(name: str, found: Command) -> TyperCommand:
    """Return a command with its parameters, as typer makes it of a function."""
    single = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    single.command(name, cls=_Command, rich_help_panel=found.group, context_settings=_HELP_BY)(
        found.callback()
    )
    return cast("TyperCommand", typer.main.get_command(single))


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
    import logging  # not for help

    # Log messages of libraries, like their warnings, are for handlers that the user sets up.
    # Without any handler logging would print a complaint.
    logging.basicConfig(handlers=[logging.NullHandler()])


def run() -> None:
    """Run the command line and exit with its code."""
    # What is imported stays to the end. To look through it for garbage again and again, the last
    # time when all is taken down, takes a sixth of the time of a calibration.
    gc.set_threshold(_GARBAGE)
    atexit.register(gc.freeze)
    # Warnings of libraries (an overflow, a division by zero) help to find errors in the program,
    # with -W; notes for users are printed by elastocal itself.
    warnings.simplefilter("ignore", append=True)
    # Figures go into files; Matplotlib would refuse a name here that it does not know.
    os.environ["MPLBACKEND"] = "agg"
    if sys.stdin is None:
        # Standard input closed by `<&-`: a question then reports that nobody can answer.
        sys.stdin = open(os.devnull, encoding="utf-8")  # noqa: PTH123, SIM115 - to the end
    try:
        _check_output()
        with ended_cleanly():
            app()
    except KeyboardInterrupt:
        # Before typer runs, or after it.
        sys.exit(130)
    except ElastocalError as error:
        _complain(str(error))
        sys.exit(1)
    except MemoryError as error:
        _complain(f"not enough memory: {error}" if str(error) else "not enough memory")
        sys.exit(1)
    except OSError as error:
        # Standard output is full or closed; nearly every file of elastocal has its own refusal.
        place = "cannot write output" if error.filename is None else f"cannot use {error.filename}"
        _complain(f"{place}: {error.strerror or error}")
        _drop_output()
        sys.exit(1)


def _check_output() -> None:
    """Refuse to begin when the result could not be handed over at the end.

    Python has no standard output where it was closed (``>&-``); a device that is full says so
    before anything is written to it.
    """
    if sys.stdout is None and "--json" in sys.argv[1:]:
        raise FileAccessError("cannot write output: standard output is closed")
    with contextlib.suppress(AttributeError, ValueError):  # in a test it may be no file
        os.write(sys.stdout.fileno(), b"")


def _drop_output() -> None:
    """Redirect standard output, so that Python does not write to it again at exit."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _complain(message: str) -> None:
    typer.echo(f"elastocal: {visible(' '.join(message.split()))}", err=True)


heard_again()
