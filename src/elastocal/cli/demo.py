"""``elastocal demo``: the whole story on a simulated cell, command by command."""

from pathlib import Path
from typing import Annotated

import typer


def demo(
    context: typer.Context,
    kind: Annotated[
        str,
        typer.Argument(
            metavar="afp|machining", help="Fibre placement on a dome, or roughing of a block."
        ),
    ] = "afp",
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the results.")] = Path(
        "demo"
    ),
    *,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the simulated cell.")] = 0,
    force: Annotated[
        bool, typer.Option("--force", help="Remove an earlier demo from the folder first.")
    ] = False,
) -> None:
    """Show the whole story on a simulated cell: from an empty folder to a signed-off report."""
    from elastocal.cli.demo_display import display
    from elastocal.cli.demo_folder import LOG, begin, finish
    from elastocal.cli.demo_story import chapters, closing_lines
    from elastocal.cli.output import console

    root = context.find_root().command

    def command(words: list[str]) -> int | None:
        code: int | None = root.main(words, prog_name="elastocal", standalone_mode=False)
        return code

    story = chapters(kind, out, seed)
    begin(out, kind, force)
    screen = console()
    with display(screen, out / LOG, story, command) as tell:
        for chapter in story:
            code = tell(chapter)
            if code:
                raise typer.Exit(code)
    finish(out, kind, seed, story)
    for line in closing_lines(out):
        screen.print(line, soft_wrap=True, markup=False)
