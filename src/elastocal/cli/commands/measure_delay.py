"""``elastocal measure-delay``: from command to motion of a KUKA, for its commissioning record."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output


def _measure_delay(
    cell: Annotated[Path, typer.Argument(help="Cell file, .yaml, whose arm is kuka_rsi.")],
    out: Annotated[Path, typer.Option(metavar="RECORD.json", help="Commissioning record.")],
    *,
    amplitude: Annotated[str, typer.Option(help="Of the movement, in the air.")] = "0.5 mm",
    seconds: Annotated[float, typer.Option(help="Of each of the three movements.")] = 6.0,
    yes: Annotated[
        bool, typer.Option("--yes", help="Do not ask: a person has looked at the cell.")
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is there.")] = False,
    as_json: options.Written = False,
) -> None:
    """Measure how long the arm takes from command to motion, free in the air."""
    from elastocal.cli._operator import TerminalOperator

    screen = output.console()
    with output.progress_bars() as progress:
        result = workflows.measure_delay(
            cell,
            out=out,
            amplitude=amplitude,
            seconds=seconds,
            confirmed=yes,
            operator=TerminalOperator(screen),
            force=force,
            progress=progress,
        )
    if as_json:
        output.print_json(result.measured)
        return
    for label, text in result.facts():
        screen.print(f"{label}: {text}", soft_wrap=True)
