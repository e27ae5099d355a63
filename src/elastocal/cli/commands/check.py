"""``elastocal check``: validate any of our files."""

import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output


def _check(
    file: Annotated[
        Path,
        typer.Argument(
            help="Any file of ours (.yaml, .json, .nc, .jsonl, .mcap), a dataset (.nc, .csv), a"
            " robot (.urdf), or the folder of a plan, run, process, codec or study."
        ),
    ],
    tcp: Annotated[
        str | None,
        typer.Option(help="Of a robot: the link at the tool centre point (default: its longest)."),
    ] = None,
    preview: Annotated[
        Path | None,
        typer.Option(metavar="PAGE.html", help="Of a cell: write a page with a 3-D view of it."),
    ] = None,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Show that page in a browser.")
    ] = False,
    force: options.Force = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the findings as one JSON object.")
    ] = False,
) -> None:
    """Validate a file and say what it holds."""
    result = workflows.check(file, tcp=tcp, preview=preview, force=force)
    if preview is not None and browser:
        webbrowser.open(preview.resolve().as_uri())
    if as_json:
        output.print_json({"file": result.file, "kind": result.kind, **result.holds})
        return
    output.console().print(f"{output.green('ok')} {result.file} is a {result.kind}")
    for name, text in result.lines():
        output.console().print(f"   {name}: {text}", soft_wrap=True)
    if preview is not None:
        output.console().print(f"preview: {preview}", soft_wrap=True)
