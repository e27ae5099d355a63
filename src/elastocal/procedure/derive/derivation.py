"""From a run folder's journal and raw streams to its dataset and summary."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.dataset import Dataset, write
from elastocal.errors import DatasetError, FileAccessError, ProcedureError, SchemaError
from elastocal.planning import PlanResult
from elastocal.procedure.derive.displacement import LoadRow, load_rows, make_dataset
from elastocal.procedure.derive.findings import RunFindings, summarise
from elastocal.procedure.derive.readings import (
    PoseReadings,
    marker_readings,
    reduce_pose,
    tool_readings,
)
from elastocal.procedure.derive.summary import RunSummary
from elastocal.procedure.derive.tool import ToolLoad, estimate_tool
from elastocal.procedure.record import (
    Entry,
    PoseLog,
    ReadingStatus,
    RunFolder,
    RunRecord,
    Streams,
    check_stream,
    commits,
    read_copies,
    read_journal,
    read_streams,
)
from elastocal.procedure.registration import Registration, register
from elastocal.records import write_json
from elastocal.robot import inverse_transform


@dataclass(frozen=True, eq=False)
class DerivedRun:
    """The dataset of a run, and how it came about."""

    dataset: Dataset
    summary: RunSummary


def derive_run(run: Path) -> DerivedRun:
    """Return dataset and summary of the poses that a run has committed.

    Parameters
    ----------
    run : Path
        Folder of the run: copies of cell and plan, journal, streams.

    Raises
    ------
    ProcedureError
        If no pose is committed, or the cell has no sensor or no tracker.
    SchemaError
        If a file of the run is damaged, of another kind, or not what the run wrote.
    DatasetError
        If no reading is usable.
    FileAccessError
        If a file cannot be read.
    """
    folder = RunFolder(Path(run))
    if not folder.journal.is_file():
        raise FileAccessError(f"{run} is no folder of a run: it holds no {folder.journal.name}")
    entries = read_journal(folder.journal)
    logs = _latest(commits(entries))
    if not entries or entries[0].run is None or not logs:
        raise ProcedureError(f"{folder.journal}: no pose is committed: there is nothing to derive")
    record = entries[0].run
    cell, plan = read_copies(folder, record)
    known = {e.log.streams: e.streams_sha256 for e in entries if e.log is not None}
    for log in logs:
        check_stream(folder.streams / log.streams, known[log.streams])
    poses = [reduce_pose(log, _streams(folder, log, cell)) for log in logs]
    try:
        return derive_poses(poses, cell, plan, entries, _provenance(folder, record))
    except (DatasetError, ProcedureError) as error:
        raise type(error)(f"{folder.path}: {error}") from error


def write_derived(run: Path, derived: DerivedRun) -> None:
    """Write ``dataset.nc`` and ``summary.json`` of a run, each whole or not at all.

    Raises
    ------
    FileAccessError
        If a file cannot be written.
    """
    folder = RunFolder(Path(run))
    write(derived.dataset, folder.dataset)
    write_json(folder.summary, derived.summary)


def derive_poses(
    poses: Sequence[PoseReadings],
    cell: Cell,
    plan: PlanResult,
    entries: Sequence[Entry],
    provenance: str,
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

    Raises
    ------
    ProcedureError
        If the cell has no sensor or no tracker.
    DatasetError
        If no reading is usable.
    """
    tool, lever = _tool_load(cell), _lever_arm(cell)
    seen = marker_readings(poses, cell.robot, cell.gravity_base, lever)
    registration = register(seen, lever)
    rows = [row for pose in poses for row in load_rows(pose, registration, tool)]
    had = {row.load_case for row in rows if row.status is ReadingStatus.OK}
    if not had:
        raise DatasetError(f"no usable reading among {len(rows)}: {_reasons(rows, registration)}")
    dataset = make_dataset(
        rows,
        [case for case in plan.contact.load_cases if case in had],
        cell.robot,
        _tcp_positions(poses),
        {"marker": tuple(registration.lever_arm.tolist()), "provenance": provenance},
    )
    estimate = estimate_tool(tool_readings(poses, tool), tool.mass)
    findings = RunFindings(poses, rows, seen, registration, tool, estimate, dataset)
    cases = tuple(plan.contact.load_cases)
    return DerivedRun(
        dataset, summarise(findings, [pose.id for pose in plan.poses], cases, entries)
    )


def _latest(logs: Sequence[PoseLog]) -> list[PoseLog]:
    """Return one log a pose, the last one of each."""
    latest = {log.pose: log for log in logs}
    return [log for log in logs if latest[log.pose] is log]


def _streams(folder: RunFolder, log: PoseLog, cell: Cell) -> Streams:
    path = folder.streams / log.streams
    streams = read_streams(path, [(window.start, window.end) for window in log.windows])
    if streams.joint_names != cell.robot.joint_names:
        raise SchemaError(
            f"{path}: joints are {', '.join(streams.joint_names)}, those of the cell"
            f" {', '.join(cell.robot.joint_names)}"
        )
    return streams


def _tool_load(cell: Cell) -> ToolLoad:
    sensor, T_sensor_tcp = cell.file.sensor, cell.T_sensor_tcp
    if sensor is None or T_sensor_tcp is None:
        raise ProcedureError(f"cell {cell.name!r} has no force sensor (key 'sensor')")
    T_sensor_flange = inverse_transform(sensor.T_flange_sensor)
    centre = T_sensor_flange[:3, :3] @ cell.file.tool.centre + T_sensor_flange[:3, 3]
    mass = cell.file.tool.mass
    return ToolLoad(mass, centre, cell.gravity_base, inverse_transform(T_sensor_tcp))


def _lever_arm(cell: Cell) -> FloatArray:
    if cell.file.marker is None or not cell.file.trackers:
        raise ProcedureError(
            f"cell {cell.name!r} has no metrology (keys 'marker' and 'trackers'): without it there"
            " is no displacement to identify anything from"
        )
    return cell.file.marker.position_tcp


def _tcp_positions(poses: Sequence[PoseReadings]) -> dict[int, FloatArray]:
    states = {p.pose: p.reference.tool for p in poses if p.reference is not None}
    return {pose: np.array(tool.T_base_tcp[:3, 3]) for pose, tool in states.items() if tool}


def _reasons(rows: Sequence[LoadRow], registration: Registration) -> str:
    if registration.unregistered:
        name, reason = next(iter(registration.unregistered.items()))
        return f"station {name} is not registered: {reason}"
    return next((row.note for row in rows if row.note), "there is none")


def _provenance(folder: RunFolder, record: RunRecord) -> str:
    return f"elastocal run {folder.path.resolve().name}, {record.origin}"
