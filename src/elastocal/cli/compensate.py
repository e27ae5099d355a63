"""``elastocal compensate``: a programmed path with its forces, corrected offline."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from elastocal.compensation.offline import CorrectionSummary
    from elastocal.robot import Robot

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
    from elastocal.cli.coverage import NOT_COVERED, covered
    from elastocal.cli.output import console, print_json
    from elastocal.cli.posture_option import parse_frame, parse_posture
    from elastocal.cli.progress import progress_bars
    from elastocal.compensation.offline import CorrectionSettings, compensate_path
    from elastocal.compensation.programs import compensate_program
    from elastocal.errors import FileAccessError, UnitError
    from elastocal.identification import read_model
    from elastocal.units import parse_quantity
    from elastocal.workflows import refuse_overwriting

    krl = path.suffix.lower() == ".src"
    inputs = [model, path, *([forces] if forces else [])]
    refuse_overwriting(out, *inputs)
    if krl != (out.suffix.lower() == ".src"):
        raise FileAccessError(f"--out {out} must end in {path.suffix} like {path}")
    if not krl and (forces or base):
        raise FileAccessError(f"--forces and --base are for KUKA programs (.src), not for {path}")
    calibrated = read_model(model)
    limit = parse_quantity(largest, "length")
    if not limit > 0.0:
        raise UnitError(f"--limit {largest!r} must be above 0")
    settings = CorrectionSettings(parse_posture(calibrated.model.robot, start), limit)
    notes = [] if covered(calibrated) else [NOT_COVERED]
    if krl:
        if forces is None:
            raise FileAccessError(f"{path} has no forces: name a table of them with --forces")
        program = compensate_program(calibrated, path, forces, out, settings, parse_frame(base))
        tally, notes = program.summary, [*notes, *program.notes]
    else:
        with progress_bars(console()) as report:
            tally = compensate_path(calibrated, path, out, settings, report)
        notes += _path_notes(tally, calibrated.model.robot, start)
    if 2 * tally.pulled > tally.rows:
        notes.append(
            f"at {tally.pulled} of {tally.rows} rows the force on the robot draws the tool out"
            " (along +z of the tcp), which a surface cannot: is it the force on the part? Then turn"
            " its sign"
        )
    if as_json:
        print_json(tally.figures() | {"notes": notes})
    else:
        for line in (*_lines(tally, out), *(f"Note: {note}" for note in notes)):
            console().print(line)


def _lines(tally: "CorrectionSummary", out: Path) -> list[str]:
    """Return what was done, for people."""
    names = (
        ("deviation as programmed", tally.deviation),
        ("left by one first-order step", tally.first_order),
        ("left by this correction", tally.residual),
        ("correction", tally.correction),
    )
    lines = [f"{tally.rows} rows corrected, predicted by the model; written to {out}"]
    for name, figure in names:
        mean = f"{1e3 * figure.total / max(tally.rows, 1):.3g} mm"
        lines.append(
            f"  {name + ':':30} {mean} mean, {1e3 * figure.largest:.3g} mm max ({figure.label})"
        )
    return lines


def _path_notes(tally: "CorrectionSummary", robot: "Robot", start: str | None) -> list[str]:
    from elastocal.cli.posture_option import written_posture

    notes = []
    if tally.jumps:
        notes.append(
            f"the posture changes at {tally.jumps} {'row' if tally.jumps == 1 else 'rows'} (first:"
            f" {tally.first_jump}): a joint turns by more than 90 deg from the row before"
        )
    if tally.start and start is None:
        shown = written_posture(robot, tally.start)
        notes.append(
            f"the first row is taken to be reached in the posture nearest to zero: {shown}; another"
            " posture deflects otherwise, give --start if it is another"
        )
    return notes
