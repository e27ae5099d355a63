"""One reading of the dataset: displacements and force of a load against the unloaded reference.

Both displacements are those of the marker: the tracker's, turned into base, and the controller's,
of the point at the lever arm ``r`` that moves rigidly with its tool frame,

    marker_displacement     = R_base_tracker (p - p_0),
    controller_displacement = (p_tcp + R_tcp r) - (p_tcp,0 + R_tcp,0 r).

Their difference is the elastic deflection of the marker, which the marker's own Jacobian explains
(spec section 2). An error of ``R_base_tracker`` by an angle turns the marker's displacement by
it: 1 mrad makes 1 µm of each millimetre; the tracker's place does not enter at all.
"""

from dataclasses import dataclass

from elastocal.arrays import FloatArray
from elastocal.procedure.averaging import Mean, Reading, ToolState
from elastocal.procedure.pose_log import ReadingStatus
from elastocal.procedure.reduction import PoseReadings
from elastocal.procedure.registration import Registration
from elastocal.procedure.tool_weight import (
    RawWrench,
    RobotWrench,
    ToolLoad,
    turned_sigma,
    wrench_on_robot,
)


@dataclass(frozen=True, eq=False)
class LoadRow:
    """What the dataset says of one load case at one pose."""

    pose: int
    load_case: str
    status: ReadingStatus
    note: str
    """Why it is not ok."""
    numbers: "Numbers | None"
    """None where something that they need is missing."""


@dataclass(frozen=True, eq=False)
class Numbers:
    """The numbers of a reading, in base and SI units."""

    q: FloatArray
    """Shape (joint,)."""
    controller_displacement: FloatArray
    """Of the marker, shape (3,), in m."""
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
class _Pair:
    """A load and its reference, with nothing missing."""

    load: ToolState
    load_marker: Mean
    reference: ToolState
    reference_marker: Mean
    R_base_tracker: FloatArray


def _row(pose: PoseReadings, load: Reading, registration: Registration, tool: ToolLoad) -> LoadRow:
    window, case = load.window, str(load.window.load_case)
    pair = _pair(pose, load, registration)
    if isinstance(pair, _Pair):
        numbers = _numbers(pair, registration.lever_arm, tool)
        return LoadRow(pose.pose, case, window.status, window.note, numbers)
    if window.status is not ReadingStatus.OK:
        return LoadRow(pose.pose, case, window.status, window.note or pair, None)
    return LoadRow(pose.pose, case, ReadingStatus.MISSING, pair, None)


def _pair(pose: PoseReadings, load: Reading, registration: Registration) -> _Pair | str:
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
    return _Pair(means[0], means[1], means[2], means[3], fit.T_base_tracker[:3, :3])


def _numbers(pair: _Pair, lever: FloatArray, tool: ToolLoad) -> Numbers:
    load, reference, R = pair.load, pair.reference, pair.R_base_tracker
    T, T_0 = load.T_base_tcp, reference.T_base_tcp
    return Numbers(
        q=load.q,
        controller_displacement=T[:3, 3] - T_0[:3, 3] + (T[:3, :3] - T_0[:3, :3]) @ lever,
        marker_displacement=R @ (pair.load_marker.value - pair.reference_marker.value),
        marker_sigma=turned_sigma(R, pair.load_marker.sigma, pair.reference_marker.sigma),
        wrench=wrench_on_robot(_raw(load), _raw(reference), tool),
        force_sigma=turned_sigma(tool.R_base_sensor(T), load.force.sigma, reference.force.sigma),
    )


def _raw(state: ToolState) -> RawWrench:
    return RawWrench(state.force.value, state.moment.value, state.T_base_tcp)
