"""From a run folder's journal and raw streams to its dataset and summary.

The dataset holds the displacements of every load against the reference of its pose, which is
unloaded or in light contact, and its force against the unloaded sensor.
Both displacements are those of the marker: the tracker's, turned into base, and the controller's,
of the point at the lever arm ``r`` that moves rigidly with its tool frame,

    marker_displacement     = R_base_tracker (p - p_0),
    controller_displacement = (p_tcp + R_tcp r) - (p_tcp,0 + R_tcp,0 r).

Their difference is the elastic deflection of the marker, which the marker's own Jacobian explains
(docs/explanation/registration.md). A press that gave no reading keeps its force and joints, and
its place in time: friction felt it. Presses of an attempt that failed are left out: the arm was
retracted by a free motion after them, and the reference was read anew.

An error of ``R_base_tracker`` by an angle turns the marker's displacement by it: 1 mrad makes 1 µm
of each millimetre; the tracker's place does not enter at all.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import CONDITIONING, SENSOR_CORRECTED, Cell, SensorLoad
from elastocal.dataset import MADE_FROM, STATUSES, Dataset, write
from elastocal.errors import DatasetError, FileAccessError, ProcedureError, SchemaError
from elastocal.findings import Finding
from elastocal.planning import PlanResult
from elastocal.procedure.derive._rows import LoadRow, load_rows, unloaded_references
from elastocal.procedure.derive.findings import RunFindings, summarise
from elastocal.procedure.derive.readings import (
    PoseReadings,
    felt_windows,
    marker_readings,
    places_in_time,
    reduce_pose,
    tool_readings,
)
from elastocal.procedure.derive.summary import RunSummary
from elastocal.procedure.derive.tool import estimate_tool, sensor_load
from elastocal.procedure.record import (
    Entry,
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
from elastocal.procedure.registration import Registration, register
from elastocal.records import write_json
from elastocal.results import brief_repr
from elastocal.robot import Robot

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
    """Of the journal."""
    record: RunRecord
    """Its first entry."""
    cell: Cell
    plan: PlanResult
    poses: tuple[PoseReadings, ...]
    """In the order of time, the last one of each."""
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
    """Acceleration of gravity in base, in m/s²; None: the base stands upright."""
    conditioned: bool = False
    """Whether a full press went before each reference."""
    check: str | None = None
    """Load case that no fit is to see."""


def read_run(run: Path) -> CommittedRun:
    """Return the poses that a run has committed, its files held against their SHA-256.

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
    known = {e.log.streams: e.streams_sha256 for e in entries if e.log is not None}
    for log in logs:
        check_stream(folder.streams / log.streams, known[log.streams])
    poses = tuple(reduce_pose(log, _streams(folder, log, cell)) for log in logs)
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

    What is returned states in its summary the hash of the dataset's file.

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
    cell : Cell
        The cell.
    plan : PlanResult
        The plan; its load cases are the dataset's.
    entries : sequence of Entry
        Of the journal, for times, retries and faults.
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
    tool, lever = sensor or sensor_load(cell), _lever_arm(cell)
    seen = marker_readings(poses, cell.robot, cell.gravity_base, lever)
    registration = register(seen, lever)
    conditioned = cell.file.procedure.conditioning
    rows = load_rows(poses, registration, tool, conditioned=conditioned)
    had = {row.load_case for row in rows if row.status is ReadingStatus.OK}
    if not had:
        raise DatasetError(f"no usable reading among {len(rows)}: {_reasons(rows, registration)}")
    # The press before the reference stays, usable or not: the others' friction begins with it.
    cases = [case for case in plan.contact.load_cases if case in had or case == CONDITIONING]
    arm = measured_arm(cell)
    dataset = dataset_of(poses, rows, cases, arm, registration.lever_arm, tool, provenance)
    ranges = None if cell.file.sensor is None else cell.file.sensor.ranges
    estimate = estimate_tool(tool_readings(poses, tool), tool.mass, ranges)
    found = RunFindings(poses, rows, registration, tool, estimate, dataset, plan, entries)
    return DerivedRun(dataset, summarise(found))


def measured_arm(cell: Cell) -> MeasuredArm:
    """Return what the readings of a cell are taken with."""
    conditioned, check = cell.file.procedure.conditioning, cell.file.load_cases.check_case
    urdf, gravity = cell.urdf_with_tool_mass, cell.gravity_of_mounting
    return MeasuredArm(cell.robot, urdf, gravity, conditioned, check)


def _latest(logs: Sequence[PoseLog]) -> list[PoseLog]:
    """Return one log a pose, the last one of each."""
    latest = {log.pose: log for log in logs}
    return [log for log in logs if latest[log.pose] is log]


def _streams(folder: RunFolder, log: PoseLog, cell: Cell) -> Streams:
    path = folder.streams / log.streams
    streams = read_streams(path, [(window.start, window.end) for window in felt_windows(log)])
    if streams.joint_names != cell.robot.joint_names:
        raise SchemaError(
            f"{path}: joints are {', '.join(streams.joint_names)}, those of the cell"
            f" {', '.join(cell.robot.joint_names)}"
        )
    return streams


def _lever_arm(cell: Cell) -> FloatArray:
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
    """Return where the data of a run come from, as its dataset says."""
    corrected = "" if sensor is None else f", {SENSOR_CORRECTED}"
    return f"elastocal run {folder.path.resolve().name}, {record.origin}{corrected}"


def _by_pose_and_case(
    rows: Sequence[LoadRow], labels: Sequence[int], load_cases: Sequence[str], joints: int
) -> tuple[np.ndarray, dict[str, FloatArray]]:
    """Return status, shape (pose, load_case), and the numbers of rows; NaN where there are none."""
    kept = [row for row in rows if row.load_case in load_cases]
    shape = len(labels), len(load_cases)
    status = np.full(shape, STATUSES.index(ReadingStatus.MISSING.value))
    widths = dict.fromkeys(_NUMBERS, 3) | {"q": joints}
    arrays = {name: np.full((*shape, width), np.nan) for name, width in widths.items()}
    for row in kept:
        place = labels.index(row.pose), load_cases.index(row.load_case)
        status[place] = STATUSES.index(row.status.value)
        for name, array in arrays.items():
            if row.numbers is not None:
                array[place] = getattr(row.numbers, name)
    return status, arrays


def dataset_of(
    poses: Sequence[PoseReadings],
    rows: Sequence[LoadRow],
    load_cases: Sequence[str],
    arm: MeasuredArm,
    lever: FloatArray,
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
    lever : ndarray, shape (3,)
        Marker in the tcp frame, in m.
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
        reference_joint_position=zero.q,
        # As all forces counted from where the tool was off the surface: none, or light contact.
        reference_force=zero.force,
        robot_name=robot.name,
        robot_urdf=arm.urdf,
        tcp_frame=robot.tip,
        marker=tuple(lever.tolist()),
        gravity=arm.gravity,
        conditioned=arm.conditioned,
        check=[case for case in load_cases if case == arm.check],
        provenance=provenance,
    )
