"""Touches of the tooling: where the tool stood at points of it, cold and warm, and what was seen.

The same points are touched twice, cold and warm, on commanded joints that hardly differ. Off the
surface, before the contact and after it, with the marker at ``p`` in the tracker's frame and the
controller's tool frame at ``(x, R)``, the tool has moved against what its controller believes by

    d = R_base_tracker (p_warm - p_cold) - [(x + R r)_warm - (x + R r)_cold],

``r`` the marker in the tool frame; the mean of both readings counts. In contact the disk would hold
the tool aside. The tracker stands where it stood, and is registered by the cold run alone: a
registration of its own would take a part of the growth up. The tooling itself is a second witness,
along its normal ``n``: where it stands still, in contact ``n . d = -n . (x_warm - x_cold)``.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import Cell
from elastocal.errors import ProcedureError
from elastocal.planning import PlanResult
from elastocal.procedure.derive.derivation import CommittedRun, marker_in_tcp, read_run
from elastocal.procedure.derive.readings import (
    Mean,
    PoseReadings,
    Reading,
    ToolState,
    marker_readings,
)
from elastocal.procedure.record import Event, ReadingStatus, RunRecord
from elastocal.procedure.registration import Registration, register
from elastocal.results import brief_repr
from elastocal.robot import Robot


@brief_repr
@dataclass(frozen=True, eq=False)
class TouchedShifts:
    """Displacements of the tool against its controller, cold to warm, at points of the tooling."""

    cell: Cell
    plan: PlanResult
    pose: IndexArray
    """Ids in the plan, shape (touch,)."""
    q: FloatArray
    """Joints of the warm touch, shape (touch, joint), in rad or m."""
    shift: FloatArray
    """By the tracker, in base, shape (touch, 3), in m."""
    normal: FloatArray
    """Outward unit normals of the surface, in base, shape (touch, 3)."""
    by_contact: FloatArray
    """The shift along the normal as the tooling shows it, shape (touch,), in m."""
    cold: RunRecord
    warm: RunRecord
    seconds: float
    """Duration of the warm touches, from the first entry of the journal to the last."""
    lost: tuple[int, ...]
    """Poses of the plan that were not touched in both runs."""
    sessions: IndexArray
    """Sessions of the cold and of the warm run in which a point was touched, from 0, shape
    (touch, 2)."""
    pause: float
    """Longest pause of a run that was gone on with, in s; 0: none was, or none is known."""


def read_touches(cold: Path, warm: Path) -> TouchedShifts:
    """Return how far the tool moved between two runs of touches.

    Parameters
    ----------
    cold, warm : Path
        Folders of the runs (`elastocal run --touch`), of one plan.

    Raises
    ------
    ProcedureError
        If a run is none of touches, the two are not of one plan and robot, no pose was touched in
        both, the tracker of the cold run cannot be registered, or one moved during a run.
    SchemaError, FileAccessError
        If a file of a run is damaged or cannot be read.
    """
    before, after = _touched(cold, "cold"), _touched(warm, "warm")
    if before.record.plan != after.record.plan:
        raise ProcedureError(f"{warm} and {cold} are of two plans: touch the same points warm")
    registration = _registered_cold(before)
    _registered(after)
    rows = []
    first = {pose.pose: pose for pose in before.poses}
    for pose in after.poses:
        old = first.get(pose.pose)
        fit = None if old is None else registration.station_of(_station(old), pose.pose)
        if old is not None and fit is not None and _station(old) == _station(pose):
            pair = _pair(old, pose, fit.T_base_tracker[:3, :3], registration.lever_arm)
            rows += [] if pair is None else [(pose.pose, *pair)]
    if not rows:
        raise ProcedureError(f"{warm}: no pose was touched in both runs")
    sessions = [_sessions(run) for run in (before, after)]
    touched, q, shift, moved = (np.array(column) for column in zip(*rows, strict=True))
    normal = np.array([before.plan.poses[number].normal for number in touched.tolist()])
    return TouchedShifts(
        before.cell,
        before.plan,
        touched,
        q,
        shift,
        normal,
        -np.einsum("ti,ti->t", normal, moved),
        before.record,
        after.record,
        after.entries[-1].time - after.entries[0].time,
        tuple(each.id for each in before.plan.poses if each.id not in touched),
        np.array([[of_pose[pose] for of_pose in sessions] for pose in touched.tolist()]),
        max(_longest_pause(run) for run in (before, after)),
    )


def _sessions(run: CommittedRun) -> dict[int, int]:
    """Return the number of the session in which each pose was committed, from 0."""
    found, number = {}, 0
    for entry in run.entries:
        number += entry.event is Event.RESUME
        if entry.event is Event.COMMIT and entry.pose is not None:
            found[entry.pose] = number
    return found


def _longest_pause(run: CommittedRun) -> float:
    """Return the longest time between two sessions of a run, in s of the wall; 0: not known."""
    longest, began, first = 0.0, run.record.started, run.entries[0].time
    for before, entry in itertools.pairwise(run.entries):
        if entry.event is Event.RESUME:
            # Older journals do not say when.
            if began and entry.text:
                apart = datetime.fromisoformat(entry.text) - datetime.fromisoformat(began)
                longest = max(longest, apart.total_seconds() - (before.time - first))
            began, first = entry.text, entry.time
    return longest


@brief_repr
@dataclass(frozen=True, eq=False)
class TaughtMarkers:
    """How a tracker stands, and marker less controller off the surface at points touched cold."""

    robot: Robot
    place: FloatArray
    """Tool centre points by the controller, in light contact, shape (point, 3), in m."""
    offset: FloatArray
    """Mean of all readings of a point, in base, shape (point, 3), in m."""
    T_base_tracker: FloatArray
    """Of the first run, shape (4, 4)."""
    station: str
    lever: FloatArray
    """Marker in the tcp frame, shape (3,), in m."""


def read_taught_markers(folders: Sequence[Path]) -> TaughtMarkers:
    """Return where marker and controller were by runs of one station, by the first registration.

    Parameters
    ----------
    folders : sequence of Path
        Folders of runs with the tracker where it stands now. Cold touches teach their points;
        another run says how the tracker stands.

    Raises
    ------
    ProcedureError
        If they are of several robots or stations, the tracker of the first cannot be registered, or
        it moved.
    SchemaError, FileAccessError
        If a file of a run is damaged or cannot be read.
    """
    runs = [read_run(folder) for folder in folders]
    first, registration = runs[0], _registered_cold(runs[0])
    names = sorted(each.station for each in registration.stations)
    if len(names) != 1:
        raise ProcedureError(
            f"{first.folder.path}: measured by {' and '.join(names)}: where courses begin one"
            " station measures"
        )
    rows: dict[tuple[str, int], list[tuple[FloatArray, FloatArray]]] = {}
    for run in runs:
        _registered(run)
        if run.record.touch == "cold":
            for pose in run.poses:
                fit = registration.station_of(_station(pose), pose.pose)
                found = [] if fit is None else _markers_off(pose, fit.T_base_tracker, registration)
                rows.setdefault((run.record.plan, pose.pose), []).extend(found)
    # A point's readings count as one place, however many there are.
    means = [np.mean(each, axis=0) for each in rows.values() if each]
    place, offset = np.reshape(means, (-1, 2, 3)).transpose(1, 0, 2)
    return TaughtMarkers(
        *(first.cell.robot, place, offset, registration.stations[0].T_base_tracker),
        *(names[0], registration.lever_arm),
    )


def _markers_off(
    pose: PoseReadings, T_base_tracker: FloatArray, registration: Registration
) -> list[tuple[FloatArray, FloatArray]]:
    """Return where a point was touched, and marker less controller off it, for each reading."""
    light = _usable(pose.light)
    if light is None:
        return []
    read = [found for each in (pose.reference, pose.released) if (found := _usable(each))]
    seen = [T_base_tracker[:3, :3] @ marker.value + T_base_tracker[:3, 3] for _, marker in read]
    return [
        (light[0].T_base_tcp[:3, 3], point - _at(tool.T_base_tcp, registration.lever_arm))
        for (tool, _), point in zip(read, seen, strict=True)
    ]


def require_cold_touches(cold: Path) -> None:
    """Refuse a run with which no warm touches can be compared, before an arm moves for them.

    Raises
    ------
    ProcedureError, SchemaError, FileAccessError
        As `read_touches`.
    """
    _registered_cold(_touched(cold, "cold"))


def _registered_cold(run: CommittedRun) -> Registration:
    """Return the registration of the cold run, by which both runs are turned into base."""
    found = _registered(run)
    if not found.stations:
        why = "; ".join(f"{name} {text}" for name, text in found.unregistered.items())
        raise ProcedureError(f"{run.folder.path}: no tracker can be registered: {why}")
    return found


def _registered(run: CommittedRun) -> Registration:
    """Return the registration of a run's trackers, none of which moved during it.

    A pose that was touched before the move would be compared with one after it: the way of the
    stand would be taken for the arm's.
    """
    lever = marker_in_tcp(run.cell)
    seen = marker_readings(run.poses, run.cell.robot, run.cell.gravity_base, lever)
    found = register(seen, lever)
    for move in found.moves:
        raise ProcedureError(
            f"{run.folder.path}: station {move.station} moved by {1e3 * move.distance:.2f} mm"
            f" between poses {move.before} and {move.pose}: fix its stand, touch cold and"
            " warm again"
        )
    return found


def _touched(folder: Path, warmth: str) -> CommittedRun:
    found = read_run(folder)
    if found.record.touch != warmth:
        said = found.record.touch or "a run of load cases"
        raise ProcedureError(
            f"{folder} is {said}: the {warmth} touches are wanted, of"
            f" `elastocal run CELL --plan DIR --touch {warmth}`"
        )
    return found


def _station(pose: PoseReadings) -> str:
    zero = pose.zero
    return "" if zero is None else str(zero.window.station)


def _pair(
    cold: PoseReadings, warm: PoseReadings, R_base_tracker: FloatArray, lever: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return joints, shift by the tracker and way of the controller; None: a reading is lost."""
    light = [_usable(each.light) for each in (cold, warm)]
    off = [
        [found for each in (pose.reference, pose.released) if (found := _usable(each)) is not None]
        for pose in (cold, warm)
    ]
    if light[0] is None or light[1] is None or not (off[0] and off[1]):
        return None
    seen, commanded = (
        [np.mean([place(each) for each in readings], axis=0) for readings in off]
        for place in (lambda each: each[1].value, lambda each: _at(each[0].T_base_tcp, lever))
    )
    shift = R_base_tracker @ (seen[1] - seen[0]) - (commanded[1] - commanded[0])
    places = [each[0].T_base_tcp[:3, 3] for each in light if each is not None]
    return light[1][0].q, shift, places[1] - places[0]


def _usable(reading: Reading | None) -> tuple[ToolState, Mean] | None:
    """Return tool and marker of a reading; None where one of them is not known."""
    if reading is None or reading.window.status is not ReadingStatus.OK:
        return None
    if reading.tool is None or reading.marker is None:
        return None
    return reading.tool, reading.marker


def _at(T_base_tcp: FloatArray, lever: FloatArray) -> FloatArray:
    """Return the marker's position by the controller, in base, shape (3,), in m."""
    place: FloatArray = T_base_tcp[:3, 3] + T_base_tcp[:3, :3] @ lever
    return place
