"""``elastocal codec``: were there enough poses, and which technique is better."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from elastocal import workflows
from elastocal.cli import options, output, tables
from elastocal.units import parse_number, parse_point, parse_quantity

if TYPE_CHECKING:
    from elastocal.codec import Tolerance


def _codec(  # noqa: PLR0913 - one parameter an option
    data: Annotated[Path, typer.Argument(help="Dataset, .nc or .csv.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder to write the codec into.")],
    *,
    compare: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=A,B",
            help="What to compare: search, springs, load_cases or solver; repeatable,"
            " then every combination. Springs as for calibrate; default: auto.",
        ),
    ] = None,
    robot: options.RobotName = None,
    tcp: options.TcpLink = None,
    tool: options.ToolFrame = None,
    marker: options.Marker = None,
    exclude: options.Exclude = None,
    keep_blunders: Annotated[
        bool, typer.Option("--keep-blunders", help="Use also what cannot be a measurement.")
    ] = False,
    trust_conventions: Annotated[
        bool,
        typer.Option(
            "--trust-conventions", help="Use data that fit far better with a sign read otherwise."
        ),
    ] = False,
    splits: Annotated[
        int | None, typer.Option(max=100_000, help="Verification sets; default: as many as poses.")
    ] = None,
    poses: Annotated[
        int,
        typer.Option(
            max=1_000_000, help="Most poses; of a larger dataset as many are drawn by the seed."
        ),
    ] = 100,
    ratio: Annotated[
        str, typer.Option(metavar="A/B", help="Training to verification poses.")
    ] = "70/30",
    seed: Annotated[int, typer.Option(min=0, help="Seed of searches and intervals.")] = 0,
    tolerance: Annotated[
        str,
        typer.Option(
            metavar="PART,LENGTH",
            help="Errors this near to the last count as saturated: the larger of a part of it and"
            " a length.",
        ),
    ] = "5 %, 5 um",
    indices: Annotated[
        bool,
        typer.Option(
            "--indices", help="Correlate observability indices and covering radius with accuracy."
        ),
    ] = False,
    per_axis: Annotated[
        bool, typer.Option("--per-axis", help="Also print the errors along x, y and z.")
    ] = False,
    jobs: Annotated[
        int | None,
        typer.Option(min=1, max=1024, help="Processes; default: all cores for long work."),
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Replace the files of a codec that is there.")
    ] = False,
    as_json: options.Figures = False,
) -> None:
    """Cross-validate growing training sets: how many poses, which technique."""
    from elastocal.codec import CodecOptions
    from elastocal.records import to_data

    parts = _parse_ratio(ratio)
    chosen = CodecOptions(splits, parts, seed, not keep_blunders, trust_conventions, poses)
    with output.progress_bars() as progress:
        result = workflows.codec(
            data,
            progress,
            out=out,
            compare=tuple(compare or ()),
            robot=robot,
            tcp=tcp,
            tool_frame=tool,
            marker=None if marker is None else parse_point(marker),
            exclude=tuple(exclude or ()),
            options=chosen,
            saturation=_parse_tolerance(tolerance),
            indices=indices,
            per_axis=per_axis,
            jobs=jobs,
            force=force,
        )
    if as_json:
        output.print_json({"folder": str(out), "files": result.files, **to_data(result.summary)})
    else:
        tables.show_codec(output.console(), result.summary, out, result.files)


def _parse_ratio(text: str) -> float:
    """Return training over verification poses from ``"A/B"`` or a number.

    >>> _parse_ratio("70/30") == 70 / 30
    True

    Raises
    ------
    CodecError
        If the text is neither.
    """
    from elastocal.errors import CodecError

    above, _, below = text.partition("/")
    try:
        return parse_number(above) / parse_number(below or "1")
    except (ValueError, ZeroDivisionError) as error:
        raise CodecError(f"ratio {text!r} must be two numbers above 0, e.g. '70/30'") from error


def _parse_tolerance(text: str) -> "Tolerance":
    """Return a tolerance from ``"PART %, LENGTH"``; the length may be left out.

    >>> _parse_tolerance("5 %, 0.01 mm")
    Tolerance(relative=0.05, floor=1e-05)
    >>> _parse_tolerance("0.1").relative
    0.1

    Raises
    ------
    CodecError
        If the text does not fit.
    """
    from elastocal.codec import Tolerance
    from elastocal.errors import CodecError, UnitError

    part, _, length = (each.strip() for each in text.partition(","))
    percent = part.endswith("%")
    try:
        relative = parse_number(part.removesuffix("%")) / (100.0 if percent else 1.0)
        floor = parse_quantity(length, "length") if length else Tolerance.floor
    except (ValueError, UnitError) as error:
        raise CodecError(
            f"tolerance {text!r} must be a part and a length, e.g. '5 %, 5 um'"
        ) from error
    return Tolerance(relative, floor)
