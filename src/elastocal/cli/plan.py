"""``elastocal plan``: from a cell to an ordered, checked, executable set of poses."""

from pathlib import Path
from typing import Annotated

import typer


def plan(
    cell: Annotated[Path, typer.Argument(help="Cell file, .yaml.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder to write the plan into.")],
    *,
    compare: Annotated[
        str | None,
        typer.Option(
            help="Search technique to lay beside the cell's, or none."
            " Default: ioops beside cover, else cover."
        ),
    ] = None,
    program: Annotated[str, typer.Option(help="Name of the KRL program.")] = "calib",
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Processes for large pools; default: all cores.")
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Replace the files of a plan that is there.")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the key figures as one JSON object.")
    ] = False,
) -> None:
    """Choose calibration poses on the tooling, check them, and put them in order."""
    from elastocal.cell import load_cell
    from elastocal.cli.output import console, print_json
    from elastocal.cli.plan_folder import write_plan_folder
    from elastocal.cli.plan_table import key_figures, show_plan
    from elastocal.cli.progress import progress_bars
    from elastocal.files import filling
    from elastocal.planning import PLAN, make_plan
    from elastocal.planning.export import check_name

    check_name(program)
    loaded = load_cell(cell)
    if compare is None:
        compare = "cover" if loaded.file.search.technique != "cover" else "ioops"
    with filling(out, PLAN, force) as folder, progress_bars(console()) as report:
        planned = make_plan(loaded, None if compare == "none" else compare, jobs, report)
        names = write_plan_folder(folder, loaded, planned, program)
    if as_json:
        print_json({"folder": str(out), "files": names, **key_figures(planned.plan)})
    else:
        show_plan(console(), planned.plan, out, names)
