"""``elastocal study``: how many poses, which technique, which instruments, before travelling."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output, tables


def _study(  # noqa: PLR0913 - one parameter an option
    cell: Annotated[Path, typer.Argument(help="Cell file, .yaml.")],
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder of the study; one that is there goes on.")
    ],
    *,
    samples: Annotated[
        int, typer.Option(max=1_000_000, help="Simulated arms, each calibrated anew.")
    ] = 200,
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
        int,
        typer.Option(
            max=10_000, help="Poses at which every calibration is judged; none is chosen."
        ),
    ] = 25,
    seed: Annotated[int, typer.Option(min=0, help="Seed of arms and noise.")] = 0,
    jobs: Annotated[
        int | None, typer.Option(min=1, max=1024, help="Processes; default: all cores.")
    ] = None,
    dask: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Dask scheduler to work on, e.g. tcp://host:8786."),
    ] = None,
    as_json: options.Figures = False,
) -> None:
    """Simulate many calibrations of a cell: what reaches which accuracy."""
    from elastocal.records import to_data

    with output.progress_bars() as progress:
        result = workflows.study(
            cell,
            progress,
            out=out,
            samples=samples,
            vary=tuple(vary or ()),
            target=_parse_target(target),
            verification=verification,
            seed=seed,
            jobs=jobs,
            dask=dask,
        )
    if as_json:
        figures = to_data(result.summary)
        del figures["schema"]
        output.print_json({"folder": str(out), "files": result.files, **figures})
    else:
        tables.show_study(output.console(), result.summary, out, result.files)


def _parse_target(text: str | None) -> float | None:
    """Return a target in m from a length with its unit."""
    from elastocal.errors import CodecError, UnitError
    from elastocal.units import parse_quantity

    if text is None:
        return None
    try:
        length = parse_quantity(text, "length")
    except UnitError as error:
        raise CodecError(f"--target: {error}") from error
    if not length > 0.0:
        raise CodecError(f"--target {text!r}: must be above 0")
    return length
