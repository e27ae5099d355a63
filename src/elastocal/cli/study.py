"""``elastocal study``: how many poses, which technique, which instruments, before travelling."""

from pathlib import Path
from typing import Annotated

import typer


def study(  # noqa: PLR0913 - one parameter an option
    cell: Annotated[Path, typer.Argument(help="Cell file, .yaml.")],
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder of the study; one that is there goes on.")
    ],
    *,
    samples: Annotated[int, typer.Option(help="Simulated arms, each calibrated anew.")] = 200,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=A,B",
            help="What to vary: poses, search, load_cases, springs, tracker_noise, force_noise or"
            " truth; repeatable, then every combination. Default: poses=6,10,15,20,31.",
        ),
    ] = None,
    target: Annotated[
        str | None,
        typer.Option(metavar="LENGTH", help="Error that is good enough, e.g. '0.05 mm'."),
    ] = None,
    verification: Annotated[
        int, typer.Option(help="Poses at which every calibration is judged; none is chosen.")
    ] = 25,
    seed: Annotated[int, typer.Option(min=0, help="Seed of arms and noise.")] = 0,
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes; default: all cores.")] = None,
    dask: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Dask scheduler to work on, e.g. tcp://host:8786."),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the figures as one JSON object.")
    ] = False,
) -> None:
    """Simulate many calibrations of a cell: what reaches which accuracy."""
    from elastocal.cell import load_cell
    from elastocal.cli.output import console, print_json
    from elastocal.cli.progress import progress_bars
    from elastocal.cli.study_options import parse_target, study_conditions
    from elastocal.cli.study_simulation import prepare
    from elastocal.cli.study_spread import spread_over
    from elastocal.cli.study_table import show_study
    from elastocal.codec.study import (
        StudyStore,
        check_samples,
        run_study,
        study_record,
        write_study,
    )
    from elastocal.report import write_study_figures

    check_samples(samples)
    good_enough = parse_target(target)
    read = load_cell(cell)
    conditions = study_conditions(read, vary or [])
    with spread_over(jobs, dask) as spread, progress_bars(console()) as report:
        prepared = prepare(read, conditions, seed, verification, jobs)
        store = StudyStore(out)
        results = run_study(store, prepared.settings, samples, prepared.simulate, spread, report)
    record = study_record(prepared.settings, results, good_enough)
    names = write_study(out, prepared.settings, results, record)
    names += write_study_figures(out, prepared.settings, results, record)
    if as_json:
        print_json({"folder": str(out), "files": names, **record.model_dump(mode="json")})
    else:
        show_study(console(), record, out, names)
