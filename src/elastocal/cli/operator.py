"""The person at a terminal, as a run's operator."""

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import typer
from rich.console import Console

from elastocal.cli.interruption import interruption
from elastocal.cli.run_view import watching
from elastocal.errors import ProcedureError
from elastocal.workflows import Supervision


class TerminalOperator:
    """Asks on the terminal, shows a line that moves, and takes Ctrl-C for a stop.

    Parameters
    ----------
    console : Console
        Where the person looks.
    """

    def __init__(self, console: Console) -> None:
        self._console = console

    def warn(self, lines: Sequence[str]) -> None:
        """Print what should be known before anything moves."""
        for line in lines:
            self._console.print(line, soft_wrap=True, markup=False)

    def confirm(self) -> None:
        """Ask whether the cell is clear.

        Raises
        ------
        ProcedureError
            If nobody can be asked, or the answer is no.
        """
        if not sys.stdin.isatty():
            raise ProcedureError("a person must confirm that the cell is clear: give --yes")
        question = "Has somebody looked at the cell, and may the arm move?"
        if not typer.confirm(question, err=True):
            raise ProcedureError("not confirmed: nothing was moved")

    @contextmanager
    def supervise(self, poses: int) -> Iterator[Supervision]:
        """Show every step; signals that end a program stop the run instead."""
        with interruption() as interrupted, watching(self._console, poses) as show:
            yield Supervision(show, interrupted)
