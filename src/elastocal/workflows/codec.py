"""``codec``: were there enough poses, and which technique is better (paper Algorithm 1)."""

from collections.abc import Iterator
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Annotated, Any

from elastocal.blocks import Block, Facts
from elastocal.codec import (
    VERDICTS,
    CodecAnalysis,
    CodecData,
    CodecOptions,
    CodecSummary,
    Tolerance,
    Verdicts,
    analyse,
    codec_summary,
    cross_validate,
    judge,
    make_variants,
    read_comparisons,
    show_codec,
    write_codec,
    write_codec_summary,
    write_index_table,
)
from elastocal.dataset import content_sha256, merge_files, without
from elastocal.errors import CodecError
from elastocal.files import filling
from elastocal.findings import group_alike
from elastocal.identification import FitOptions, at_tcp, weigh_contact
from elastocal.options import Exclude, Marker, Option, ToolFrame
from elastocal.parallel import one_blas_thread
from elastocal.progress import Progress
from elastocal.results import Result, brief_repr
from elastocal.robot import Robot
from elastocal.workflows._inputs import (
    DatasetSource,
    KnownContact,
    find_robot,
    known_contact,
    read_datasets,
)
from elastocal.workflows._workflow import workflow


@brief_repr
@dataclass(frozen=True)
class CodecSettings(CodecOptions):
    """The readings that are cross-validated, what is compared, and where the files go."""

    data: Annotated[DatasetSource, Option(argument=True)]
    """Dataset, ``.nc`` or ``.csv``, or the folder of a run; several are campaigns, as for a
    calibration. In Python also a `Dataset`."""
    out: Annotated[Path, Option(metavar="DIR")]
    """Folder to write the codec into."""
    compare: Annotated[
        tuple[str, ...],
        Option(
            metavar="KEY=A,B",
            help="What to compare: search, springs, load_cases or solver; repeatable, then every"
            " combination. Springs as for calibrate; default: auto.",
        ),
    ] = ()
    """Comparisons, each ``"KEY=A,B"`` with a key of `codec.KEYS`; every combination is a
    variant."""
    robot: Annotated[str | Robot | None, Option(choices="robot")] = None
    """URDF file or catalogue name; by default the dataset's own. In Python also a `Robot`."""
    tcp: str | None = None
    """Link at the tool centre point; by default the dataset's."""
    tool_frame: ToolFrame = None
    """Tcp behind that link, ``"x, y, z, a, b, c"`` with units (Z-Y'-X'')."""
    marker: Marker = None
    """Metrology marker in the tcp frame, in m; none: the dataset's."""
    exclude: Exclude = ()
    """Readings to leave out, each ``POSE`` or ``POSE:LOAD_CASE``."""
    saturation: Annotated[
        Tolerance,
        Option("--tolerance", metavar="PART,LENGTH", read="tolerance", default="5 %, 5 um"),
    ] = field(default_factory=Tolerance)
    """Errors this near to the last count as saturated: the larger of a part of it and a length."""
    indices: bool = False
    """Correlate observability indices and covering radius with accuracy."""
    per_axis: bool = False
    """Also draw the errors along x, y and z."""
    jobs: Annotated[int | None, Option(least=1, most=1024)] = None
    """Processes; by default all cores for long work."""
    # Wider than what a codec keeps of it; see `chosen`.
    contact: KnownContact = field(default=None, kw_only=True)  # type: ignore[assignment]
    """What is known of the contact that held the tool where no tracker measured, as for
    `calibrate`: a contact file. In Python also a `Contact`."""
    force: bool = False
    """Replace the files of a codec that is there."""

    @property
    def chosen(self) -> CodecOptions:
        """Choices about the splits, which the codec keeps."""
        return CodecOptions(
            **{each.name: getattr(self, each.name) for each in fields(CodecOptions)}
        )


@dataclass(frozen=True, eq=False, repr=False)
class CodecResult(Result):
    """A finished codec."""

    summary: CodecSummary
    """Its figures and verdicts: contents of ``codec.json``."""
    data: CodecData
    """Every array of Algorithm 1: contents of ``codec.nc``."""
    verdicts: Verdicts
    analysis: CodecAnalysis
    """Springs that the training sets determine, and their indices."""
    files: tuple[str, ...]
    """Names of the files in the folder."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        found = self.summary
        verdicts = tuple(("verdict", sentence) for sentence in found.sentences)
        return (("robot", found.robot), ("splits", found.settings.sentence), *verdicts)

    def show(self) -> Iterator[Block]:
        """Yield the splits, the springs, some errors, and the verdicts in words."""
        yield from show_codec(self.summary)
        yield Facts(tuple(("note", each) for each in group_alike(self.summary.findings)))

    def plot(self) -> Any:
        """Return the chart of errors over training poses, as a Matplotlib figure."""
        from elastocal.report import codec_chart, drawn

        return drawn(codec_chart, self.data, self.verdicts)


@workflow(CodecSettings)
@one_blas_thread()
def codec(settings: CodecSettings, progress: Progress) -> CodecResult:
    """Cross-validate growing training sets: how many poses, which technique.

    Raises
    ------
    CodecError
        If a comparison does not fit, there are too few poses, or a variant fits nothing.
    DatasetError, ConventionError, IdentificationError, RobotError, SpringError, PlanningError
        If the readings, the robot or a value do not fit; see `cross_validate`.
    FileAccessError
        If a file cannot be read or written, or the folder holds files.

    Examples
    --------
    >>> import elastocal as ec
    >>> readings = ec.datasets.fanuc_r2000ic()
    >>> found = ec.codec(readings, out="codec", compare="springs=actuated,bearing", splits=2)
    >>> found.files
    ('codec.nc', 'codec.json', 'codec.svg', 'compliances.svg', 'codec.html')
    """
    variants = make_variants(read_comparisons(settings.compare))
    found = read_datasets(settings.data)
    measured, source = merge_files(found)
    arm = find_robot(settings.robot, settings.tcp, settings.tool_frame, measured)
    readings = without(measured.readings(arm.joint_names), settings.exclude)
    marker = measured.marker if settings.marker is None else settings.marker
    readings = at_tcp(arm, readings, marker)
    known = FitOptions(contact=known_contact(settings.contact))
    if known.contact is not None and known.contact.tip is not None:
        raise CodecError(
            "the codec takes the place of a tip as exact: leave contact.tip out (calibrate finds"
            " the place of the tip)"
        )
    settings = replace(settings, contact=weigh_contact(arm, readings, known, marker).contact)
    with filling(Path(settings.out), VERDICTS, settings.force) as folder:
        data = cross_validate(
            arm,
            readings,
            variants,
            settings.chosen,
            marker_offset=marker,
            provenance=f"{source}; {measured.provenance}" if measured.provenance else source,
            jobs=settings.jobs,
            progress=progress,
        )
        data = replace(data, made_from={str(path): content_sha256(each) for path, each in found})
        verdicts = judge(data, settings.saturation)
        analysis = analyse(arm, readings, data, marker_offset=marker, with_indices=settings.indices)
        summary = codec_summary(data, verdicts, analysis.correlations)
        axes = ("x", "y", "z") if settings.per_axis else ()
        result = CodecResult(summary, data, verdicts, analysis, ())
        return replace(result, files=_write_folder(folder, result, axes, settings.jobs))


def _write_folder(
    folder: Path, result: CodecResult, axes: tuple[str, ...], jobs: int | None
) -> tuple[str, ...]:
    """Write everything that a codec leaves behind; return the names of the files."""
    from elastocal.report import write_codec_figures

    data, analysis = result.data, result.analysis
    paths = [write_codec(folder, data), write_codec_summary(folder, result.summary)]
    if analysis.indices:
        paths.append(write_index_table(folder, data, analysis.indices))
    paths += write_codec_figures(folder, data, result.verdicts, analysis, axes, jobs)
    return tuple(path.name for path in paths)
