"""From a run folder's journal and raw streams to its dataset and summary.

The dataset holds the displacements of every load against the reference of its pose, which is
unloaded or in light contact, and its force against the unloaded sensor.
Both displacements are those of the marker: the tracker's, turned into base, and the controller's,
of the point at the lever arm ``r`` that moves rigidly with its tool frame,

    marker_displacement     = R_base_tracker (p - p_0),
    controller_displacement = (p_tcp + R_tcp r) - (p_tcp,0 + R_tcp,0 r).

Their difference is the elastic deflection of the marker, which the marker's own Jacobian explains
(docs/explanation/registration.md). A press without a reading keeps its force and joints, and its
position in time, since it changed the state of friction. Presses of a failed attempt are left out:
a free motion retracted the arm after them, and the reference was read again.

An angular error of ``R_base_tracker`` rotates the marker's displacement: 1 mrad gives 1 µm per
millimetre; the tracker's position does not enter. The summary collects the findings, with warnings
for the user.
"""

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from elastocal import __version__
from elastocal.arrays import FloatArray
from elastocal.cell import (
    CONDITIONING,
    LIGHT_CONTACT,
    SENSOR_CORRECTED,
    Cell,
    LineCounts,
    SensorLoad,
)
from elastocal.dataset import MADE_FROM, STATUSES, Dataset, write
from elastocal.errors import DatasetError, FileAccessError, ProcedureError, SchemaError
from elastocal.findings import Finding, Kind, as_number
from elastocal.planning import PlanResult, as_planned
from elastocal.procedure.derive import summary
from elastocal.procedure.derive._rows import (
    LoadRow,
    LoadValues,
    load_rows,
    seen_markers,
    unloaded_references,
)
from elastocal.procedure.derive.doubled import (
    doubled_case,
    label_doubled,
    stacked_contacts,
)
from elastocal.procedure.derive.readings import (
    PoseReadings,
    felt_windows,
    marker_readings,
    places_in_time,
    reduce_pose,
    tool_readings,
    weighed_poses,
)
from elastocal.procedure.derive.summary import RunSummary
from elastocal.procedure.derive.tool import Interval, ToolEstimate, estimate_tool, sensor_load
from elastocal.procedure.record import (
    Entry,
    Event,
    PoseLog,
    ReadingStatus,
    RunFolder,
    RunRecord,
    Streams,
    check_stream,
    commits,
    file_sha256,
    read_copies,
    read_journal,
    read_streams,
    signs_of_a_cut,
)
from elastocal.procedure.registration import NO_REGISTRATION, Registration, StationFit, register
from elastocal.records import write_json
from elastocal.results import brief_repr
from elastocal.robot import Robot

_MANY = 9
"""Power of ten of the runs beyond which a test on assumed distributions says no more."""


def _power_of_ten(exponent: float) -> str:
    """Return a large number as a power of ten."""
    return f"more than 10^{_MANY}" if exponent > _MANY else f"10^{exponent:.0f}"


_mm, _mrad, _kg = as_number(".2f", 1e3), as_number(".2f", 1e3), as_number(".1f")

NO_READING_OF_CASE = Kind(
    "run.no-reading-of-load-case",
    "load case {case} has no usable reading at any pose: the dataset leaves it out",
    shown={"case": repr},
)
NOT_OK = Kind("run.readings-not-ok", "{lost} of {rows} readings are not ok; the list says why")
NO_SCATTER = Kind(
    "run.no-scatter",
    "{name} is left out: some readings show no scatter and no maker's value",
)
UNREGISTERED = Kind(
    "run.station-unregistered",
    "station {station} is not registered, its readings are missing: {reason}",
)
MOVED = Kind(
    "run.station-moved",
    "station {station} moved between poses {before} and {pose}: the marker seemed to"
    " jump by {jump} ± {half} mm, the station turned by {angle} mrad; scatter and"
    " errors of the arm look like this in one run of {runs}; both stretches are"
    " registered by themselves",
    advice="Fix the tracker's stand before the next run: a station that moves splits its poses.",
    shown={"jump": _mm, "half": _mm, "angle": _mrad, "runs": _power_of_ten},
)
BLUNDER = Kind(
    "run.unloaded-blunder",
    "pose {pose}: the unloaded marker reading of station {station} is {distance} mm"
    " off: its displacements are doubtful",
    shown={"distance": _mm},
)
ROTATION = Kind(
    "run.station-rotation",
    "station {station}: its rotation is known to {angle} mrad only, an error of"
    " {angle} µm for each mm of displacement",
    shown={"angle": as_number(".1f", 1e3)},
)
LEVER_UNKNOWN = Kind(
    "run.lever-arm-not-determined",
    "the orientations of the poses are too similar to tell the lever arm of the marker"
    " along {axes} of the tcp: there it is the cell file's",
)
LEVER_AWAY = Kind(
    "run.marker-elsewhere",
    "the marker is {away} mm from where the cell file has it ({place} in the tcp frame)",
    shown={
        "away": as_number(".1f", 1e3),
        "place": lambda point: ", ".join(f"{1e3 * value:.1f} mm" for value in point),
    },
)
TOOL_CHANGED = Kind(
    "run.tool-weight-changed",
    "the tool weight changed near pose {pose}, by about {mass} kg (or the sensor's"
    " zero by as much): no one mass fits the run",
    shown={"mass": as_number("+.1f")},
)
TOOL_ZEROED = Kind(
    "run.tool-weight-zeroed",
    "the sensor shows {mass} ± {half} kg of the tool's {stated} kg: it seems to take"
    " the tool weight away itself",
    shown={"mass": _kg, "half": _kg, "stated": _kg},
)
TOOL_MASS = Kind(
    "run.tool-mass",
    "the tool weighs {mass} ± {half} kg by {count} unloaded references, {stated} kg by"
    " the cell file",
    shown={"mass": _kg, "half": _kg, "stated": _kg},
)
TOOL_CENTRE = Kind(
    "run.tool-centre",
    "the tool's centre of mass is {away} mm along {axis} of the sensor from where the"
    " cell file has it",
    shown={"away": as_number(".0f", 1e3)},
)


_SIGMAS = ("force_sigma", "marker_sigma")
_MASS_SHARE = 0.1
"""Difference from the cell file's mass that is warned of, as a share of it; the sensor's own half
that does not hang on it is within."""
_CENTRE = 20e-3
"""Difference from the cell file's centre of mass that is warned of, along an axis, in m."""
_ZEROED = 0.2
"""Share of the tool's mass below which the sensor seems to take the tool weight away itself."""
_LEVER = 5e-3
"""Difference from the cell file's lever arm that is warned of, in m."""
_HALF = 2.0
"""Standard deviations in half a 95 % interval."""
_LARGE_ROTATION = 5e-3
"""Standard deviation of a station's rotation that is warned of, in rad: 5 µm for each mm."""


@brief_repr
@dataclass(frozen=True, eq=False)
class RunFindings:
    """All findings on the way to the dataset."""

    poses: Sequence[PoseReadings]
    rows: Sequence[LoadRow]
    registration: Registration
    tool: SensorLoad
    estimate: ToolEstimate
    dataset: Dataset
    plan: PlanResult
    entries: Sequence[Entry]
    """The journal, for times, retries and faults."""


def summarise(found: RunFindings) -> summary.RunSummary:
    """Return the summary of a run."""
    committed, weighed = [pose.log.pose for pose in found.poses], weighed_poses(found.poses)
    planned = [pose.id for pose in found.plan.poses]
    cases = [case for case in found.plan.contact.load_cases if case != LIGHT_CONTACT]
    tool, estimate = found.tool, found.estimate
    registration = None if found.registration is NO_REGISTRATION else found.registration
    missing = tuple(pose for pose in planned if pose not in committed)
    warnings = run_warnings(found.rows, registration, tool, estimate, cases, weighed)
    return summary.RunSummary(
        elastocal=__version__,
        poses=summary.PoseCounts(len(planned), len(committed), missing),
        readings=_readings(found.rows),
        registration=None if registration is None else _registration(registration, found.dataset),
        tool=_tool(tool, estimate, weighed),
        drift=_drift(found.poses),
        contact_moment=_moments(found.rows),
        noise=_noise(found.rows, tracked=registration is not None),
        attempts=_attempts(found.poses, found.entries),
        lines=_lines(found.entries),
        times=_times(found.poses, found.entries),
        warnings=tuple(warnings),
    )


def _readings(rows: Sequence[LoadRow]) -> summary.ReadingCounts:
    counts = Counter(row.status.value for row in rows)
    lost = (
        summary.LostReading(row.pose, row.load_case, row.status, row.note) for row in _not_ok(rows)
    )
    return summary.ReadingCounts({s.value: counts[s.value] for s in ReadingStatus}, tuple(lost))


def _registration(found: Registration, dataset: Dataset) -> summary.RegistrationSummary:
    typical = np.linalg.norm(dataset.arrays["marker_displacement"], axis=-1)
    displacement = float(np.nanmedian(typical))
    return summary.RegistrationSummary(
        stations=tuple(_station(fit, displacement) for fit in found.stations),
        unregistered=found.unregistered,
        lever_arm=_vector(found.lever_arm),
        lever_arm_sigma=_vector(found.lever_sigma),
        lever_arm_of_cell=_vector(found.lever_prior),
        lever_arm_from_cell_along=found.undetermined_lever,
        scatter=_number(found.scatter),
        moves=tuple(
            summary.MoveSummary(
                move.station,
                move.pose,
                move.distance,
                move.angle,
                move.improbability,
                move.distance_sigma,
            )
            for move in found.moves
        ),
        blunders=found.blunders,
        detectable_move=_number(found.detectable),
    )


def _station(fit: StationFit, displacement: float) -> summary.StationSummary:
    norms = np.linalg.norm(fit.residual, axis=1)
    return summary.StationSummary(
        station=fit.station,
        poses=fit.poses,
        T_base_tracker=tuple(map(tuple, fit.T_base_tracker.tolist())),
        rotation_sigma=fit.rotation_sigma,
        position_sigma=_vector(fit.position_sigma),
        residual=tuple(map(_vector, fit.residual)),
        residual_rms=float(np.sqrt((norms**2).mean())),
        robot_accuracy=fit.accuracy,
        residual_max=float(norms.max()),
        displacement_sigma=fit.rotation_sigma * displacement,
    )


def _tool(tool: SensorLoad, found: ToolEstimate, weighed: Sequence[int]) -> summary.ToolSummary:
    step = found.change
    mass, half = (_number(float(part)) for part in (found.mass.value, found.mass.half_width))
    centre = _interval(found.centre)
    return summary.ToolSummary(
        unloaded_references=found.count,
        mass_kg=summary.ScalarEstimate(mass, half, tool.mass),
        centre_of_mass=summary.VectorEstimate(
            centre.value, centre.half_width_95, _vector(tool.centre)
        ),
        force_bias_N=_interval(found.force_bias),
        moment_bias_Nm=_interval(found.moment_bias),
        force_drift_N_per_s=_interval(found.force_drift),
        moment_drift_Nm_per_s=_interval(found.moment_drift),
        force_scatter_N=_number(found.force_scatter),
        moment_scatter_Nm=_number(found.moment_scatter),
        not_determined=found.undetermined,
        changed=summary.ToolStep(weighed[step.reading], step.mass) if step else None,
    )


def _drift(poses: Sequence[PoseReadings]) -> summary.DriftSummary:
    """Return the sensor's deviation from its tare when the tool is free again, by pose."""
    found = []
    for pose in poses:
        before = pose.reference.tool if pose.reference else None
        after = pose.released.tool if pose.released else None
        if before is not None and after is not None:
            change = float(np.linalg.norm(after.force.value - before.force.value))
            found.append((change, pose.pose, after.force.time - before.force.time))
    if not found:
        return summary.DriftSummary(0, None, None, None)
    return summary.DriftSummary(len(found), *max(found, key=lambda each: each[0]))


def _moments(rows: Sequence[LoadRow]) -> summary.MomentSummary:
    sizes = [float(np.linalg.norm(row.numbers.moment)) for row in rows if row.numbers]
    return summary.MomentSummary(len(sizes), _median(sizes), max(sizes, default=None))


def _noise(rows: Sequence[LoadRow], *, tracked: bool) -> summary.NoiseSummary:
    good = _good(rows)
    forces, markers = ([getattr(each, name) for each in good] for name in _SIGMAS)
    marker = _median(markers) if tracked else None
    return summary.NoiseSummary(len(good), _median(forces), marker)


def _lines(entries: Sequence[Entry]) -> tuple[LineCounts, ...]:
    """Return the counts of each device, those of all sessions together."""
    sums: dict[str, LineCounts] = {}
    for counts in (each for entry in entries for each in entry.lines):
        before = sums.get(counts.device)
        sums[counts.device] = counts if before is None else before.plus(counts)
    return tuple(sums.values())


def _attempts(poses: Sequence[PoseReadings], entries: Sequence[Entry]) -> summary.AttemptSummary:
    faults = (e for e in entries if e.event is Event.FAULT)
    return summary.AttemptSummary(
        retried={str(p.log.pose): p.log.attempt for p in poses if p.log.attempt > 1},
        given_up=tuple(entry.pose for entry in entries if entry.event is Event.GIVEN_UP),
        resumed=sum(entry.event is Event.RESUME for entry in entries),
        faults=tuple(summary.FaultSummary(e.pose, e.attempt, e.step, e.text) for e in faults),
    )


def _times(poses: Sequence[PoseReadings], entries: Sequence[Entry]) -> summary.TimeSummary:
    windows = [pose.log.windows for pose in poses if pose.log.windows]
    spans = [max(w.end for w in each) - min(w.start for w in each) for each in windows]
    record = entries[0].run if entries else None
    return summary.TimeSummary(
        started=record.started if record else None,
        measuring_per_pose_median=_median(spans),
        total=entries[-1].time - entries[0].time if entries else None,
    )


def _good(rows: Sequence[LoadRow]) -> list[LoadValues]:
    """Return the numbers of the readings that are ok."""
    return [r.numbers for r in rows if r.numbers is not None and r.status is ReadingStatus.OK]


def _not_ok(rows: Sequence[LoadRow]) -> list[LoadRow]:
    return [row for row in rows if row.status is not ReadingStatus.OK]


def _interval(interval: Interval) -> summary.VectorInterval:
    return summary.VectorInterval(_vector(interval.value), _vector(interval.half_width))


def _median(values: Sequence[float] | Sequence[FloatArray]) -> summary.Number:
    return float(np.median(np.array(values))) if len(values) else None


def _vector(values: FloatArray) -> summary.Vector:
    x, y, z = (_number(float(value)) for value in values)
    return x, y, z


def _number(value: float) -> summary.Number:
    """Return a number, or None if it is not finite: JSON has no NaN."""
    return value if np.isfinite(value) else None


def run_warnings(
    rows: Sequence[LoadRow],
    registration: Registration | None,
    tool: SensorLoad,
    estimate: ToolEstimate,
    load_cases: Sequence[str],
    weighed: Sequence[int],
) -> list[Finding]:
    """Return the warnings of a run.

    Parameters
    ----------
    rows : sequence of LoadRow
        Readings of all poses.
    registration : Registration, optional
        Stations and marker; None: no tracker measured.
    tool, estimate : SensorLoad, ToolEstimate
        The tool by the cell file and by the unloaded references.
    load_cases : sequence of str
        Load cases of the plan.
    weighed : sequence of int
        Poses of the unloaded references that the tool was estimated from.
    """
    return [
        *_about_readings(rows, load_cases, _SIGMAS if registration else _SIGMAS[:1]),
        *(() if registration is None else _about_stations(registration)),
        *(() if registration is None else _about_lever(registration)),
        *_about_tool(tool, estimate, weighed),
    ]


def _about_readings(
    rows: Sequence[LoadRow], load_cases: Sequence[str], sigmas: Sequence[str]
) -> Iterator[Finding]:
    had = {row.load_case for row in rows if row.status is ReadingStatus.OK}
    for case in load_cases:
        if case not in had:
            yield NO_READING_OF_CASE(case=case)
    if lost := len(_not_ok(rows)):
        yield NOT_OK(lost=lost, rows=len(rows))
    for name in sigmas:
        if any(not np.all(getattr(numbers, name) > 0) for numbers in _good(rows)):
            yield NO_SCATTER(name=name)


def _about_stations(registration: Registration) -> Iterator[Finding]:
    for station, reason in registration.unregistered.items():
        yield UNREGISTERED(station=station, reason=reason)
    for move in registration.moves:
        yield MOVED(
            station=move.station,
            before=move.before,
            pose=move.pose,
            jump=move.distance,
            half=_HALF * move.distance_sigma,
            angle=move.angle,
            runs=-move.improbability,
        )
    for blunder in registration.blunders:
        yield BLUNDER(pose=blunder.pose, station=blunder.station, distance=blunder.distance)
    for fit in registration.stations:
        if not fit.rotation_sigma <= _LARGE_ROTATION:
            yield ROTATION(station=fit.station, angle=fit.rotation_sigma)


def _about_lever(registration: Registration) -> Iterator[Finding]:
    if registration.undetermined_lever:
        yield LEVER_UNKNOWN(axes=registration.undetermined_lever)
    away = float(np.linalg.norm(registration.lever_arm - registration.lever_prior))
    if not away <= _LEVER:
        yield LEVER_AWAY(away=away, place=registration.lever_arm.tolist())


def _about_tool(
    tool: SensorLoad, estimate: ToolEstimate, weighed: Sequence[int]
) -> Iterator[Finding]:
    if estimate.change is not None:
        yield TOOL_CHANGED(pose=weighed[estimate.change.reading], mass=float(estimate.change.mass))
        return
    mass, half = float(estimate.mass.value), float(estimate.mass.half_width)
    weights = {"mass": mass, "half": half, "stated": float(tool.mass)}
    if mass + half < _ZEROED * tool.mass:
        yield TOOL_ZEROED(**weights)
    elif abs(mass - tool.mass) > max(half, _MASS_SHARE * tool.mass):
        yield TOOL_MASS(**weights, count=estimate.count)
    away = np.abs(estimate.centre.value - tool.centre)
    far = away > np.maximum(estimate.centre.half_width, _CENTRE)
    if np.any(far):
        axis = int(np.argmax(np.where(far, away, 0.0)))
        yield TOOL_CENTRE(away=float(away[axis]), axis="xyz"[axis])


_NUMBERS = (
    "force",
    "controller_displacement",
    "marker_displacement",
    "force_sigma",
    "marker_sigma",
)
"""Numbers of a row along the axes of base, beside its joints."""


@dataclass(frozen=True, eq=False)
class DerivedRun:
    """The dataset of a run, and how it came about."""

    dataset: Dataset
    summary: RunSummary


@brief_repr
@dataclass(frozen=True, eq=False)
class CommittedRun:
    """The poses that a run has committed, from files that are what the run wrote."""

    folder: RunFolder
    entries: tuple[Entry, ...]
    """Entries of the journal."""
    record: RunRecord
    """Its first entry."""
    cell: Cell
    plan: PlanResult
    poses: tuple[PoseReadings, ...]
    """Poses in the order of time, the last attempt of each."""
    signs: tuple[Finding, ...]
    """Signs that the journal has lost its end; see `signs_of_a_cut`."""


@brief_repr
@dataclass(frozen=True, eq=False)
class MeasuredArm:
    """The arm that readings were taken with."""

    robot: Robot
    urdf: str
    """With the tool's mass."""
    gravity: tuple[float, float, float] | None = None
    """Acceleration of gravity in base, in m/s²; None: the base is upright."""
    conditioned: bool = False
    """Whether a full press went before each reference."""
    check: str | None = None
    """Load case that no fit is to see."""


def read_run(run: Path) -> CommittedRun:
    """Return the poses that a run has committed, its files verified by their SHA-256.

    Parameters
    ----------
    run : Path
        Folder of the run: copies of cell and plan, journal, streams.

    Raises
    ------
    ProcedureError
        If no pose is committed.
    SchemaError
        If a file of the run is damaged, of another kind, or not what the run wrote.
    FileAccessError
        If a file cannot be read.
    """
    folder = RunFolder(Path(run))
    if not folder.path.exists():
        raise FileAccessError(f"{run}: there is no such folder")
    if not folder.journal.is_file():
        raise FileAccessError(f"{run} is no folder of a run: it holds no {folder.journal.name}")
    entries = read_journal(folder.journal)
    logs = _latest(commits(entries))
    signs = signs_of_a_cut(folder, entries)
    if not entries or entries[0].run is None or not logs:
        why = "".join(f"; {sign}" for sign in signs)
        raise ProcedureError(
            f"{folder.journal}: no pose is committed: there is nothing to derive{why}"
        )
    record = entries[0].run
    cell, plan = read_copies(folder, record)
    cell = as_planned(cell, plan)
    known = {e.log.streams: e.streams_sha256 for e in entries if e.log is not None}
    for log in logs:
        check_stream(folder.streams / log.streams, known[log.streams])
    poses = tuple(read_pose(folder, log, cell) for log in logs)
    return CommittedRun(folder, entries, record, cell, plan, poses, signs)


def derive_run(run: Path, sensor: SensorLoad | None = None, tool: Path | None = None) -> DerivedRun:
    """Return dataset and summary of the poses that a run has committed.

    Parameters
    ----------
    run : Path
        Folder of the run; see `read_run`, also for what it raises.
    sensor : SensorLoad, optional
        The tool on its sensor, with the matrix that corrects readings, from a tool file; by
        default the cell file's, and readings are taken as they are.
    tool : Path, optional
        That file; the dataset states its SHA-256 beside that of the journal, which holds those of
        the streams.

    Raises
    ------
    ProcedureError
        If no pose is committed, or the cell has no sensor or no tracker.
    DatasetError
        If no reading is usable.
    """
    found = read_run(run)
    if found.record.touch is not None:
        raise ProcedureError(
            f"{run} holds touches, which press no load case: `elastocal touch` reads them"
        )
    files = [found.folder.journal, *([tool] if tool is not None else [])]
    made_from = {file.name: file_sha256(file) for file in files}
    provenance = run_provenance(found.folder, found.record, sensor)
    try:
        derived = derive_poses(
            found.poses, found.cell, found.plan, found.entries, provenance, sensor
        )
    except (DatasetError, ProcedureError) as error:
        raise type(error)(f"{found.folder.path}: {error}") from error
    warnings = (*found.signs, *derived.summary.warnings)
    attributes = {**derived.dataset.attributes, MADE_FROM: json.dumps(made_from)}
    return DerivedRun(
        replace(derived.dataset, attributes=attributes),
        replace(derived.summary, warnings=warnings),
    )


def write_derived(run: Path, derived: DerivedRun) -> DerivedRun:
    """Write ``dataset.nc`` and ``summary.json`` of a run, each whole or not at all.

    The summary of the returned object states the hash of the dataset's file.

    Raises
    ------
    FileAccessError
        If a file cannot be written.
    """
    folder = RunFolder(Path(run))
    write(derived.dataset, folder.dataset)
    summary = replace(derived.summary, dataset_sha256=file_sha256(folder.dataset))
    write_json(folder.summary, summary)
    return replace(derived, summary=summary)


def derive_poses(
    poses: Sequence[PoseReadings],
    cell: Cell,
    plan: PlanResult,
    entries: Sequence[Entry],
    provenance: str,
    sensor: SensorLoad | None = None,
) -> DerivedRun:
    """Return dataset and summary of reduced poses.

    Parameters
    ----------
    poses : sequence of PoseReadings
        In the order of time.
    plan : PlanResult
        The plan; its load cases are the dataset's.
    entries : sequence of Entry
        Entries of the journal, for times, retries and faults.
    provenance : str
        Where the data come from.
    sensor : SensorLoad, optional
        The tool on its sensor; by default the cell file's.

    Raises
    ------
    ProcedureError
        If the cell has no sensor or no tracker.
    DatasetError
        If no reading is usable.
    """
    poses = label_doubled(poses, plan)
    tool = sensor or sensor_load(cell)
    registration = NO_REGISTRATION
    if plan.tracked:
        lever = marker_in_tcp(cell)
        seen = marker_readings(poses, cell.robot, cell.gravity_base, lever)
        registration = register(seen, lever)
    conditioned = cell.file.procedure.conditioning
    rows = load_rows(poses, registration, tool, conditioned=conditioned, metrology=plan.tracked)
    had = {row.load_case for row in rows if row.status is ReadingStatus.OK}
    if not had:
        raise DatasetError(f"no usable reading among {len(rows)}: {_reasons(rows, registration)}")
    # The press before the reference stays, usable or not: the others' friction begins with it.
    planned = (*plan.contact.load_cases, *map(doubled_case, plan.contact.load_cases))
    cases = [case for case in planned if case in had or case == CONDITIONING]
    arm = measured_arm(cell)
    dataset = dataset_of(poses, rows, cases, arm, registration, tool, provenance)
    ranges = None if cell.file.sensor is None else cell.file.sensor.ranges
    estimate = estimate_tool(tool_readings(poses, tool), tool.mass, ranges)
    found = RunFindings(poses, rows, registration, tool, estimate, dataset, plan, entries)
    return DerivedRun(dataset, summarise(found))


def measured_arm(cell: Cell) -> MeasuredArm:
    """Return the arm that the readings of a cell are taken with."""
    conditioned, check = cell.file.procedure.conditioning, cell.file.load_cases.check_case
    urdf, gravity = cell.urdf_with_tool_mass, cell.gravity_of_mounting
    return MeasuredArm(cell.robot, urdf, gravity, conditioned, check)


def _latest(logs: Sequence[PoseLog]) -> list[PoseLog]:
    """Return one log for each pose, the last one."""
    latest = {log.pose: log for log in logs}
    return [log for log in logs if latest[log.pose] is log]


def read_pose(folder: RunFolder, log: PoseLog, cell: Cell) -> PoseReadings:
    """Return what a committed pose was averaged to, from its streams.

    Raises
    ------
    SchemaError
        If the file is damaged, or of other joints.
    FileAccessError
        If it cannot be read.
    """
    return reduce_pose(log, _streams(folder, log, cell))


def _streams(folder: RunFolder, log: PoseLog, cell: Cell) -> Streams:
    path = folder.streams / log.streams
    streams = read_streams(path, [(window.start, window.end) for window in felt_windows(log)])
    if streams.joint_names != cell.robot.joint_names:
        raise SchemaError(
            f"{path}: joints are {', '.join(streams.joint_names)}, those of the cell"
            f" {', '.join(cell.robot.joint_names)}"
        )
    return streams


def marker_in_tcp(cell: Cell) -> FloatArray:
    """Return where the cell file has the marker, in the tcp frame, shape (3,), in m.

    Raises
    ------
    ProcedureError
        If the cell has no metrology.
    """
    if cell.file.marker is None or not cell.file.trackers:
        raise ProcedureError(
            f"cell {cell.name!r} has no metrology (keys 'marker' and 'trackers'): without it there"
            " is no displacement to identify anything from"
        )
    return cell.file.marker.position_tcp


def _reasons(rows: Sequence[LoadRow], registration: Registration) -> str:
    if registration.unregistered:
        name, reason = next(iter(registration.unregistered.items()))
        return f"station {name} is not registered: {reason}"
    return next((row.note for row in rows if row.note), "there is none")


def run_provenance(folder: RunFolder, record: RunRecord, sensor: SensorLoad | None) -> str:
    """Return the provenance of a run's data, as its dataset states it."""
    corrected = "" if sensor is None else f", {SENSOR_CORRECTED}"
    return f"elastocal run, folder {folder.path.resolve().name}, {record.origin}{corrected}"


def _by_pose_and_case(
    rows: Sequence[LoadRow], labels: Sequence[int], load_cases: Sequence[str], joints: int
) -> tuple[np.ndarray, dict[str, FloatArray]]:
    """Return status, shape (pose, load_case), and the numbers of rows; NaN where there are none."""
    kept = [row for row in rows if row.load_case in load_cases]
    shape = len(labels), len(load_cases)
    status = np.full(shape, STATUSES.index(ReadingStatus.MISSING.value))
    widths = dict.fromkeys(_NUMBERS, 3) | {"q": joints, "link": joints}
    arrays = {name: np.full((*shape, width), np.nan) for name, width in widths.items()}
    for row in kept:
        place = labels.index(row.pose), load_cases.index(row.load_case)
        status[place] = STATUSES.index(row.status.value)
        for name, array in arrays.items():
            value = None if row.numbers is None else getattr(row.numbers, name)
            if value is not None:
                array[place] = value
    return status, arrays


def _stations(registration: Registration) -> dict[str, tuple[int, ...]]:
    """Return the poses of each station by its name; one that moved is another from there on."""
    named = Counter(each.station for each in registration.stations)
    return {
        each.station if named[each.station] == 1 else f"{each.station} from {each.poses[0]}": (
            each.poses
        )
        for each in registration.stations
    }


def dataset_of(
    poses: Sequence[PoseReadings],
    rows: Sequence[LoadRow],
    load_cases: Sequence[str],
    arm: MeasuredArm,
    registration: Registration,
    sensor: SensorLoad,
    provenance: str,
) -> Dataset:
    """Return the dataset of a run: all rows, with the load cases to keep.

    Parameters
    ----------
    poses : sequence of PoseReadings
        In the order of time.
    rows : sequence of LoadRow
        Their loads, as `load_rows` returns them.
    load_cases : sequence of str
        In order in time.
    arm : MeasuredArm
        What they were taken with.
    registration : Registration
        Stations and marker.
    sensor : SensorLoad
        The tool on its sensor.
    provenance : str
        Where the data come from.

    Raises
    ------
    DatasetError
        If the numbers look like a unit mistake.

    Notes
    -----
    The moment is left out: the paper's row takes the force alone, and a moment that is moved from
    the sensor to the tcp carries the sensor's place and cross-talk with the arm of the tool. On
    the example cell (preset typical, 5 N·m) it makes no difference (decision 72).
    """
    robot, labels = arm.robot, tuple(dict.fromkeys(row.pose for row in rows))
    status, arrays = _by_pose_and_case(rows, labels, load_cases, len(robot.joint_names))
    ok = status == STATUSES.index(ReadingStatus.OK.value)

    def sigma(name: str) -> FloatArray | None:
        return arrays[name] if np.all(arrays[name][ok] > 0) else None

    zero = unloaded_references(poses, labels, sensor)
    displacement = arrays["marker_displacement"]
    has_links = not np.isnan(arrays["link"][ok]).all()
    is_unseen = bool(ok.any() and np.isnan(displacement[ok]).all())
    return Dataset.from_arrays(
        joint_position=arrays["q"],
        force=arrays["force"],
        controller_displacement=arrays["controller_displacement"],
        marker_displacement=None if is_unseen else displacement,
        force_sigma=sigma("force_sigma"),
        marker_sigma=sigma("marker_sigma"),
        joint_names=robot.joint_names,
        joint_units=["rad" if revolute else "m" for revolute in robot.revolute],
        load_cases=load_cases,
        poses=labels,
        status=status,
        sequence=places_in_time(poses, labels, load_cases),
        tcp_position=zero.tcp,
        marker_position=None if is_unseen else seen_markers(poses, labels, registration),
        stations=None if is_unseen else _stations(registration),
        reference_joint_position=zero.q,
        link_joint_position=arrays["link"] if has_links else None,
        reference_link_joint_position=zero.link if has_links else None,
        # As all forces counted from where the tool was off the surface: none, or light contact.
        reference_force=zero.force,
        robot_name=robot.name,
        robot_urdf=arm.urdf,
        tcp_frame=robot.tip,
        marker=None if is_unseen else tuple(registration.lever_arm.tolist()),
        contacts=stacked_contacts(poses, labels, load_cases),
        gravity=arm.gravity,
        conditioned=arm.conditioned,
        check=[case for case in load_cases if case == arm.check],
        provenance=provenance,
    )
