"""``elastocal verify``: is a run, or a report, what it was when it was made; who vouches for it."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import output
from elastocal.errors import present


def _verify(
    target: Annotated[
        Path | None,
        typer.Argument(metavar="REPORT|RUN", help="A report (.html), or the folder of a run."),
    ] = None,
    *,
    key: Annotated[
        Path | None, typer.Option(metavar="PUBLIC", help="Public key that must have signed it.")
    ] = None,
    run: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Run that a report shows; default: beside the report."),
    ] = None,
    expect: Annotated[
        str | None,
        typer.Option(metavar="HASH", help="The run that it must be of, by 8 digits or more."),
    ] = None,
    new_key: Annotated[
        Path | None,
        typer.Option(metavar="KEY", help="Make a key pair instead: KEY and KEY.pub."),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the links as one JSON object.")
    ] = False,
) -> None:
    """Verify a run from its streams to its model, or a report; a line a link."""
    if (target is None) == (new_key is None):
        raise typer.BadParameter("name a report or a run, or a file for a new key", param_hint="")
    if new_key is not None:
        from elastocal.verdict import make_key

        public = make_key(new_key)
        if as_json:
            output.print_json({"private": str(new_key), "public": str(public)})
            return
        output.console().print(
            f"wrote {new_key} (keep it secret) and {public} (give it away)",
            soft_wrap=True,
        )
        return
    target = present(target, "target")
    found = workflows.verify(target, key=key, run=run, expect=expect)
    if as_json:
        output.print_json({"whole": found.broken is None, "links": found.links})
    else:
        for link in found.links:
            # A line each: the words of a forged report must not look like a link of their own.
            said = " ".join(f"{link.name}: {link.text}".split())
            output.console().print(f"{link.state.value:<14} {said}", soft_wrap=True)
    found.require_whole()
