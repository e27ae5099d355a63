"""``elastocal derive``: from a run's journal and raw streams to its dataset, again."""

from pathlib import Path
from typing import Annotated

import typer


def derive(
    run: Annotated[Path, typer.Argument(help="Folder of a run.")],
    *,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the summary as one JSON object.")
    ] = False,
) -> None:
    """Derive dataset.nc and summary.json of a run again from its raw streams."""
    from elastocal.cli.output import console, print_json
    from elastocal.procedure import RunFolder, derive_run as derive_run, write_derived

    derived = derive_run(run)
    write_derived(run, derived)
    if as_json:
        print_json(derived.summary)
        return
    out, folder, summary = console(), RunFolder(run), derived.summary
    counts = ", ".join(f"{n} {status}" for status, n in summary["readings"]["counts"].items() if n)
    out.print(f"{len(derived.dataset.poses)} poses, readings: {counts}")
    for warning in summary["warnings"]:
        out.print(f"warning: {warning}", markup=False, soft_wrap=True)
    out.print(f"wrote {folder.dataset} and {folder.summary.name}", markup=False, soft_wrap=True)
