"""``elastocal compensate``: a programmed path with its forces, corrected offline."""

from pathlib import Path
from typing import Annotated

import typer

from elastocal import workflows

START_HELP = (
    "Posture before the first row, a quantity a joint from base to tip:"
    " '0 deg, -90 deg, 90 deg, 0 deg, 45 deg, 0 deg'."
)


def compensate(
    model: Annotated[Path, typer.Argument(help="Model file from calibrate.")],
    path: Annotated[Path, typer.Argument(help="Path, .csv, or KUKA program, .src beside .dat.")],
    out: Annotated[Path, typer.Option(help="CSV, or .src, to write.")],
    *,
    forces: Annotated[
        Path | None,
        typer.Option(help="Forces of a KUKA program: CSV with the columns point, force_x[N] …"),
    ] = None,
    base: Annotated[
        str | None,
        typer.Option(help="A program's $BASE in the model's base: 'x, y, z, a, b, c' with units."),
    ] = None,
    start: Annotated[str | None, typer.Option(help=START_HELP)] = None,
    largest: Annotated[
        str, typer.Option("--limit", help="Largest deflection that is taken for one.")
    ] = "20 mm",
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the figures as one JSON object.")
    ] = False,
) -> None:
    """Correct a programmed path so that the loaded tool is where it was programmed."""
    from elastocal.cli.output import console, print_json
    from elastocal.cli.progress import progress_bars
    from elastocal.errors import UnitError
    from elastocal.units import parse_quantity

    limit = parse_quantity(largest, "length")
    if not limit > 0.0:
        raise UnitError(f"--limit {largest!r} must be above 0")
    given = workflows.CompensateSettings(
        model, path=path, out=out, forces=forces, base=base, start=start, largest=limit
    )
    with progress_bars(console()) as progress:
        result = workflows.compensate(given, progress)
    if as_json:
        print_json(result)
    else:
        for line in (*_lines(result, out), *(f"Note: {note}" for note in result.notes)):
            console().print(line)


def _lines(result: "workflows.CompensateResult", out: Path) -> list[str]:
    """Return what was done, for people."""
    lengths = (
        ("deviation as programmed", result.deviation),
        ("left by one first-order step", result.first_order),
        ("left by this correction", result.residual),
        ("correction", result.correction),
    )
    return [
        f"{result.rows} rows corrected, predicted by the model; written to {out}",
        *(
            f"  {name + ':':30} {1e3 * length.mean:.3g} mm mean, {1e3 * length.max:.3g} mm max"
            f" ({length.at})"
            for name, length in lengths
        ),
    ]
