"""``live``: a programmed path corrected while it is run: wrench in, correction out, each cycle."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from os import PathLike
from pathlib import Path
from typing import Annotated

from elastocal.cell import Arming, Cell, PathLimits, load_cell
from elastocal.compensation import CompensatorSettings, read_settings
from elastocal.compensation.conditioning import read_sensor_load
from elastocal.compensation.online import TaughtCourses, design
from elastocal.errors import CompensationError, DeviceError
from elastocal.files import filling
from elastocal.identification import CalibratedModel, ModelSource, model_name
from elastocal.options import Option
from elastocal.procedure.derive import read_taught_markers, sensor_load
from elastocal.progress import Progress
from elastocal.records import validate, write_json
from elastocal.results import brief_repr
from elastocal.units import in_unit, quantity
from elastocal.workflows._inputs import (
    NewTool,
    TouchedArm,
    coverage_notes,
    growth_notes,
    require_model_of_arm,
    require_same_robot,
    seconds_of,
)
from elastocal.workflows._live_session import LiveReport, LiveResult, LiveSession, Prepared
from elastocal.workflows._operator_and_devices import rig_of
from elastocal.workflows._workflow import workflow

LIVE_RECORD, LIVE_LOG = "live.json", "live.mcap"
"""Files of a live compensation, in its folder."""
_FADE = 0.005
"""Default speed of the fade, in m/s, where the limits allow it."""


@brief_repr
@dataclass(frozen=True)
class LiveSettings(NewTool, TouchedArm):
    """Settings of a live compensation: cell, model and observers."""

    cell: Annotated[str | PathLike[str], Option(argument=True)]
    """Cell file, ``.yaml``, whose arm takes corrections of a path."""
    model: Annotated[ModelSource, Option(metavar="MODEL.json")]
    """Model file of `calibrate`; in Python also what it returned."""
    arm: bool = False
    """Somebody has looked at the cell, and the arm may be corrected; refused without."""
    duration: str | float | None = None
    """Time with its unit, or in s, after which it ends; none: when it is interrupted."""
    out: Annotated[Path | None, Option(metavar="FOLDER")] = None
    """Folder for log and record; none: neither is written."""
    compensator: Annotated[Path | None, Option("--settings")] = None
    """Settings of the compensator (.yaml); default: the limits of the cell file."""
    tool: Path | None = None
    """Tool file of `tool`; none: the tool of the cell file, and the bias that the sensor has at
    the beginning, when the tool must be free."""
    taught: Annotated[tuple[Path, ...], Option("--taught", metavar="RUN")] = ()
    """Runs that say how the tracker stands; cold touches (`run --touch cold`) also teach where
    courses begin. The tracker is read in light contact at the start of each course, after a press,
    and what it shows beyond what was taught there and is predicted is corrected over it."""
    force: bool = False
    """Replace files in the folder."""
    report: Callable[[LiveReport], None] = lambda _report: None
    """Called twice a second; the duration waits for it."""
    warn: Callable[[str], None] = lambda _text: None
    """Called with each warning, before the first cycle."""
    interrupted: Callable[[], bool] = lambda: False
    """Whether it is to end now; Ctrl-C ends it, too."""


@workflow(LiveSettings)
def live(settings: LiveSettings, progress: Progress) -> LiveResult:  # noqa: ARG001 - it reports
    """Correct the path that an arm's own program follows, by the measured wrench, cycle by cycle.

    Soft real time: answers, and late ones among them, are counted. It ends after the duration or
    when it is interrupted: the correction fades to zero, the controller is sent the end of
    corrections, and the record is written.

    Raises
    ------
    DeviceError
        If the cell file states no limits, its arm takes no corrections, ``arm`` is not given, or
        a device cannot be used.
    RobotError, CompensationError
        If model, cell, tool and settings do not belong together.
    FileAccessError
        If a file cannot be read or written.
    """
    ready = _prepare(settings)
    for text in ready.notes:
        settings.warn(text)
    if not settings.arm:
        limits = ready.limits
        raise DeviceError(
            f"nothing was started: {ready.cell.robot.name} would be corrected by up to"
            f" {quantity(limits.correction, 'mm')} at up to {quantity(limits.rate, 'mm/s')}; give"
            " --arm when somebody has looked at the cell"
        )
    started = datetime.now(UTC).isoformat(timespec="seconds")
    kinds = ("arm", "sensor") if ready.taught is None else ("arm", "sensor", "metrology")
    with ready.rig.reserved("live", kinds) as rig:
        session = LiveSession(
            ready, rig, Arming.of(ready.cell), settings.report, settings.interrupted
        )
        if settings.out is None:
            return session.run(None, started)
        with filling(settings.out, LIVE_RECORD, settings.force) as folder:
            found = session.run(folder / LIVE_LOG, started)
            write_json(folder / LIVE_RECORD, found)
        return found


def _prepare(settings: LiveSettings) -> Prepared:
    """Read and check everything that needs no device."""
    cell, duration = load_cell(Path(settings.cell)), seconds_of(settings.duration)
    rig = rig_of(cell)
    driver, arm = rig.path_arm()
    limits = driver.path_limits(cell, arm)
    calibrated = settings.read_model(settings.model)
    name = model_name(settings.model)
    require_same_robot(calibrated.model.robot, cell.robot, (name, cell.name))
    require_model_of_arm(calibrated, name)
    chosen = settings_within(settings.compensator, limits, cell)
    load = read_sensor_load(settings.tool, calibrated.model.robot) or sensor_load(cell)
    state = settings.growth(calibrated.model.robot)
    try:
        numbers = design(calibrated, chosen, load, state)
    except CompensationError as error:
        raise CompensationError(f"{name}: {error}") from error
    return Prepared(
        cell=cell,
        model=name,
        rig=rig,
        driver=driver,
        limits=limits,
        calibrated=calibrated,
        numbers=numbers,
        duration=duration,
        tares=settings.tool is None,
        notes=(
            *_notes(settings, cell, calibrated),
            *growth_notes(state),
        ),
        taught=_taught(settings, cell),
    )


def _taught(settings: LiveSettings, cell: Cell) -> TaughtCourses | None:
    """Return what was read where courses begin; None: their offsets are not read."""
    if not settings.taught:
        return None
    found = read_taught_markers(settings.taught)
    require_same_robot(found.robot, cell.robot, (str(settings.taught[0]), cell.name))
    if found.station not in (names := [each.name for each in cell.file.trackers]):
        raise CompensationError(
            f"{settings.taught[0]}: measured by station {found.station}; {cell.path} has"
            f" {', '.join(names) or 'none'}"
        )
    return TaughtCourses(
        found.place, found.offset, found.T_base_tracker, found.station, found.lever
    )


def settings_within(file: Path | None, limits: PathLimits, cell: Cell) -> CompensatorSettings:
    """Return the settings of a file, within the limits of the cell; or what these make.

    Raises
    ------
    CompensationError, SchemaError
        If they exceed the limits, or have another cycle or frame.
    """
    if file is None:
        data: dict[str, object] = _range(cell) | {
            "cycle": f"{limits.cycle!r} s",
            "frame": limits.frame,
            "limits": {
                "correction": f"{limits.correction!r} m",
                "rate": f"{limits.rate!r} m/s",
                "fade": f"{min(_FADE, limits.rate)!r} m/s",
            },
        }
        return validate(data, CompensatorSettings, f"{cell.path}: limits of corrections")
    found = read_settings(file)
    for what, ours, theirs in (
        ("cycle", found.cycle, limits.cycle),
        ("frame", found.frame, limits.frame),
    ):
        if ours != theirs:
            raise CompensationError(f"{file}: {what} is {ours}: must be {theirs}, the arm's")
    for what, ours, theirs in (
        ("limits.correction", found.limits.correction, limits.correction),
        ("limits.rate", found.limits.rate, limits.rate),
    ):
        if not ours <= theirs:
            raise CompensationError(
                f"{file}: {what} is {quantity(ours, 'mm')}{'/s' if what.endswith('rate') else ''}:"
                f" at most {in_unit(theirs, 'mm'):g}, which the cell file allows"
            )
    if "sensor" not in found.model_fields_set:
        ranges = validate(_range(cell), CompensatorSettings, f"{cell.path}: sensor").sensor
        found = found.model_copy(update={"sensor": ranges})
    return found


def _range(cell: Cell) -> dict[str, object]:
    """Return the range of the cell's sensor, as settings have it."""
    sensor = cell.file.sensor
    if sensor is None:
        return {}
    force, moment = sensor.force_range, sensor.moment_range
    return {
        "sensor": {
            "force": [f"{value!r} N" for value in force],
            "moment": [f"{value!r} N*m" for value in moment],
        }
    }


def _notes(settings: LiveSettings, cell: Cell, calibrated: CalibratedModel) -> tuple[str, ...]:
    notes = list(coverage_notes(calibrated)) if calibrated.tool is not None else []
    names = calibrated.model.robot.name, cell.robot.name
    if names[0] != names[1]:
        notes.append(f"the model is of a robot named {names[0]}, the cell's is {names[1]}")
    if settings.tool is None:
        notes.append(
            "no tool file: the tool's weight is that of the cell file, and the sensor's bias is"
            " what it reads in the first half second, in which the tool must be free"
        )
    if calibrated.on_production is not None:
        notes += calibrated.on_production.warnings
    if cell.process is not None:
        path = cell.process
        covered = calibrated.coverage(path.joint_position, path.force, path.moment, path.course)
        if covered is not None and not covered.is_enough:
            notes.append(covered.sentence())
    return tuple(notes)
