"""``elastocal calibrate``: from a measured dataset to a calibrated model."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output, tables
from elastocal.units import parse_point


def _calibrate(  # noqa: PLR0913 - one parameter an option
    data: Annotated[
        list[Path], typer.Argument(help="Dataset, .nc or .csv; several are campaigns.")
    ],
    out: Annotated[Path, typer.Option(help="Model file to write.")],
    *,
    robot: options.RobotName = None,
    tcp: options.TcpLink = None,
    tool: options.ToolFrame = None,
    springs: Annotated[
        str,
        options.choice("springs", "Springs of the model.", file=True),
    ] = "auto",
    loss: Annotated[str, options.choice("loss", "How much readings far off count.")] = "linear",
    weights: Annotated[
        str, options.choice("weights", "Weigh readings by the dataset's sigmas.")
    ] = "none",
    bounds: Annotated[
        str, typer.Option(help="Lowest and highest compliance in SI units.")
    ] = "0,inf",
    marker: options.Marker = None,
    exclude: options.Exclude = None,
    keep_blunders: Annotated[
        bool, typer.Option("--keep-blunders", help="Fit also what cannot be a measurement.")
    ] = False,
    trust_conventions: Annotated[
        bool,
        typer.Option(
            "--trust-conventions", help="Fit data that fit far better with a sign read otherwise."
        ),
    ] = False,
    free_frame: Annotated[
        str,
        options.choice("free frame", "Estimate a frame of tracker and marker for each."),
    ] = "none",
    geometry: Annotated[
        Path | None,
        typer.Option(help="Model file of geometry: springs are fitted on the arm as built."),
    ] = None,
    budget: Annotated[
        bool,
        typer.Option("--budget", help="State also what the error at left-out poses is made of."),
    ] = False,
    process: Annotated[
        Path | None,
        typer.Option(
            help="Path of production (.csv): springs are chosen for it; how much of it is covered."
            " By default that of the run's cell."
        ),
    ] = None,
    draws: Annotated[int, typer.Option(max=100_000, help="Bootstrap draws.")] = 200,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the bootstrap.")] = 0,
    force: options.Force = False,
    as_json: options.Figures = False,
) -> None:
    """Identify the compliances of a robot from a measured dataset."""
    result = workflows.calibrate(
        tuple(data),
        out=out,
        robot=robot,
        tcp=tcp,
        tool_frame=tool,
        springs=springs,
        loss=loss,
        weights=weights,
        bounds=bounds,
        marker=None if marker is None else parse_point(marker),
        exclude=tuple(exclude or ()),
        keep_blunders=keep_blunders,
        trust_conventions=trust_conventions,
        free_frame=free_frame,
        geometry=geometry,
        budget=budget,
        process=process,
        draws=draws,
        seed=seed,
        force=force,
    )
    if as_json:
        output.print_json(result.calibration)
    else:
        tables.show_calibration(output.console(), result, out)
