"""``elastocal check``: validate any of our files."""

from pathlib import Path
from typing import Annotated

import typer


def check(
    file: Annotated[
        Path,
        typer.Argument(
            help="Any file of ours (.yaml, .json, .nc, .jsonl, .mcap), a dataset (.nc, .csv), a"
            " robot (.urdf), or the folder of a plan, run, process, codec or study."
        ),
    ],
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the findings as one JSON object.")
    ] = False,
) -> None:
    """Validate a file and say what it holds."""
    from rich.markup import escape

    from elastocal.cli.file_kinds import describe_file
    from elastocal.cli.output import console, print_json

    kind, facts = describe_file(file)
    if as_json:
        print_json({"file": str(file), "kind": kind, **facts})
        return
    console().print(f"[green]ok[/green] {escape(str(file))} is a {kind}")
    for name, value in facts.items():
        console().print(f"   {name.replace('_', ' ')}: {value}", markup=False)
