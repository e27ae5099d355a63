"""Contradictions between the logs of an import and their map, or among the logs.

A constant column, an interrupted stream, inconsistent clocks, a sensor that does not show the
changing direction of the tool's weight, a marker that does not follow the arm: each is named, first
of all if a reading or a registration then fails.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray, longest_run
from elastocal.compensation.conditioning import (
    SensorMistake,
    StaticPostures,
    fit_tool,
    other_centre,
    other_mass,
    sensor_mistake,
    static_postures,
)
from elastocal.errors import LogError
from elastocal.geometry import Payload, Positions, position_mistake
from elastocal.logs._misfits import weight_misfit
from elastocal.logs.clocks import ClockFit, fit_clock
from elastocal.logs.map import LogMap, Site
from elastocal.logs.plateaus import number_poses
from elastocal.logs.streams import LogStreams, stream_rows
from elastocal.procedure.derive import Reading
from elastocal.procedure.record import SAME_TIME, ArmStream, Streams
from elastocal.robot import Robot, nearest_rotation, xyzabc_from_T
from elastocal.wording import listed

_T = TypeVar("_T")
_MOST_DRIFT = 400e-6
"""Drift of a clock that no quartz has: a PC's is off by a tenth of it."""
_EVEN, _KNOWN = 0.05, 1.0 / 3.0
"""Sigma of a drift over the drift: up to the first it is even, up to the second it is there."""
_STILL = 0.25
"""Part of a log in which a column must be constant to be named."""
_MOVES = np.radians(2.0)
"""Range of a joint that moves."""
_GAP, _USUAL = 5.0, 10.0
"""Shortest interruption in s, and over the intervals between nearly all samples."""
_POOR_CORRELATION, _MOST_APART = 0.85, 0.75
"""Correlation of motions, and overlap as a part of the shorter log, of two different runs."""
_APART, _BETTER = 0.5, 0.5
"""Clocks that are farther apart than this, in s, if that leaves so much less of the weight."""
_LEAST_POSES = 5
"""Poses by which a sensor or a marker is judged."""
_LEVER = 0.1
"""Moment range of a sensor over its force range, in m: logs do not say it."""
_WEIGHS, _FITS = 5.0, 0.1
"""Least change of the weight in N, and the part of it that may be left, for it to be believed."""
_MISFIT = 0.3
"""Part of the weight's change that no tool leaves."""
_PULL = 0.5
"""Part of a load along z of the tcp from which on it is a press, or a pull."""
_LEAST_WEIGHT = 5.0
"""Smallest change of the unloaded force between poses that is usable, RMS in N."""
_LEAST_TURN = np.radians(3.0)
"""Rotation of a sensor that is a usual mounting error."""
_MOST_LEFT = 0.2
"""Part of the change that another turn may leave and still be believed."""
_SENSE, _TELLS = 0.5, 0.02
"""Ratio of the residuals of both senses of the forces, and the residual, at which a sense is
decided."""
_LEAST_SPREAD = 0.05
"""Second spread of the directions of gravity in the sensor from which a rotation is determined."""


def stream_doubts(
    logs: Sequence[LogStreams], clocks: Sequence[ClockFit], site: Site
) -> Iterator[str]:
    """Yield what is odd about streams by the clock of the joints.

    Parameters
    ----------
    logs : sequence of LogStreams
        One of them with joints.
    clocks : sequence of ClockFit
        Fits of their clocks to that of the joints.
    site : Site
        Robot, sensor and marker.
    """
    reference = next(log for log in logs if log.arm is not None)
    yield from _set_clocks(clocks)
    for log in logs:
        if log.arm is None and log.entry.time is not None:
            yield from _interruption(log, reference)
            yield from _other_run(log, reference, clocks)
        if log.wrench is not None and log is not reference and log.clock == reference.clock:
            yield from _other_clock(log, reference, site)


def _set_clocks(clocks: Sequence[ClockFit]) -> Iterator[str]:
    """Yield clocks that drift as no clock does, and are not known to do so evenly."""
    for clock in clocks:
        sigma, drift = clock.drift_sigma or 0.0, abs(clock.drift)
        if drift > _MOST_DRIFT and _EVEN * drift < sigma < _KNOWN * drift:
            yield (
                f"the clock of {clock.clock} drifts by {1e6 * clock.drift:+.0f} ppm, and not evenly"
                f" (± {2e6 * sigma:.0f} ppm): was it set during the work? Readings may be averaged"
                f" {2e3 * (clock.offset_sigma or 0.0):.0f} ms off"
            )


def still_columns(logs: Sequence[LogStreams], robot: Robot) -> Iterator[str]:
    """Yield columns of forces, markers and joints that are constant while the others change."""
    for log in logs:
        if log.arm is not None:
            yield from _still_joints(log, log.arm, robot)
        if log.wrench is not None and log.entry.force is not None:
            yield from _still_columns(log, log.entry.force.columns, log.wrench.force)
        if log.points is not None and len(log.entry.markers) == 1:
            yield from _still_columns(log, log.entry.markers[0].columns, log.points.position)


def _still_joints(log: LogStreams, arm: ArmStream, robot: Robot) -> Iterator[str]:
    """Yield joints that are constant while each other one moves, but move before or after.

    A rail may rest for many poses, and so may a joint that no plan moves.
    """
    turning = np.flatnonzero(robot.revolute).tolist()
    if not turning or not len(arm.q):
        return
    runs = {joint: longest_run(arm.q[:, joint]) for joint in turning}
    for joint, run in runs.items():
        others = [other for other in turning if other != joint]
        rest = np.delete(arm.q[:, joint], np.r_[run])
        if (
            _STILL * len(arm.q) <= run.stop - run.start < len(arm.q)
            and np.ptp(rest) > _MOVES
            and (np.ptp(arm.q[run][:, others], axis=0) > _MOVES).all()
        ):
            yield (
                f"{log.entry.log}: {robot.joint_names[joint]} holds the same number in"
                f" {run.stop - run.start} of {len(arm.q)} rows while the other joints move: is its"
                " column dead?"
            )


def _still_columns(log: LogStreams, names: Sequence[str], values: FloatArray) -> Iterator[str]:
    """Yield columns that hold the same number in many rows one after the other."""
    same = longest_run(np.cumsum((np.diff(values, axis=0, prepend=values[:1]) != 0).any(axis=1)))
    if same.stop - same.start >= _STILL * len(values):
        yield (
            f"{log.entry.log}: columns {listed([repr(name) for name in names])} hold the same"
            f" numbers in {same.stop - same.start} of {len(values)} rows: did the device stop, or"
            " lose what it follows?"
        )
        return
    for name, column in zip(names, values.T, strict=True):
        run = longest_run(column)
        count = run.stop - run.start
        if count >= _STILL * len(column) and np.ptp(values[run], axis=0).any():
            yield (
                f"{log.entry.log}: column {name!r} holds the same number in {count} of"
                f" {len(column)} rows while the others change: is its channel dead?"
            )


def _interruption(log: LogStreams, reference: LogStreams) -> Iterator[str]:
    """Yield the longest time without a sample while the controller's log goes on."""
    # A handshake puts what is before its first word and after its last one at infinity.
    time = log.time[np.isfinite(log.time)]
    gaps = np.diff(time)
    if not len(gaps):
        return
    longest = int(np.argmax(gaps))
    gap, start = float(gaps[longest]), float(time[longest])
    if not gap > max(_GAP, _USUAL * float(np.percentile(gaps, 99.0))):
        return
    usual = float(np.median(np.diff(reference.time)))
    inside = ((reference.time > start) & (reference.time < start + gap)).sum()
    if inside > 0.5 * gap / usual:
        yield (
            f"{log.entry.log}: nothing for {gap:.0f} s, while {reference.entry.log} goes on: what"
            " was read there is missing; is a part of the log lost?"
        )


def _other_run(log: LogStreams, reference: LogStreams, clocks: Sequence[ClockFit]) -> Iterator[str]:
    """Yield that a log agrees poorly with the controller's, and for a part of the time alone."""
    correlation = next((each.correlation for each in clocks if each.clock == log.clock), 1.0)
    start, end = (max(log.time[0], reference.time[0]), min(log.time[-1], reference.time[-1]))
    shorter = min(float(np.ptp(each.time)) for each in (log, reference))
    if correlation < _POOR_CORRELATION and end - start < _MOST_APART * shorter:
        yield (
            f"{log.entry.log} and {reference.entry.log} agree poorly (correlation"
            f" {correlation:.2f}), and for {end - start:.0f} s of {shorter:.0f} s alone: is one the"
            " log of another run, or its clock mistaken?"
        )


def _other_clock(log: LogStreams, reference: LogStreams, site: Site) -> Iterator[str]:
    """Yield by how much clocks are apart that the map says are one."""
    try:
        offset = fit_clock(log, reference, site).offset
    except LogError:
        return
    now, then = (weight_misfit(log, reference, each) for each in (0.0, offset))
    if abs(offset) > _APART and then < _BETTER * now:
        yield (
            f"{log.entry.log} and {reference.entry.log} share a clock by the map, but what they"
            f" feel agrees {abs(offset):.1f} s apart: give them clocks of their own"
        )


def postures_at_rest(
    readings: Sequence[Reading], poses: Sequence[int], site: Site
) -> StaticPostures | None:
    """Return the first reading of each pose, at which nothing presses yet; None of too few.

    Parameters
    ----------
    readings : sequence of Reading
        In order of time.
    poses : sequence of int
        Poses of each; -1: of none.
    site : Site
        What the map says.
    """
    tools = [each.tool for each in _first_of_poses(readings, poses) if each.tool is not None]
    if len(tools) < _LEAST_POSES:
        return None
    R = site.sensor.T_tcp_sensor[:3, :3] @ site.T_flange_sensor[:3, :3].T
    return static_postures(
        np.stack([each.T_base_tcp[:3, :3] @ R for each in tools]),
        np.stack([each.force.value for each in tools]),
        np.stack([each.moment.value for each in tools]),
        site.sensor.gravity,
    )


def sensor_contradictions(postures: StaticPostures, site: Site) -> Iterator[SensorMistake]:
    """Yield contradictions between the weight of the tool and axes, units and zero of the sensor.

    Its rotation is reported with its angles where readings can be formed (`sensor_doubts`).

    Raises
    ------
    LogError
        If a mistake is certain: the map undoes it, and the weight then turns as it must.
    """
    fit = fit_tool(postures, site.T_flange_sensor[:3, :3])
    left, change = fit.force_scatter, _change(postures)
    turning = float((postures.gravity_flange - postures.gravity_flange.mean(axis=0)).std())
    # In another unit the weight may hardly change.
    if not max(change, site.sensor.mass * turning) > _WEIGHS:
        return
    found = _sensor_mistake(postures, site) if change > _WEIGHS else None
    if found is not None and found.entry:
        raise LogError(f"{found.message}; write {found.entry} in the map")
    if found is not None:
        if found.about != "rotation of the sensor":
            yield found
        return
    if left < _FITS * change and fit.mass > 0.0 and "mass" not in fit.undetermined:
        yield from map(SensorMistake, other_mass(fit.mass, site.sensor.mass))
        if site.sensor.mass > 0.0:
            yield from map(SensorMistake, other_centre(fit, site.sensor.centre))


def sensor_misfit(postures: StaticPostures, site: Site) -> str | None:
    """Return why the sensor's data do not allow readings; None: the sensor is not the reason."""
    fit = fit_tool(postures, site.T_flange_sensor[:3, :3])
    left, change = fit.force_scatter, _change(postures)
    if not change > _WEIGHS:
        return None
    if (found := _sensor_mistake(postures, site)) is not None:
        turned = found.about == "rotation of the sensor"
        with_angles = sensor_doubts(postures, np.empty((0, 3)), site) if turned else ()
        return next(iter(with_angles), found.message)
    if left < _FITS * change and fit.mass < 0.0:
        return (
            "the weight of the tool points upward in the sensor: does it show the force on the"
            " tooling (acts_on: environment)?"
        )
    if left > _MISFIT * change:
        return (
            f"the forces at rest do not turn with the arm as the weight of a tool does ({left:.3g}"
            f" N are left of a component, of {change:.3g} N): is the log of the sensor of another"
            " run?"
        )
    return None


def _sensor_mistake(postures: StaticPostures, site: Site) -> SensorMistake | None:
    return sensor_mistake(postures, site.T_flange_sensor[:3, :3], _LEVER)


def sensor_doubts(
    postures: StaticPostures | None, loads: FloatArray, site: Site
) -> tuple[str, ...]:
    """Return why the sensor contradicts the map, by the sense of the loads and the weight.

    Unloaded, its force is a constant plus the weight of the tool. With the means over the poses
    subtracted, it is gravity in the sensor times the tool's mass, rotated by the error of the
    sensor's rotation in the map (Kabsch, Acta Crystallographica A32, 1976).

    Parameters
    ----------
    postures : StaticPostures, optional
        At which nothing presses.
    loads : ndarray, shape (load, 3)
        Force on the robot in the tcp, as the map has it, in N.
    site : Site
        What the map says.
    """
    along = float(np.median(loads[:, 2])) if len(loads) else 0.0
    left, turned = _turned_sensor(postures, 1.0, site)
    if not (along > 0.0 and along > _PULL * float(np.linalg.norm(loads, axis=1).mean())):
        return turned
    left_reversed, turned_reversed = _turned_sensor(postures, -1.0, site)
    if left < min(_MOST_LEFT, _SENSE * left_reversed) and left_reversed > _TELLS:
        return turned  # an upside-down sensor: forces of the other sense would fit no tool
    return (
        f"the loads pull at the tool ({along:+.0f} N along z of the tcp; a press is negative):"
        " does the sensor show the force on the tooling (acts_on: environment), does z of the"
        " tcp point into the tool?",
        *turned_reversed,
    )


def _turned_sensor(
    postures: StaticPostures | None, sense: float, site: Site
) -> tuple[float, tuple[str, ...]]:
    """Return the part of the weight's change that the best rotation leaves, and its description.

    The part is infinite where weight and poses do not determine it.
    """
    if postures is None:
        return np.inf, ()
    gravity = postures.gravity_flange @ site.T_flange_sensor[:3, :3]
    force = sense * postures.force
    gravity, force = gravity - gravity.mean(axis=0), force - force.mean(axis=0)
    spread = np.linalg.svd(gravity / np.linalg.norm(postures.gravity), compute_uv=False)
    size = float(np.sqrt((force**2).sum(axis=1).mean()))
    if size < _LEAST_WEIGHT or spread[1] < _LEAST_SPREAD * np.sqrt(len(postures)):
        return np.inf, ()
    Q = nearest_rotation(force.T @ gravity)
    mass = float((force * (gravity @ Q.T)).sum() / (gravity**2).sum())
    left = float(np.sqrt(((force - mass * gravity @ Q.T) ** 2).sum(axis=1).mean())) / size
    turn = float(Rotation.from_matrix(Q).magnitude())
    return left, (_turned(site, Q, mass),) if left < _MOST_LEFT and turn > _LEAST_TURN else ()


def _turned(site: Site, Q: FloatArray, mass: float) -> str:
    """Return the sentence about a sensor that is turned by Q^T more than the map says."""
    T = site.T_flange_sensor.copy()
    T[:3, :3] = T[:3, :3] @ Q.T
    said, found = (
        ", ".join(f"{angle + 0.0:.0f}" for angle in np.round(np.degrees(xyzabc_from_T(each)[3:])))
        for each in (site.T_flange_sensor, T)
    )
    return (
        f"the weight of the tool turns in the sensor as in one whose abc in the flange is {found}"
        f" deg (with {mass:.3g} kg behind it), not {said} deg as the map says: every force is"
        " turned by as much"
    )


def marker_contradictions(
    streams: Streams, spans: Sequence[tuple[float, float]], log_map: LogMap, site: Site
) -> Iterator[str]:
    """Yield why the marker does not go where the arm carries it, at the first span of each pose.

    Raises
    ------
    LogError
        If a mistake is certain.
    """
    firsts = _first_of_poses(spans, number_poses(spans, streams))
    seen = [each for span in firsts if (each := _place(streams, span)) is not None]
    if len(seen) < _LEAST_POSES:
        return
    q, markers, stations = zip(*seen, strict=True)
    data = replace(
        Positions.unloaded(np.stack(q), Payload()),
        markers=np.stack(markers)[:, None],
        station=np.array(stations),
    )
    poses = [each.pose for each in log_map.logs if each.pose is not None]
    agree = any(each.angles or each.quaternion for each in poses)  # `stated_poses` requires it
    mistake = position_mistake(site.robot, data, joints_agree=agree)
    if mistake is not None and mistake.certain:
        raise LogError(mistake.message)
    if mistake is not None:
        yield mistake.message


def _place(
    streams: Streams, span: tuple[float, float]
) -> tuple[FloatArray, FloatArray, str] | None:
    """Return mean joints and marker over a span, and the station; None where one is missing."""
    near = span[0] - SAME_TIME, span[1] + SAME_TIME
    arm = stream_rows(streams.arm, slice(*np.searchsorted(streams.arm.time, near)))
    points = stream_rows(streams.points, slice(*np.searchsorted(streams.points.time, near)))
    seen = np.isfinite(points.position).all(axis=1)
    stations = Counter(points.station[seen].tolist()).most_common(1)
    if not len(arm.time) or not stations:
        return None
    own = seen & (points.station == stations[0][0])
    return arm.q.mean(axis=0), points.position[own].mean(axis=0), stations[0][0]


def _first_of_poses(each_of: Sequence[_T], poses: Sequence[int]) -> list[_T]:
    firsts: dict[int, _T] = {}
    for pose, each in zip(poses, each_of, strict=True):
        if pose >= 0:
            firsts.setdefault(pose, each)
    return list(firsts.values())


def _change(postures: StaticPostures) -> float:
    """Return the change of a force component from posture to posture, in N."""
    return float((postures.force - postures.force.mean(axis=0)).std())
