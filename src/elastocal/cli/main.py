"""The command line: collects the commands and turns every error into one line.

Exit codes: 0 done; 1 the work could not be done, with a one-line reason; 2 usage;
130 interrupted. Commands import what they need when they run, so that help is quick.
"""

import sys

import typer

from elastocal import __version__
from elastocal.cli.calibrate import calibrate
from elastocal.cli.check import check
from elastocal.cli.codec import codec
from elastocal.cli.demo import demo
from elastocal.cli.init import init
from elastocal.cli.plan import plan
from elastocal.cli.predict import predict
from elastocal.cli.robots import robots
from elastocal.cli.study import study
from elastocal.errors import ElastocalError

app = typer.Typer(
    name="elastocal",
    help="In-situ elastic calibration of industrial robots.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
for command in (robots, init, check, plan, calibrate, codec, study, predict, demo):
    app.command()(command)


def _version(wanted: bool) -> None:
    if wanted:
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
    try:
        app()
    except ElastocalError as error:
        _complain(str(error))
        sys.exit(1)
    except OSError as error:
        # Standard output that is full or gone; every file of ours has its own refusal.
        _complain(f"cannot write output: {error.strerror or error}")
        sys.exit(1)


def _complain(message: str) -> None:
    typer.echo(f"elastocal: {' '.join(message.split())}", err=True)
