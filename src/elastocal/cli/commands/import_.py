"""``elastocal import``: from other people's logs to a dataset."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import output


def _import(
    logs: Annotated[
        list[Path],
        typer.Argument(help="CSV or text, Excel, MCAP, ROS 1 and 2 bags; one or several."),
    ],
    map_file: Annotated[
        Path, typer.Option("--map", help="What the columns are (.yaml); --guess writes one.")
    ],
    *,
    out: Annotated[Path | None, typer.Option(help="Dataset (.nc or .csv) to write.")] = None,
    guess: Annotated[
        bool, typer.Option("--guess", help="Write a first map to --map, and show it.")
    ] = False,
    cell: Annotated[
        Path | None, typer.Option(help="With --guess: cell file that says robot, tool, sensor.")
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(help="Figure of the merged time lines; default: beside the dataset."),
    ] = None,
    force: Annotated[
        bool,
        typer.Option("--force", help="Replace a map that is there, or a file of somebody else."),
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the figures as one JSON object.")
    ] = False,
) -> None:
    """Merge logs of controller, force sensor and tracker; find the readings; write a dataset."""
    if guess:
        ask = _ask if sys.stdin.isatty() else None
        settings = workflows.GuessMapSettings(logs, out=map_file, cell=cell, force=force, ask=ask)
        guessed = workflows.guess_map(settings)
        if as_json:
            output.print_json({"map": str(map_file), "logs": guessed.logs})
            return
        for label, text in guessed.facts():
            output.console().print(f"{label}: {text}", soft_wrap=True)
        output.console().print(f"wrote {map_file}: look at every line")
        return
    if cell is not None:
        raise typer.BadParameter("is for --guess: the map names the cell", param_hint="--cell")
    if out is None:
        raise typer.BadParameter("is missing: the dataset to write", param_hint="--out")
    with output.progress_bars() as progress:
        given = workflows.ImportLogsSettings(
            logs, map=map_file, out=out, picture=picture, force=force
        )
        result = workflows.import_logs(given, progress)
    if as_json:
        output.print_json(result.figures)
        return
    console = output.console()
    for label, text in result.facts():
        console.print(f"{label}: {text}", soft_wrap=True)
    written = f"wrote {result.figures.dataset}, look at {result.figures.picture}"
    console.print(written, soft_wrap=True)


def _ask(question: str) -> str:
    """Return what a person answers on the terminal; empty leaves the question open."""
    answer: str = typer.prompt(question, default="", show_default=False, err=True)
    return answer
