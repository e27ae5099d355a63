"""``calibrate``: from a measured dataset to a calibrated model (paper Eq. 15-19)."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import numpy as np

from elastocal import identification
from elastocal.cell import ProcessFile, ProductionPath, read_production
from elastocal.dataset import Dataset, Readings, content_sha256, merge_files, without
from elastocal.elastic import ElasticModel, KnownSpring, Spring, known_springs
from elastocal.errors import ElastocalError, IdentificationError, present
from elastocal.findings import Finding, Kind
from elastocal.identification import (
    CalibratedModel,
    CalibrateResult,
    Climbed,
    Contact,
    FitSettings,
    PredictionDoubt,
    ProductionCoverage,
    ProductionRows,
    at_tcp,
    check_loads,
    choose_model,
    error_budget,
    summary,
    update_springs,
    weigh_contact,
    with_knowledge,
    with_tip_found,
)
from elastocal.options import Option, ToolFrame
from elastocal.progress import Progress
from elastocal.records import read_json, write_json
from elastocal.results import brief_repr
from elastocal.robot import Robot, of_one_arm, same_joints, tool_gap
from elastocal.robot.inverse import nearest_zero_posture
from elastocal.workflows._inputs import (
    DatasetSource,
    KnownContact,
    dataset_files,
    find_robot,
    known_contact,
    read_datasets,
)
from elastocal.workflows._workflow import workflow

if TYPE_CHECKING:
    from elastocal.cell import Cell

__all__ = ["CalibrateResult", "CalibrateSettings", "calibrate"]
_GIVEN = "given"
"""What a model file says of springs that were given themselves."""
_SAME_MARKER = 0.03
"""Distance of a marker from where readings say, in m, within which it is that one."""


@brief_repr
@dataclass(frozen=True)
class CalibrateSettings(FitSettings):
    """Settings of a calibration: readings, springs and fit."""

    data: Annotated[DatasetSource, Option(argument=True)]
    """Dataset, ``.nc`` or ``.csv``, or the folder of a run; several are campaigns, whose poses are
    renumbered. In Python also a `Dataset`."""
    # Wider than what a model file keeps of it; see `fit`.
    springs: Annotated[str | Iterable[Spring], Option(choices="springs", file=True)] = field(
        default="auto", kw_only=True
    )  # type: ignore[assignment]
    """Spring layout: a name, or a YAML file; ``auto``: the model that the readings carry. In Python
    also springs."""
    out: Annotated[
        Path | None, Option(required=True, ends=(".json",), help="Model file (.json) to write.")
    ] = None
    """Model file to write; none: the result is only returned."""
    robot: Annotated[str | Robot | None, Option(choices="robot")] = None
    """URDF file or catalogue name; by default the dataset's own. In Python also a `Robot`."""
    tcp: str | None = None
    """Link at the tool centre point; by default the dataset's."""
    tool_frame: ToolFrame = None
    """Tcp behind that link, ``"x, y, z, a, b, c"`` with units (Z-Y'-X'')."""
    update: Annotated[Path | None, Option(metavar="MODEL.json")] = None
    """Model file to bring up to date by tracked production, whose campaigns are its courses: the
    springs move within what the calibration doubted, and only if courses that are left out are
    predicted better for it."""
    geometry: Path | None = None
    """Model file of `geometry` of the same arm: springs are fitted on the arm as built, with the
    marker where it was found."""
    budget: bool = False
    """State also what the error at left-out poses is made of."""
    process: Path | None = None
    """Path of production, ``.csv``: ``auto`` chooses for it, and how much of it the readings cover
    is stated. None: that which the cell file of the data's own run names, where there is one."""
    # Wider than what a model file keeps of it; see `fit`.
    contact: KnownContact = field(default=None, kw_only=True)  # type: ignore[assignment]
    """What is known of the contact that holds the tool where no tracker measured: a contact file.
    In Python also a `Contact`."""
    force: bool = False
    """Replace a file that is no former output of this command."""

    @property
    def files(self) -> tuple[Path, ...]:
        """The datasets that are files."""
        return dataset_files(self.data)

    def __post_init__(self) -> None:
        """Keep the springs that an iterator gives."""
        super().__post_init__()
        if not isinstance(self.springs, str | PathLike):
            object.__setattr__(self, "springs", tuple(self.springs))

    @property
    def fit(self) -> FitSettings:
        """The part of the settings that the model file keeps."""
        kept = {each.name: getattr(self, each.name) for each in fields(FitSettings)}
        return FitSettings(**kept | {"springs": self.springs if self.given is None else _GIVEN})

    @property
    def given(self) -> tuple[Spring, ...] | None:
        """The springs that are given themselves; None: those of a layout or a file."""
        return None if isinstance(self.springs, str) else tuple(self.springs)


@workflow(CalibrateSettings, marks=("elastocal.model/",))
def calibrate(settings: CalibrateSettings, progress: Progress) -> CalibrateResult:  # noqa: ARG001 - done in an instant
    """Identify the compliances of a robot from a measured dataset.

    Raises
    ------
    DatasetError, ConventionError, IdentificationError, RobotError, SpringError
        If the readings, the robot or the settings do not fit; see `identification.calibrate`.
    FileAccessError
        If a file cannot be read or written, or ``out`` is an input, or another's file.

    Examples
    --------
    >>> import elastocal as ec
    >>> readings = ec.datasets.fanuc_r2000ic()
    >>> result = ec.calibrate(readings, springs="actuated")
    >>> [f"{each:.2e}" for each in result.compliance[:3].tolist()]  # rad/(N m)
    ['1.16e-06', '3.68e-07', '5.10e-07']
    """
    if settings.update is not None:
        return _updated(settings, settings.update)
    settings = _with_contact_file(settings)
    found = read_datasets(settings.data)
    made_from = {str(path): content_sha256(each) for path, each in found}
    measured, source = merge_files(found)
    arm = find_robot(settings.robot, settings.tcp, settings.tool_frame, measured)
    unbuilt: tuple[Finding, ...] = ()
    if settings.geometry is not None:
        arm, settings = _as_built(settings, arm, measured)
        measured, unbuilt = _rebuilt(found, arm, settings)
        source = f"{source}, on the arm as built of {settings.geometry}"
    readings = without(measured.readings(arm.joint_names), settings.exclude)
    marker = measured.marker if settings.marker is None else settings.marker
    readings = at_tcp(arm, readings, marker)
    arm, options = with_tip_found(arm, readings, settings.options())
    options = weigh_contact(arm, readings, options, marker)
    settings = replace(settings, contact=options.contact)
    path, unknown = _production(settings, arm)
    rows = None if path is None else _rows(path)
    chosen = _chosen(settings, arm, readings, marker, rows)
    options = with_knowledge(options, chosen.known, chosen.model, readings, marker)
    calibration = identification.calibrate(
        chosen.model,
        readings,
        np.random.default_rng(settings.seed),
        options,
        marker_offset=marker,
        ladder=chosen.ladder,
        provenance=f"{source}; {measured.provenance}" if measured.provenance else source,
    )
    figures = summary(calibration, _with_tip(settings, calibration).fit, chosen.known)
    if measured.check_cases:
        kept_out = measured.readings(arm.joint_names, check=True)
        figures = replace(figures, check=check_loads(calibration, kept_out, marker))
    if settings.budget:
        figures = replace(figures, budget=error_budget(chosen.model, readings, options, marker))
    if path is not None:
        coverage, doubt = _on_production(path, calibration.calibrated)
        warnings = (*figures.warnings, *(doubt.warnings if doubt else ()))
        figures = replace(figures, production=coverage, doubt=doubt, warnings=warnings)
    further = (*chosen.refused, *unknown, *unbuilt)
    figures = replace(figures, warnings=(*figures.warnings, *further))
    found_model = replace(calibration.calibrated, on_production=figures.doubt)
    result = replace(CalibrateResult.of(found_model, figures), made_from=made_from)
    if settings.out is not None:
        write_json(settings.out, result)
    return result


def _with_tip(
    settings: CalibrateSettings, calibration: identification.Calibration
) -> CalibrateSettings:
    """Return settings with the tip where the springs have it: a report makes the same fit again."""
    contact = settings.contact
    if not isinstance(contact, Contact) or calibration.contact is None:
        return settings
    return replace(settings, contact=replace(contact, tip_found=calibration.contact.tip))


def _with_contact_file(settings: CalibrateSettings) -> CalibrateSettings:
    """Return settings with what the contact file knows; refuse options about a tracker with it."""
    if settings.contact is None:
        return settings
    for name in ("budget", "free_frame", "geometry"):
        if getattr(settings, name) != CalibrateSettings.__dataclass_fields__[name].default:
            raise IdentificationError(
                f"--{name.replace('_', '-')} is about what a tracker measures: it does not go with"
                " --contact"
            )
    return replace(settings, contact=known_contact(settings.contact))


_WITH_UPDATE = frozenset(
    {"data", "out", "update", "force", "marker", "exclude", "seed", "robot", "tcp", "tool_frame"}
)
"""Settings that count when a model is brought up to date; all others are of a calibration."""


def _updated(settings: CalibrateSettings, file: Path) -> CalibrateResult:
    """Return a model brought up to date by tracked production.

    Raises
    ------
    IdentificationError
        If production has too few courses, is of another robot or tool or has made the model, or an
        option asks for a calibration.
    """
    for each in fields(settings):
        if each.name not in _WITH_UPDATE and getattr(settings, each.name) != each.default:
            flag = each.name.replace("_", "-")
            raise IdentificationError(f"--{flag} goes with a calibration, not with --update")
    before = read_json(file, CalibrateResult)
    if before.tip is not None:
        raise IdentificationError(
            f"{file}: its tip was found beside the springs (contact.tip), and the marker of a"
            " tracker is stated from a tcp that is known: calibrate with the tip where it is"
            " (contact.tip left out) before --update"
        )
    found = read_datasets(settings.data)
    made_from = {str(path): content_sha256(each) for path, each in found}
    _require_new(made_from, before, file)
    measured, source = merge_files(found)
    calibrated = before.calibrated
    if settings.robot is not None or measured.robot_urdf:
        arm = find_robot(settings.robot, settings.tcp, settings.tool_frame, measured)
        _require_arm_of(calibrated.model.robot, arm, (str(file), source))
    readings = measured.readings(calibrated.model.robot.joint_names)
    readings = without(readings, settings.exclude)
    marker = measured.marker if settings.marker is None else settings.marker
    rng = np.random.default_rng(settings.seed)
    moved, worth = update_springs(calibrated, readings, rng, marker)
    # Not among what the calibration was made from: its figures, which a report makes again, are of
    # that alone.
    last = before.update
    earlier, own = ({}, None) if last is None else (last.made_from, last.calibrated)
    if not worth.taken:
        worth = replace(worth, made_from=earlier, calibrated=own)
        result = replace(before, update=worth)
    else:
        figures = before.calibration
        result = replace(
            before,
            compliance=moved.compliance,
            draws=moved.draws,
            spring_ends=None,
            # What was said of production was of the springs as they were.
            calibration=None if figures is None else replace(figures, doubt=None),
            update=replace(
                worth,
                made_from=earlier | made_from,
                calibrated=own or tuple(before.compliance.tolist()),
            ),
            provenance=f"{before.provenance}; updated by {source}",
        )
    if settings.out is not None:
        write_json(settings.out, result)
    return result


def _require_new(made_from: dict[str, str], before: CalibrateResult, file: Path) -> None:
    """Refuse readings that have made a model already: counted twice, they look twice as sure."""
    updated = {} if before.update is None else before.update.made_from
    seen = {*before.made_from.values(), *updated.values()}
    for path, said in made_from.items():
        if said in seen:
            raise IdentificationError(
                f"{path}: {file} was made from these readings already: production is wanted that"
                " it has not seen"
            )


def _require_arm_of(robot: Robot, arm: Robot, names: tuple[str, str]) -> None:
    """Refuse production of another robot, or at another tool, than a model's."""
    from elastocal.identification.recertification import check_same_robot

    check_same_robot(robot, arm, names)
    gap = tool_gap(robot, arm)
    if not of_one_arm(gap, robot, arm):
        file, source = names
        raise IdentificationError(
            f"{file} and {source} have other tools: their tool centre points ({robot.tip},"
            f" {arm.tip}) are {gap} apart; give --tcp and --tool as in the calibration, if"
            " production had that tool"
        )


class _Chosen(NamedTuple):
    """The springs that are fitted, the rungs that they were chosen from, and prior knowledge."""

    model: ElasticModel
    ladder: tuple[Climbed, ...] = ()
    known: tuple[KnownSpring, ...] = ()
    refused: tuple[Finding, ...] = ()
    """Models that the readings do not allow."""


def _chosen(
    settings: CalibrateSettings,
    arm: Robot,
    readings: Readings,
    marker: tuple[float, float, float] | None,
    rows: ProductionRows | None,
) -> _Chosen:
    if settings.given is not None:
        return _Chosen(ElasticModel(arm, settings.given))
    name, options = str(settings.springs), settings.options()
    choice = choose_model(arm, readings, name, options, marker, production=rows)
    known = known_springs(arm, name) or choice.known
    ladder = (*choice.ladder, *choice.lacked)
    return _Chosen(choice.model, ladder, known, choice.refused)


def _as_built(
    settings: CalibrateSettings, arm: Robot, measured: Dataset
) -> tuple[Robot, CalibrateSettings]:
    """Return the arm as built, and settings with the marker where the geometry found it.

    Of several markers on the tool that of the readings is the one within a few centimetres of where
    they say; an explicit place counts as it is.
    """
    from elastocal.geometry import read_geometry

    found = read_geometry(present(settings.geometry, "geometry"))
    built = found.as_built(arm)
    markers = found.markers_on(built)
    if settings.marker is None and measured.marker is not None:
        apart = np.linalg.norm(markers - np.array(measured.marker), axis=1)
        if apart.min() < _SAME_MARKER:
            x, y, z = markers[apart.argmin()].tolist()
            settings = replace(settings, marker=(x, y, z))
    return built, settings


def _rebuilt(
    found: Sequence[tuple[Path, Dataset]], arm: Robot, settings: CalibrateSettings
) -> tuple[Dataset, tuple[Finding, ...]]:
    """Return the readings of all campaigns worked out with the arm as built, and what is not."""
    from elastocal.procedure import on_arm_as_built

    rebuilt = [on_arm_as_built(each, arm, settings.marker) for _, each in found]
    paths = (path for path, _ in found)
    measured, _ = merge_files(list(zip(paths, (each.dataset for each in rebuilt), strict=True)))
    return measured, tuple(dict.fromkeys(note for each in rebuilt for note in each.findings))


PRODUCTION_UNKNOWN = Kind(
    "calibration.production-unknown",
    "production is not known, though the cell of {folder} may name it: {error};"
    " name its path (--process)",
)


def _production(
    settings: CalibrateSettings, robot: Robot
) -> tuple[ProductionPath | None, tuple[Finding, ...]]:
    """Return the path of production as the arm runs it, and why it is not known where it should be.

    One that is asked for must fit; one that the cell of a run names is no reason to refuse data.
    """
    if settings.process is not None:
        start = nearest_zero_posture(robot)
        entry, held = ProcessFile(file=settings.process.name), start[None, : robot.external_axes]
        return read_production(settings.process, entry, robot, start, held), ()
    for path in settings.files:
        try:
            cell = _cell_of_run(path)
        except ElastocalError as error:
            return None, (PRODUCTION_UNKNOWN(folder=str(path.parent), error=str(error)),)
        if cell is not None and cell.process is not None and same_joints(cell.robot, robot):
            return cell.process, ()
    return None, ()


def _cell_of_run(path: Path) -> "Cell | None":
    """Return the cell of the run to which a dataset belongs; None if it belongs to none."""
    if not (path.parent / "cell").is_dir():
        return None
    # Their import takes longer than a calibration, and most data belong to no run.
    from elastocal.cell import load_cell
    from elastocal.procedure import RunFolder, read_journal

    run = RunFolder(path.parent)
    entries = read_journal(run.journal) if run.dataset == path and run.journal.is_file() else ()
    record = entries[0].run if entries else None
    return None if record is None else load_cell(run.cell / record.cell_file)


def _rows(path: ProductionPath) -> ProductionRows:
    return ProductionRows(path.joint_position, path.force, path.moment)


def _on_production(
    path: ProductionPath, calibrated: CalibratedModel
) -> tuple[ProductionCoverage | None, PredictionDoubt | None]:
    """Return the coverage of a production path by the calibration, and its uncertainty there."""
    loads = path.joint_position, path.force, path.moment
    return calibrated.coverage(*loads, path.course), calibrated.doubt(*loads)
