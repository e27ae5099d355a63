"""``elastocal simulate-process``: the paper's Table 1 of a simulated cell."""

from pathlib import Path
from typing import Annotated

import typer


def simulate_process(  # noqa: PLR0913 (a command has as many options as it has)
    cell: Annotated[Path, typer.Argument(help="Cell file, .yaml.")],
    model: Annotated[
        list[Path],
        typer.Option(help="Model of this cell from calibrate; once, or once for each --seed."),
    ],
    process: Annotated[str, typer.Option(help="afp (courses) or machining (rings of a dome).")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder to write into.")],
    *,
    tool: Annotated[
        list[Path] | None,
        typer.Option(help="Tool file from `elastocal tool`; as --model. Default: the cell's."),
    ] = None,
    seed: Annotated[
        list[int] | None,
        typer.Option(min=0, help="Of forces and devices; as for run. Repeat it for more."),
    ] = None,
    settings: Annotated[
        Path | None, typer.Option(help="Settings of the compensator (.yaml).")
    ] = None,
    courses: Annotated[
        int | None, typer.Option(min=1, help="Courses or rings; default: 5.")
    ] = None,
    budget: Annotated[
        bool, typer.Option("--budget", help="Switch each effect off in turn, for the first seed.")
    ] = False,
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes; default: all cores.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace files that are there.")] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the figures as one JSON object.")
    ] = False,
) -> None:
    """Run a process on the simulated cell without and with correction: how much is left."""
    from elastocal.cell import load_cell
    from elastocal.cli.output import console, print_json
    from elastocal.cli.process_answer import Question, answer, runs_of
    from elastocal.cli.process_table import show
    from elastocal.cli.progress import progress_bars
    from elastocal.compensation.process import (
        PROGRAMMED_PATH,
        TABLE,
        write_process,
        write_programmed_path,
    )
    from elastocal.dataset import joint_dimensions
    from elastocal.files import filling
    from elastocal.records import to_data

    runs = runs_of(model, tool or [], seed or [0])
    made = load_cell(cell)
    with filling(out, TABLE, force) as folder, progress_bars(console()) as report:
        found = answer(Question(made, process, runs, settings, courses, budget, jobs), report)
        units = joint_dimensions(made.robot.joint_names, made.robot.revolute)
        write_programmed_path(folder / PROGRAMMED_PATH, found.programme, units)
        write_process(folder, found.record)
    table = found.record.table
    if as_json:
        print_json(to_data(table) | {"folder": str(out)})
    else:
        show(console(), table)
        console().print(f"written to {out}")
