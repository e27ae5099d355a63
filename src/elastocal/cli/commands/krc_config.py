"""``elastocal krc-config``: files and sign-off sheet for a KUKA controller."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output


def _krc_config(
    cell: Annotated[Path, typer.Argument(help="Cell file, .yaml, whose arm is kuka_rsi.")],
    *,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder to write into.")] = None,
    check: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Check this ETHERNET file or RSI context instead."),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace files that are there.")] = False,
    as_json: options.Written = False,
) -> None:
    """Write ETHERNET files, RSI contexts, KRL programs and a sign-off sheet for a KUKA."""
    result = workflows.krc_config(cell, out=out, check=check, force=force)
    if as_json:
        output.print_json(result)
        return
    screen = output.console()
    for label, text in result.facts():
        screen.print(f"{label}: {text}", soft_wrap=True)
