"""``elastocal geometry``: from absolute positions of markers to the geometry of the arm."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output, tables


def _geometry(  # noqa: PLR0913 (a command has as many options as it has)
    positions: Annotated[Path, typer.Argument(help="CSV of joints and positions of markers.")],
    out: Annotated[Path, typer.Option(help="Model file (.json) to write.")],
    *,
    robot: Annotated[
        str | None,
        typer.Option(help="URDF file or catalogue name.", autocompletion=options.robot_names),
    ] = None,
    tcp: Annotated[str | None, typer.Option(help="Link that carries the markers.")] = None,
    urdf: Annotated[Path | None, typer.Option(help="Calibrated URDF to write.")] = None,
    report: Annotated[
        Path | None, typer.Option(help="Report (.html) to write: before and after, maps, figures.")
    ] = None,
    table: Annotated[
        Path | None,
        typer.Option(help="Table (.csv) of Denavit-Hartenberg numbers as drawn and as built."),
    ] = None,
    marker: Annotated[
        list[str] | None,
        typer.Option(
            help="Where a marker is known to be in the tcp, 'x, y, z' with units; repeatable, one"
            " for each: then the error of the tcp is found too."
        ),
    ] = None,
    draws: Annotated[int, typer.Option(min=40, max=100_000, help="Draws of the bootstrap.")] = 200,
    seed: Annotated[int, typer.Option(min=0, help="Of these draws.")] = 0,
    force: options.Force = False,
    language: options.PageLanguage = "en",
    as_json: options.Figures = False,
) -> None:
    """Find the geometric errors of an arm and its sag from absolute positions of markers."""
    from elastocal.records import to_data

    given = workflows.GeometrySettings(
        positions,
        robot=robot,
        tcp=tcp,
        out=out,
        urdf=urdf,
        report_file=report,
        table=table,
        markers=tuple(marker or ()),
        draws=draws,
        seed=seed,
        force=force,
        language=language,
    )
    with output.progress_bars() as progress:
        result = workflows.geometry(given, progress)
    if as_json:
        data = to_data(result.model)
        keys = ("held_out", "ladder", "parameters", "fixed", "blunders")
        found = result.accuracy
        more = {"axes": to_data(found.axes), "iso_9283": to_data(found.poses)}
        output.print_json({key: data[key] for key in keys} | more)
        return
    tables.show_geometry(output.console(), result.model, result.accuracy, out)
