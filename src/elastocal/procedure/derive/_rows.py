"""From the readings of a run to the rows of its dataset: each load against its reference.

Displacements count from the reference of the pose, which is unloaded or in light contact; forces
count from the unloaded sensor in both cases.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import CONDITIONING, SensorLoad
from elastocal.procedure.derive.readings import Mean, PoseReadings, Reading, ToolState
from elastocal.procedure.derive.tool import turned_sigma, wrench_on_robot
from elastocal.procedure.record import ReadingStatus
from elastocal.procedure.registration import Registration
from elastocal.results import brief_repr


@brief_repr
@dataclass(frozen=True, eq=False)
class LoadValues:
    """The numbers of a reading, in base and SI units."""

    q: FloatArray
    """Shape (joint,)."""
    controller_displacement: FloatArray
    """Displacement of the marker by the controller, shape (3,), in m."""
    marker_displacement: FloatArray
    """Shape (3,), in m; NaN of a press that no station saw."""
    marker_sigma: FloatArray
    """Shape (3,), in m."""
    force: FloatArray
    """Force on the robot, shape (3,), in N."""
    moment: FloatArray
    """Moment on the robot about the tcp, shape (3,), in N·m."""
    force_sigma: FloatArray
    """Shape (3,), in N."""
    link: FloatArray | None = None
    """Positions of the links by secondary encoders, shape (joint,); None: there are none."""


@dataclass(frozen=True, eq=False)
class LoadRow:
    """One load case at one pose, as the dataset holds it."""

    pose: int
    load_case: str
    status: ReadingStatus
    note: str
    """Why it is not ok."""
    numbers: LoadValues | None
    """None where an input is missing."""


def load_rows(
    poses: Sequence[PoseReadings],
    registration: Registration,
    tool: SensorLoad,
    *,
    conditioned: bool,
    metrology: bool = True,
) -> list[LoadRow]:
    """Return every load of every pose as the dataset holds it.

    Parameters
    ----------
    poses : sequence of PoseReadings
        In the order of time.
    registration : Registration
        Stations and marker.
    tool : SensorLoad
        The tool on its sensor.
    conditioned : bool
        Whether a full press went before the reference. The dataset says so of all its poses: the
        loads of a pose at which nothing is known of that press are missing.
    metrology : bool
        Whether there was any; without it no reading has a marker displacement, and none lacks it.
    """
    unknown = {pose.pose for pose in poses if conditioned and pose.conditioning is None}
    why = f"nothing is known of the press before the reference ({CONDITIONING})"
    return [
        LoadRow(pose.pose, str(load.window.load_case), ReadingStatus.MISSING, why, None)
        if pose.pose in unknown
        else _row(pose, load, registration if metrology else None, tool, registration.lever_arm)
        for pose in poses
        for load in pose.loads
    ]


@dataclass(frozen=True, eq=False)
class _LoadAndReference:
    """A load and its reference, with nothing missing."""

    load: ToolState
    load_marker: Mean
    reference: ToolState
    reference_marker: Mean
    tare: ToolState
    """The tool without load, which the force counts from."""
    R_base_tracker: FloatArray


def _row(
    pose: PoseReadings,
    load: Reading,
    registration: Registration | None,
    tool: SensorLoad,
    lever: FloatArray,
) -> LoadRow:
    """Return a load as the dataset holds it; without reference, station or stream it is missing."""
    window, case = load.window, str(load.window.load_case)
    pair = _pair(pose, load, registration)
    if isinstance(pair, _LoadAndReference):
        numbers = _numbers(pair, lever, tool)
        return LoadRow(pose.pose, case, window.status, window.note, numbers)
    if window.status is ReadingStatus.OK:
        return LoadRow(pose.pose, case, ReadingStatus.MISSING, pair, None)
    pressed = _press(pose, load, lever, tool)
    return LoadRow(pose.pose, case, window.status, window.note or pair, pressed)


def _press(
    pose: PoseReadings, load: Reading, lever: FloatArray, tool: SensorLoad
) -> LoadValues | None:
    """Return the load of a press that gave no reading, if it is known: friction remembers it."""
    pair = _unseen(pose, load)
    return None if pair is None else _numbers(pair, lever, tool)


def _unseen(pose: PoseReadings, load: Reading) -> _LoadAndReference | None:
    """Return load and reference of an unseen marker; None where they are unknown."""
    reference = None if pose.zero is None else pose.zero.tool
    tare = None if pose.reference is None else pose.reference.tool
    if load.tool is None or reference is None or tare is None:
        return None
    nan = np.full(3, np.nan)
    unseen = Mean(nan, nan, nan, 0, np.nan)
    return _LoadAndReference(load.tool, unseen, reference, unseen, tare, np.eye(3))


def _pair(
    pose: PoseReadings, load: Reading, registration: Registration | None
) -> _LoadAndReference | str:
    """Return load and reference, or why a reading has no numbers."""
    reference, unloaded, station = pose.zero, pose.reference, load.window.station
    if reference is None or unloaded is None:
        return "there is no unloaded reference"
    for name, each in (("unloaded", unloaded), ("light contact", reference)):
        if each.window.status is not ReadingStatus.OK:
            return f"the {name} reference is {each.window.status.value}: {each.window.note}"
    if registration is None:
        return _unseen(pose, load) or load.window.note or "a stream says too little"
    if not station:
        return "no tracker station measured"
    if station != reference.window.station:
        return f"station {station} measured it, {reference.window.station} its unloaded reference"
    fit = registration.station_of(station, pose.pose)
    if fit is None:
        return f"station {station} is not registered: {registration.unregistered.get(station, '')}"
    R, tare = fit.T_base_tracker[:3, :3], unloaded.tool
    if load.tool is None or load.marker is None or tare is None:
        return load.window.note or "a stream says too little"
    if reference.tool is None or reference.marker is None:
        return load.window.note or "a stream says too little"
    return _LoadAndReference(load.tool, load.marker, reference.tool, reference.marker, tare, R)


def _numbers(pair: _LoadAndReference, lever: FloatArray, tool: SensorLoad) -> LoadValues:
    load, reference, R = pair.load, pair.reference, pair.R_base_tracker
    T, T_0 = load.T_base_tcp, reference.T_base_tcp
    wrench = wrench_on_robot(load.wrench, pair.tare.wrench, tool)
    return LoadValues(
        q=load.q,
        controller_displacement=T[:3, 3] - T_0[:3, 3] + (T[:3, :3] - T_0[:3, :3]) @ lever,
        marker_displacement=R @ (pair.load_marker.value - pair.reference_marker.value),
        marker_sigma=turned_sigma(R, pair.load_marker.sigma, pair.reference_marker.sigma),
        force=wrench.force,
        moment=wrench.moment,
        force_sigma=turned_sigma(tool.R_base_sensor(T), load.force.sigma, pair.tare.force.sigma),
        link=load.link,
    )


def seen_markers(
    poses: Sequence[PoseReadings], labels: Sequence[int], registration: Registration
) -> FloatArray:
    """Return where the tracker saw the marker at the zero of each pose, given by its label.

    Returns
    -------
    ndarray, shape (pose, 3)
        In base, in m; NaN where no registered station saw it.
    """
    seen = np.full((len(labels), 3), np.nan)
    for pose in poses:
        zero = pose.zero
        if zero is None or zero.marker is None or zero.window.station is None:
            continue
        fit = registration.station_of(zero.window.station, pose.pose)
        if fit is not None and pose.pose in labels:
            T = fit.T_base_tracker
            seen[labels.index(pose.pose)] = T[:3, :3] @ zero.marker.value + T[:3, 3]
    return seen


class UnloadedReferences(NamedTuple):
    """References of the displacements of each pose; NaN where unknown."""

    q: FloatArray
    """Joints there, shape (pose, joint), in rad or m."""
    force: FloatArray
    """Force on the robot there, in base, shape (pose, 3), in N; 0 where it is not known."""
    tcp: FloatArray
    """Tcp without load, in base, shape (pose, 3), in m."""
    link: FloatArray
    """Links there by secondary encoders, shape (pose, joint), in rad or m."""


def unloaded_references(
    poses: Sequence[PoseReadings], labels: Sequence[int], sensor: SensorLoad
) -> UnloadedReferences:
    """Return the references of the displacements of poses, given by their labels."""
    found = {
        pose.pose: (pose.zero.tool, pose.reference.tool)
        for pose in poses
        if pose.doubles is None
        and pose.zero
        and pose.zero.tool
        and pose.reference
        and pose.reference.tool
    }
    joints = max((len(zero.q) for zero, _ in found.values()), default=0)
    q, force, tcp, link = (
        np.full((len(labels), width), np.nan) for width in (joints, 3, 3, joints)
    )
    force[:] = 0.0
    for pose, (zero, tare) in found.items():
        index = labels.index(pose)
        q[index], tcp[index] = zero.q, tare.T_base_tcp[:3, 3]
        force[index] = wrench_on_robot(zero.wrench, tare.wrench, sensor).force
        if zero.link is not None:
            link[index] = zero.link
    return UnloadedReferences(q, force, tcp, link)
