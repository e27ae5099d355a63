"""The dataset: displacements and force of every load against the unloaded reference of its pose.

Both displacements are those of the marker: the tracker's, turned into base, and the controller's,
of the point at the lever arm ``r`` that moves rigidly with its tool frame,

    marker_displacement     = R_base_tracker (p - p_0),
    controller_displacement = (p_tcp + R_tcp r) - (p_tcp,0 + R_tcp,0 r).

Their difference is the elastic deflection of the marker, which the marker's own Jacobian explains
(spec section 2). An error of ``R_base_tracker`` by an angle turns the marker's displacement by
it: 1 mrad makes 1 µm of each millimetre; the tracker's place does not enter at all.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.dataset import STATUSES, Dataset
from elastocal.procedure.derive.readings import Mean, PoseReadings, Reading, ToolState
from elastocal.procedure.derive.tool import (
    RawWrench,
    RobotWrench,
    ToolLoad,
    turned_sigma,
    wrench_on_robot,
)
from elastocal.procedure.record import ReadingStatus
from elastocal.procedure.registration import Registration
from elastocal.results import brief_repr
from elastocal.robot import Robot


@dataclass(frozen=True, eq=False)
class LoadRow:
    """One load case at one pose, as the dataset holds it."""

    pose: int
    load_case: str
    status: ReadingStatus
    note: str
    """Why it is not ok."""
    numbers: "LoadValues | None"
    """None where something that they need is missing."""


@brief_repr
@dataclass(frozen=True, eq=False)
class LoadValues:
    """The numbers of a reading, in base and SI units."""

    q: FloatArray
    """Shape (joint,)."""
    controller_displacement: FloatArray
    """Displacement of the marker by the controller, shape (3,), in m."""
    marker_displacement: FloatArray
    """Shape (3,), in m."""
    marker_sigma: FloatArray
    """Shape (3,), in m."""
    wrench: RobotWrench
    force_sigma: FloatArray
    """Shape (3,), in N."""


def load_rows(
    pose: PoseReadings, registration: Registration, tool: ToolLoad
) -> tuple[LoadRow, ...]:
    """Return the rows of a pose.

    Parameters
    ----------
    pose : PoseReadings
        Its readings.
    registration : Registration
        Where the stations stand and the marker sits.
    tool : ToolLoad
        Weight of the tool and place of the sensor.

    Returns
    -------
    tuple of LoadRow
        A reading without a usable reference, station or stream is ``missing``, and says why.
    """
    return tuple(_row(pose, load, registration, tool) for load in pose.loads)


@dataclass(frozen=True, eq=False)
class _LoadAndReference:
    """A load and its reference, with nothing missing."""

    load: ToolState
    load_marker: Mean
    reference: ToolState
    reference_marker: Mean
    R_base_tracker: FloatArray


def _row(pose: PoseReadings, load: Reading, registration: Registration, tool: ToolLoad) -> LoadRow:
    window, case = load.window, str(load.window.load_case)
    pair = _pair(pose, load, registration)
    if isinstance(pair, _LoadAndReference):
        numbers = _numbers(pair, registration.lever_arm, tool)
        return LoadRow(pose.pose, case, window.status, window.note, numbers)
    if window.status is not ReadingStatus.OK:
        return LoadRow(pose.pose, case, window.status, window.note or pair, None)
    return LoadRow(pose.pose, case, ReadingStatus.MISSING, pair, None)


def _pair(pose: PoseReadings, load: Reading, registration: Registration) -> _LoadAndReference | str:
    """Return load and reference, or why a reading has no numbers."""
    reference, station = pose.reference, load.window.station
    if reference is None:
        return "there is no unloaded reference"
    if reference.window.status is not ReadingStatus.OK:
        return f"the unloaded reference is {reference.window.status.value}: {reference.window.note}"
    if not station:
        return "no tracker station measured"
    if station != reference.window.station:
        return f"station {station} measured it, {reference.window.station} its unloaded reference"
    fit = registration.station_of(station, pose.pose)
    if fit is None:
        return f"station {station} is not registered: {registration.unregistered.get(station, '')}"
    means = (load.tool, load.marker, reference.tool, reference.marker)
    if means[0] is None or means[1] is None or means[2] is None or means[3] is None:
        return load.window.note or "a stream says too little"
    return _LoadAndReference(means[0], means[1], means[2], means[3], fit.T_base_tracker[:3, :3])


def _numbers(pair: _LoadAndReference, lever: FloatArray, tool: ToolLoad) -> LoadValues:
    load, reference, R = pair.load, pair.reference, pair.R_base_tracker
    T, T_0 = load.T_base_tcp, reference.T_base_tcp
    return LoadValues(
        q=load.q,
        controller_displacement=T[:3, 3] - T_0[:3, 3] + (T[:3, :3] - T_0[:3, :3]) @ lever,
        marker_displacement=R @ (pair.load_marker.value - pair.reference_marker.value),
        marker_sigma=turned_sigma(R, pair.load_marker.sigma, pair.reference_marker.sigma),
        wrench=wrench_on_robot(_raw(load), _raw(reference), tool),
        force_sigma=turned_sigma(tool.R_base_sensor(T), load.force.sigma, reference.force.sigma),
    )


def _raw(state: ToolState) -> RawWrench:
    return RawWrench(state.force.value, state.moment.value, state.T_base_tcp)


_VECTORS = ("force", "controller_displacement", "marker_displacement")
_SIGMAS = ("force_sigma", "marker_sigma")


def make_dataset(
    rows: Sequence[LoadRow],
    load_cases: Sequence[str],
    robot: Robot,
    tcp_position: Mapping[int, FloatArray],
    attributes: Mapping[str, Any],
) -> Dataset:
    """Return the dataset of a run.

    The moment is left out: the paper's row takes the force alone, and a moment that is moved from
    the sensor to the tcp carries the sensor's place and cross-talk with the arm of the tool.

    Parameters
    ----------
    rows : sequence of LoadRow
        Of all poses, in order.
    load_cases : sequence of str
        Those to keep.
    robot : Robot
        The arm with its tool.
    tcp_position : mapping of int to ndarray, shape (3,)
        Unloaded place of the tcp at each pose, in base, in m.
    attributes : mapping
        Other keywords of `Dataset.from_arrays`.

    Raises
    ------
    DatasetError
        If there is no usable reading.
    """
    poses = tuple(dict.fromkeys(row.pose for row in rows))
    shape = (len(poses), len(load_cases))
    arrays: dict[str, Any] = {name: np.full((*shape, 3), np.nan) for name in (*_VECTORS, *_SIGMAS)}
    arrays["joint_position"] = np.full((*shape, len(robot.joint_names)), np.nan)
    status = np.full(shape, STATUSES.index(ReadingStatus.MISSING.value))
    for row in rows:
        if row.load_case not in load_cases:
            continue
        place = poses.index(row.pose), list(load_cases).index(row.load_case)
        status[place] = STATUSES.index(row.status.value)
        for name, values in _values(row.numbers).items():
            arrays[name][place] = values
    ok = status == STATUSES.index(ReadingStatus.OK.value)
    sigmas = {name: arrays.pop(name) for name in _SIGMAS}
    known: dict[str, Any] = {name: sigma for name, sigma in sigmas.items() if np.all(sigma[ok] > 0)}
    unknown = np.full(3, np.nan)
    return Dataset.from_arrays(
        **arrays,
        **known,
        joint_names=robot.joint_names,
        joint_units=["rad" if revolute else "m" for revolute in robot.revolute],
        load_cases=load_cases,
        poses=poses,
        status=status,
        tcp_position=np.array([tcp_position.get(pose, unknown) for pose in poses]),
        robot_name=robot.name,
        robot_urdf=robot.urdf,
        tcp_frame=robot.tip,
        **attributes,
    )


def _values(numbers: LoadValues | None) -> dict[str, FloatArray]:
    if numbers is None:
        return {}
    return {
        "joint_position": numbers.q,
        "force": numbers.wrench.force,
        "controller_displacement": numbers.controller_displacement,
        "marker_displacement": numbers.marker_displacement,
        "force_sigma": numbers.force_sigma,
        "marker_sigma": numbers.marker_sigma,
    }
