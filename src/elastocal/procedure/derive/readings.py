"""From windows of the raw streams to readings: mean, scatter and number of samples.

The standard deviation of a mean of ``n`` samples ``x`` with lag-1 autocorrelation ``r`` is that of
a first-order autoregressive process (Bayley and Hammersley 1946),

    sigma_mean = s sqrt(1 / n) sqrt((1 + r) / (1 - r)),

with ``r`` at least 0; a sensor's own filter correlates its samples.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.cell import CONDITIONING, LIGHT_CONTACT, SensorLoad
from elastocal.procedure.derive.tool import RawWrench, UnloadedWrenches
from elastocal.procedure.record import SAME_TIME, PoseLog, ReadingStatus, Streams, Window
from elastocal.procedure.registration import UnloadedReadings
from elastocal.results import brief_repr
from elastocal.robot import (
    ChainJoint,
    InsertedJoint,
    Robot,
    build_model,
    evaluate_jacobian,
    nearest_rotation,
)

LEAST_SAMPLES = 5
"""Fewer good samples than this make no reading: their scatter says nothing."""
_LAST = 1.0
"""A press that gave no window is known by what the arm felt in the last s before it was given up:
the force was on, though it shook or the marker was not seen."""
_MOST_CORRELATED = 0.99
"""Largest lag-1 autocorrelation that is believed; beyond it the samples drift."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Mean:
    """Mean of some samples."""

    value: FloatArray
    """Shape (component,)."""
    deviation: FloatArray
    """Standard deviation of one sample, shape (component,)."""
    sigma: FloatArray
    """Standard deviation of the mean, shape (component,); at least what the maker states for
    that many samples. 0 only where neither says anything."""
    count: int
    """Samples."""
    time: float
    """Mean time, in s of the clock."""


@brief_repr
@dataclass(frozen=True, eq=False)
class ToolState:
    """Pose of the tool by the controller, and the raw wrench on the sensor."""

    q: FloatArray
    """Joint positions, shape (joint,), in rad or m."""
    T_base_tcp: FloatArray
    """Tool frame, shape (4, 4), in m."""
    force: Mean
    """Raw, sensor frame, in N."""
    moment: Mean
    """Raw, sensor frame, in N·m."""
    link: FloatArray | None = None
    """Mean positions of the links by secondary encoders, shape (joint,), in rad or m; NaN at a
    joint without one. None: there are none."""

    @property
    def wrench(self) -> RawWrench:
        """Mean raw wrench."""
        return RawWrench(self.force.value, self.moment.value, self.T_base_tcp)


@dataclass(frozen=True, eq=False)
class Reading:
    """Means of every stream over one window."""

    window: Window
    """Its status is ``missing``, with a note, where a stream has too few good samples."""
    tool: ToolState | None
    """None where arm or sensor gave too few samples."""
    marker: Mean | None
    """In the frame of the window's station, in m; None where the station gave too few."""


def average(streams: Streams, window: Window, least: int = LEAST_SAMPLES) -> Reading:
    """Return the means of every stream over a window, its ends included.

    Parameters
    ----------
    streams : Streams
        Streams of the window's pose.
    window : Window
        When, and which station measured.
    least : int
        Samples that a mean needs; 1 where samples are means already.

    Returns
    -------
    Reading
        A stream with fewer good samples than ``least`` has no mean, and an ok window is then
        ``missing``. Samples that are not finite, that the sensor calls bad, or that another
        station took are not good. One state of the arm is enough: it has no noise.
    """
    arm, wrench, points = streams.arm, streams.wrench, streams.points
    at_arm = _inside(arm.time, window)
    at_wrench = _inside(wrench.time, window) & wrench.ok & _finite(wrench.force, wrench.moment)
    at_point = _inside(points.time, window) & _finite(points.position)
    at_point &= points.station == (window.station or "")
    stated = wrench.force_sigma[at_wrench, None]
    force = _mean(wrench.time[at_wrench], wrench.force[at_wrench], least, stated)
    moment = _mean(wrench.time[at_wrench], wrench.moment[at_wrench], least)
    tool = None
    if at_arm.any() and force is not None and moment is not None:
        q, T = arm.q[at_arm].mean(axis=0), _mean_pose(arm.T_base_tcp[at_arm])
        link = None if arm.link is None else arm.link[at_arm].mean(axis=0)
        tool = ToolState(q, T, force, moment, link)
    counts = {
        "states of the arm": (int(at_arm.sum()), 1),
        "wrenches": (int(at_wrench.sum()), least),
    }
    if window.station:
        counts[f"points of station {window.station}"] = (int(at_point.sum()), least)
    seen = points.time[at_point], points.position[at_point]
    marker = _mean(*seen, least, points.sigma[at_point])
    return Reading(_judged(window, counts), tool, marker)


def _judged(window: Window, counts: dict[str, tuple[int, int]]) -> Window:
    """Return the window, missing where a stream has too few samples."""
    few = [
        f"{count} {what}, not {least}" for what, (count, least) in counts.items() if count < least
    ]
    if not few or window.status is not ReadingStatus.OK:
        return window
    note = "; ".join(([window.note] if window.note else []) + [f"only {text}" for text in few])
    return window.model_copy(update={"status": ReadingStatus.MISSING, "note": note})


def _inside(time: FloatArray, window: Window) -> BoolArray:
    return (time >= window.start - SAME_TIME) & (time <= window.end + SAME_TIME)


def _finite(*arrays: FloatArray) -> BoolArray:
    return np.asarray(np.isfinite(np.hstack(arrays)).all(axis=1), dtype=bool)


def _mean(
    time: FloatArray, samples: FloatArray, least: int, stated: FloatArray | None = None
) -> Mean | None:
    count = len(samples)
    if count < least:
        return None
    value = samples.mean(axis=0)
    # One sample has no scatter of its own: what the maker states is all that is known.
    deviation = samples.std(axis=0, ddof=1) if count > 1 else np.zeros_like(value)
    sigma = deviation * np.sqrt(_inflation(samples - value) / count)
    if stated is not None and np.all(np.isfinite(stated)):
        sigma = np.maximum(sigma, np.sqrt((stated**2).mean(axis=0) / count))
    return Mean(value, deviation, sigma, count, float(time.mean()))


def _inflation(centred: FloatArray) -> FloatArray:
    """Return by how much correlation widens the variance of a mean, shape (component,)."""
    power = (centred**2).sum(axis=0)
    lagged = (centred[1:] * centred[:-1]).sum(axis=0)
    r = np.divide(lagged, power, out=np.zeros_like(power), where=power > 0)
    r = np.clip(r, 0.0, _MOST_CORRELATED)
    inflation: FloatArray = (1.0 + r) / (1.0 - r)
    return inflation


def _mean_pose(T: FloatArray) -> FloatArray:
    """Return the mean of poses that hardly differ: mean position, nearest rotation."""
    mean: FloatArray = T.mean(axis=0)
    mean[:3, :3] = nearest_rotation(mean[:3, :3])
    return mean


@brief_repr
@dataclass(frozen=True, eq=False)
class PoseReadings:
    """Readings of a committed pose."""

    log: PoseLog
    reference: Reading | None
    """The first unloaded window; None if there is none."""
    loads: tuple[Reading, ...]
    """One a load case, in the order in which they were applied."""
    released: Reading | None
    """A later unloaded window, after the loads; None if there is none."""
    light: Reading | None = None
    """The reference in light contact; None: the reference is the unloaded one."""
    doubles: int | None = None
    """Pose whose place was pressed on two disks; None: it is one by itself."""

    @property
    def pose(self) -> int:
        """Pose of the dataset: the id in the plan, or the pose that it doubles."""
        return self.log.pose if self.doubles is None else self.doubles

    @property
    def zero(self) -> Reading | None:
        """The reading that both displacements count from; the force counts from `reference`."""
        return self.reference if self.light is None else self.light

    @property
    def conditioning(self) -> ToolState | None:
        """The press before the reference; None where there was none, or nothing is known of it."""
        found = [r.tool for r in self.loads if r.window.load_case == CONDITIONING]
        return found[0] if found else None


def felt_windows(log: PoseLog) -> tuple[Window, ...]:
    """Return the windows of a pose; of a press that gave none, the end of its time at that force.

    Parameters
    ----------
    log : PoseLog
        Its windows; that of a load case that was given up has no length.
    """
    before = (-np.inf, *(window.end for window in log.windows[:-1]))
    return tuple(
        window.model_copy(update={"start": max(end, window.end - _LAST)})
        if window.start == window.end and window.load_case is not None
        else window
        for window, end in zip(log.windows, before, strict=False)
    )


def reduce_pose(log: PoseLog, streams: Streams) -> PoseReadings:
    """Return the readings of a pose.

    Parameters
    ----------
    log : PoseLog
        Its windows.
    streams : Streams
        Its raw streams.
    """
    felt = zip(log.windows, felt_windows(log), strict=True)
    readings = [
        average(streams, own) if own is window else replace(average(streams, own), window=window)
        for window, own in felt
    ]
    unloaded = [reading for reading in readings if reading.window.load_case is None]
    light = [reading for reading in readings if reading.window.load_case == LIGHT_CONTACT]
    return PoseReadings(
        log,
        unloaded[0] if unloaded else None,
        tuple(r for r in readings if r.window.load_case not in (None, LIGHT_CONTACT)),
        unloaded[-1] if len(unloaded) > 1 else None,
        light[0] if light else None,
    )


def places_in_time(
    poses: Sequence[PoseReadings], labels: Sequence[int], load_cases: Sequence[str]
) -> IndexArray:
    """Return the place in time of each load among those of its pose; -1 where it was not tried."""
    sequence = np.full((len(labels), len(load_cases)), -1)
    for pose in poses:
        if pose.pose not in labels:
            continue
        row = sequence[labels.index(pose.pose)]
        # A place that is visited again goes on counting.
        first = 0 if pose.doubles is None else len(load_cases)
        for place, load in enumerate(pose.loads, start=first):
            row[np.array(load_cases) == load.window.load_case] = place
    return sequence


JOINT_ERROR = 0.5e-3
"""Likely offset of a joint's zero, in rad (m for a rail): it makes the 1 mm or so by which an
arm of 2.5 m that is not calibrated misses its target (ISO 9283 pose accuracy)."""
AXIS_SHIFT = 0.5e-3
"""Likely error of the place of a joint's axis along each direction, in m: links and offsets (a KR
210 was off by 1.2 mm in the mean before its calibration, doi 10.1177/1729881420921644)."""
AXIS_TILT = 0.3e-3
"""Likely tilt of a joint's axis about each direction across it, in rad: 0.3 mm on 1 m."""
SAG = 1e-3
"""Likely turn of a joint under the largest gravity torque of the run, in rad (m)."""


def marker_readings(
    poses: Sequence[PoseReadings], robot: Robot, gravity: FloatArray, lever: FloatArray
) -> UnloadedReadings:
    """Return the unloaded readings in which a station saw the marker.

    Parameters
    ----------
    poses : sequence of PoseReadings
        In the order of time.
    robot : Robot
        Whose errors the residuals may show.
    gravity : ndarray, shape (3,)
        In base, in m/s².
    lever : ndarray, shape (3,)
        Roughly the marker in the tcp frame, in m.
    """
    seen = [
        (pose.pose, str(r.window.station), r.tool, r.marker)
        for pose in poses
        if (r := pose.reference) and r.window.status is ReadingStatus.OK and r.tool and r.marker
    ]
    q = np.array([tool.q for *_, tool, _ in seen]).reshape(len(seen), len(robot.joint_names))
    return UnloadedReadings(
        pose=np.array([pose for pose, *_ in seen], dtype=np.intp),
        station=tuple(station for _, station, *_ in seen),
        position=np.array([marker.value for *_, marker in seen]).reshape(-1, 3),
        sigma=np.array([marker.sigma.max() for *_, marker in seen]),
        T_base_tcp=np.array([tool.T_base_tcp for *_, tool, _ in seen]).reshape(-1, 4, 4),
        robot_error=robot_errors(robot, q, gravity, lever),
    )


def robot_errors(robot: Robot, q: FloatArray, gravity: FloatArray, lever: FloatArray) -> FloatArray:
    """Return the marker's displacement by likely errors of a robot, shape (pose, 3, error), in m.

    Columns, each by one standard deviation: the offset of each joint; where the robot's link
    masses are known, its sag under gravity; and for each joint the three shifts and two tilts of
    its axis in the link before it, which with the offset are all errors that a chain of rigid
    links can have.

    Parameters
    ----------
    q : ndarray, shape (pose, joint)
        In rad or m.
    gravity : ndarray, shape (3,)
        In base, in m/s².
    lever : ndarray, shape (3,)
        Marker in the tcp frame, in m.
    """
    if not len(q):
        return np.empty((0, 3, 0))
    joints, arm = robot.chain.joints, robot.forward(q)[:, :3, :3] @ lever
    inserted = [axis for index, joint in enumerate(joints) for axis in _axis_errors(index, joint)]
    model = build_model(robot.chain, inserted)
    which = np.concatenate([model.joint_columns, model.inserted_columns])
    jacobian = evaluate_jacobian(model, q, which)
    marker = jacobian.translation + np.cross(jacobian.rotation, arm[..., None], axis=1)
    offsets, axes = np.split(marker, [len(joints)], axis=2)
    likely = np.array([AXIS_TILT if axis.revolute else AXIS_SHIFT for axis in inserted])
    found = [JOINT_ERROR * offsets, likely * axes]
    if any(joint.mass > 0 for joint in joints):
        torque = robot.gravity_torques(q, gravity)
        largest = max(float(np.abs(torque).max()), np.finfo(float).tiny)
        found.insert(1, SAG * offsets * (torque / largest)[:, None, :])
    return np.concatenate(found, axis=2)


def _axis_errors(index: int, joint: ChainJoint) -> list[InsertedJoint]:
    """Return the virtual joints that move a joint's axis: three shifts, two tilts across it."""
    across = np.linalg.svd(joint.axis[None])[2][1:]
    ways = [(f"shift_{k}", axis, False) for k, axis in enumerate(np.eye(3))]
    ways += [(f"tilt_{k}", axis, True) for k, axis in enumerate(across)]
    return [
        InsertedJoint(f"{joint.name}.{name}", index, axis, revolute, False, np.zeros(3))
        for name, axis, revolute in ways
    ]


def weighed_poses(poses: Sequence[PoseReadings]) -> list[int]:
    """Return the poses of the readings that `tool_readings` returns, in the same order."""
    return [pose.pose for pose in poses if pose.reference and pose.reference.tool]


def tool_readings(poses: Sequence[PoseReadings], tool: SensorLoad) -> UnloadedWrenches:
    """Return the raw wrenches of the unloaded references.

    Parameters
    ----------
    poses : sequence of PoseReadings
        In the order of time.
    tool : SensorLoad
        How the sensor sits.
    """
    states = [r.tool for pose in poses if (r := pose.reference) and r.tool]
    T = np.array([state.T_base_tcp for state in states]).reshape(-1, 4, 4)
    return UnloadedWrenches(
        time=np.array([state.force.time for state in states]),
        force=np.array([state.force.value for state in states]).reshape(-1, 3),
        moment=np.array([state.moment.value for state in states]).reshape(-1, 3),
        R_base_sensor=tool.R_base_sensor(T),
        gravity=tool.gravity,
    )
