"""``elastocal codec``: were there enough poses, and which technique is better."""

from pathlib import Path
from typing import Annotated

import typer


def codec(  # noqa: PLR0913 - one parameter an option
    data: Annotated[Path, typer.Argument(help="Dataset, .nc or .csv.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder to write the codec into.")],
    *,
    compare: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=A,B",
            help="What to compare: search, springs, load_cases or solver; repeatable,"
            " then every combination.",
        ),
    ] = None,
    robot: Annotated[
        str | None, typer.Option(help="URDF file or catalogue name; default: the dataset's own.")
    ] = None,
    tcp: Annotated[
        str | None, typer.Option(help="Link at the tool centre point; default: the dataset's.")
    ] = None,
    tool: Annotated[
        str | None,
        typer.Option(help="Tcp behind that link: 'x, y, z, a, b, c' with units (Z-Y'-X'')."),
    ] = None,
    marker: Annotated[
        str | None,
        typer.Option(help="Marker in the tcp frame: 'x, y, z' with units; default: the dataset's."),
    ] = None,
    exclude: Annotated[
        list[str] | None, typer.Option(help="Leave out POSE or POSE:LOAD_CASE; repeatable.")
    ] = None,
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
        int | None, typer.Option(help="Verification sets; default: as many as poses.")
    ] = None,
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
        int | None, typer.Option(min=1, help="Processes; default: all cores for long work.")
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Replace the files of a codec that is there.")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the figures as one JSON object.")
    ] = False,
) -> None:
    """Cross-validate growing training sets: how many poses, which technique."""
    from elastocal import dataset as datasets
    from elastocal.cli.codec_folder import write_codec_folder
    from elastocal.cli.codec_options import parse_ratio, parse_tolerance
    from elastocal.cli.codec_table import show_codec
    from elastocal.cli.output import console, print_json
    from elastocal.cli.parsing import parse_point
    from elastocal.cli.progress import progress_bars
    from elastocal.codec import (
        VERDICTS,
        CodecOptions,
        analyse,
        codec_summary,
        cross_validate,
        judge,
        make_variants,
        read_comparisons,
    )
    from elastocal.dataset import without
    from elastocal.files import filling
    from elastocal.records import to_data
    from elastocal.workflows import find_robot

    variants = make_variants(read_comparisons(compare or []))
    options = CodecOptions(splits, parse_ratio(ratio), seed, not keep_blunders, trust_conventions)
    near = parse_tolerance(tolerance)
    measured = datasets.read(data)
    arm = find_robot(robot, tcp, tool, measured)
    readings = without(measured.readings(arm.joint_names), exclude or [])
    offset = measured.marker if marker is None else parse_point(marker)
    with filling(out, VERDICTS, force) as folder, progress_bars(console()) as report:
        found = cross_validate(
            arm,
            readings,
            variants,
            options,
            marker_offset=offset,
            provenance=f"{data}; {measured.provenance}" if measured.provenance else str(data),
            jobs=jobs,
            report=report,
        )
        verdicts = judge(found, near)
        insight = analyse(arm, readings, found, marker_offset=offset, with_indices=indices)
        result = codec_summary(found, verdicts, insight.correlations)
        axes = ("x", "y", "z") if per_axis else ()
        names = write_codec_folder(folder, found, verdicts, result, insight, axes)
    if as_json:
        print_json({"folder": str(out), "files": names, **to_data(result)})
    else:
        show_codec(console(), result, out, names)
