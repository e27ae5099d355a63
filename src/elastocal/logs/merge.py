"""From logs of three instruments to one dataset: one clock, plateaus, readings, registration.

What a run of elastocal records in its journal is found here in the logs: the times at which
everything was at rest (`elastocal.logs.plateaus`), in one time base (`elastocal.logs.clocks`). From
there both use `elastocal.procedure.derive`: means, tare and tool weight, registration of the
stations.

Contradictions between logs and map are found before readings are formed.

A constant column, an interrupted stream, inconsistent clocks, a sensor that does not show the
changing direction of the tool's weight, a marker that does not follow the arm: each is named, first
of all if a reading or a registration then fails.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from elastocal.arrays import FloatArray, longest_run
from elastocal.compensation.conditioning import (
    BIAS_JUMPS,
    SENSOR_TURNED,
    SensorMistake,
    StaticPostures,
    fit_tool,
    other_centre,
    other_mass,
    sensor_mistake,
    static_postures,
)
from elastocal.dataset import Dataset, write_doubts
from elastocal.errors import LogError, present
from elastocal.files import sha256
from elastocal.geometry import Payload, Positions, position_mistake
from elastocal.logs._frames import sensor_doubts
from elastocal.logs._misfits import weight_misfit
from elastocal.logs.clocks import ClockFit, align, fit_clock, handshake_spans
from elastocal.logs.map import LogMap, Site
from elastocal.logs.plateaus import Plateau, averaged_part, name_loads, number_poses, standing_spans
from elastocal.logs.streams import LogStreams, Stream, joined_streams, read_streams_of, stream_rows
from elastocal.procedure import PoseLog, PoseReadings, file_sha256
from elastocal.procedure.derive import (
    LEAST_SAMPLES,
    LoadRow,
    MeasuredArm,
    Reading,
    average,
    dataset_of,
    load_rows,
    marker_readings,
)
from elastocal.procedure.record import (
    SAME_TIME,
    ArmStream,
    PointStream,
    ReadingStatus,
    Streams,
    Window,
    WrenchStream,
)
from elastocal.procedure.registration import Registration, register
from elastocal.progress import Progress
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.wording import counted, listed

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


def sensor_contradictions(postures: StaticPostures, site: Site) -> Iterator[str]:
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
        if not found.message.startswith(SENSOR_TURNED):
            yield found.message
        return
    if left < _FITS * change and fit.mass > 0.0 and "mass" not in fit.undetermined:
        yield from other_mass(fit.mass, site.sensor.mass)
        if site.sensor.mass > 0.0:
            yield from other_centre(fit, site.sensor.centre)


def sensor_misfit(postures: StaticPostures, site: Site) -> str | None:
    """Return why the sensor's data do not allow readings; None: the sensor is not the reason."""
    fit = fit_tool(postures, site.T_flange_sensor[:3, :3])
    left, change = fit.force_scatter, _change(postures)
    if not change > _WEIGHS:
        return None
    if (found := _sensor_mistake(postures, site)) is not None:
        turned = found.message.startswith(SENSOR_TURNED)
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


def aligned(
    logs: Sequence[LogStreams], log_map: LogMap, site: Site, still: Sequence[str]
) -> tuple[tuple[LogStreams, ...], tuple[ClockFit, ...]]:
    """Return the logs in the time of the joints, and the fit of each clock.

    Parameters
    ----------
    logs : sequence of LogStreams
        One of them with joints.
    log_map : LogMap
        What the map says.
    site : Site
        Robot, sensor and marker.
    still : sequence of str
        Columns that are constant.

    Raises
    ------
    LogError
        If a clock cannot be determined; the message begins with a mistake that is known without
        it.
    """
    try:
        return align(logs, site)
    except LogError as error:
        known = next(iter(still), None) or _marker_mistake(logs, log_map, site)
        raise LogError(f"{known} ({error})") if known else error from error


def _marker_mistake(logs: Sequence[LogStreams], log_map: LogMap, site: Site) -> str | None:
    """Return the mistake of a marker that shows without the clock of the sensor, if any."""
    seeing = [log for log in logs if log.arm is not None or log.points is not None]
    try:
        streams = merged(align(seeing, site)[0], site)
    except LogError:
        return None  # the clock that cannot be determined is that of a marker
    spans = _spans_unfelt(streams, site)
    try:
        return next(marker_contradictions(streams, spans, log_map, site), None)
    except LogError as certain:
        return str(certain)


def _spans_unfelt(streams: Streams, site: Site) -> list[tuple[float, float]]:
    """Return the averaged parts of the plateaus of arm and marker, whatever the sensor feels.

    Its clock follows from the weight, which turns with the joints, and may be mistaken with them.
    """
    alone = replace(streams, wrench=stream_rows(streams.wrench, slice(0)))
    return [averaged_part(*each) for each in standing_spans(alone, site.marker)]


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


IMPORTED = "elastocal import"
"""Start of the provenance of a dataset from logs."""
_WORTH_POSES = 2
"""Number of poses that make a usable dataset."""


@brief_repr
@dataclass(frozen=True, eq=False)
class ImportedLogs:
    """The dataset of foreign logs, and how it came about."""

    dataset: Dataset
    streams: Streams
    """Streams in the time of the joints."""
    plateaus: tuple[Plateau, ...]
    """All that were found; those of no use have the pose -1."""
    clocks: tuple[ClockFit, ...]
    registration: Registration
    warnings: tuple[str, ...]


def import_streams(
    log_map: LogMap, site: Site, files: Sequence[Path], progress: Progress
) -> ImportedLogs:
    """Return the dataset of logs.

    Parameters
    ----------
    log_map : LogMap
        What their columns are.
    site : Site
        What they were taken from.
    files : sequence of Path
        The logs.
    progress : Progress
        Called with stage, done and total.

    Raises
    ------
    LogError
        If a log cannot be read as the map says, the clocks cannot be determined, there are no
        plateaus, no reference or load among them, or the stations cannot be registered.
    DatasetError
        If the numbers look like a unit mistake.
    FileAccessError
        If a file cannot be read.
    """
    progress("logs", 0, 4)
    if not any(each.force for each in log_map.logs):
        raise LogError(
            "no log holds force: readings are deflections under a force; for positions of the"
            " unloaded arm import --for geometry"
        )
    logs = read_streams_of(log_map, files, site.robot)
    progress("clocks", 1, 4)
    still = tuple(still_columns(logs, site.robot))
    logs, clocks = aligned(logs, log_map, site, still)
    streams = merged(logs, site)
    progress("plateaus", 2, 4)
    by_word = next((log for log in logs if log.arm is not None and log.handshake), None)
    at_rest = standing(streams, site, by_word)
    poses = [each.pose for each in at_rest.bare]
    postures = postures_at_rest(at_rest.readings, poses, site)
    spans = [(each.start, each.end) for each in at_rest.bare]
    if by_word is None:
        spans = _spans_unfelt(streams, site)
    # What is named first explains what comes after: joints that are mistaken turn the weight, too.
    astray = () if still else tuple(marker_contradictions(streams, spans, log_map, site))
    judged = None if still or astray else postures
    sensor = () if judged is None else tuple(sensor_contradictions(judged, site))
    doubts = (*still, *astray, *sensor, *stream_doubts(logs, clocks, site))
    try:
        judge = not (still or sensor)
        found = _imported(streams, at_rest, log_map, site, files, postures, judge, progress)
    except LogError as error:
        why = next(iter(doubts), None if judged is None else sensor_misfit(judged, site))
        if why is None:
            raise
        raise LogError(f"{why} ({error})") from error
    dataset = _doubted(found.dataset, [*astray, *sensor, *found.dataset.doubts])
    return replace(found, dataset=dataset, clocks=clocks, warnings=(*doubts, *found.warnings))


def _doubted(dataset: Dataset, doubts: Sequence[str]) -> Dataset:
    """Return a dataset that carries the mistakes that its readings may contain."""
    carried = [each for each in doubts if not each.startswith(BIAS_JUMPS)]
    return replace(dataset, attributes={**dataset.attributes, **write_doubts(carried)})


def _imported(
    streams: Streams,
    at_rest: "Standing",
    log_map: LogMap,
    site: Site,
    files: Sequence[Path],
    judged: StaticPostures | None,
    judge_sensor: bool,
    progress: Progress,
) -> ImportedLogs:
    """Return the dataset of the plateaus."""
    states = [each.tool for each in at_rest.readings]
    named = name_loads(at_rest.bare, states, site.sensor, log_map.load_cases)
    plateaus = _with_references(named)
    progress("readings", 3, 4)
    poses = _readings(streams, plateaus, at_rest.least)
    seen = marker_readings(poses, site.robot, site.sensor.gravity, site.marker)
    registration = register(seen, site.marker)
    seen_at_all = len(streams.points.time) > 0
    rows = load_rows(poses, registration, site.sensor, conditioned=False, metrology=seen_at_all)
    dataset = _dataset(poses, rows, log_map, site, registration, files)
    progress("readings", 4, 4)
    loads = np.array([each.force_tcp for each in plateaus if each.pose >= 0 and each.load])
    doubts = sensor_doubts(judged, loads.reshape(-1, 3), site) if judge_sensor else ()
    dataset = _doubted(dataset, doubts)
    warnings = (*doubts, *_warnings(plateaus, rows, registration, log_map))
    return ImportedLogs(dataset, streams, tuple(plateaus), (), registration, warnings)


def log_sha256(path: Path) -> str:
    """Return the hexadecimal SHA-256 of a log; of a folder that of the names and hashes in it.

    Raises
    ------
    FileAccessError
        If it cannot be read.
    """
    if not path.is_dir():
        return file_sha256(path)
    files = sorted(each for each in path.rglob("*") if each.is_file())
    names = (f"{file_sha256(each)} {each.relative_to(path).as_posix()}\n" for each in files)
    return sha256("".join(names))


def merged(logs: Sequence[LogStreams], site: Site) -> Streams:
    """Return the streams of all logs by one clock, forces in the sensor's frame."""
    arm = next(log.arm for log in logs if log.arm is not None)
    known = np.isfinite(arm.q).all(axis=1) & np.isfinite(arm.T_base_tcp).all(axis=(1, 2))
    if not known.all():  # else a copy of what may be half a gigabyte
        arm = stream_rows(arm, np.asarray(known))
    wrenches = [_in_sensor(log, arm, site) for log in logs if log.wrench is not None]
    silent = np.empty((0, 3))
    unfelt = WrenchStream(np.empty(0), silent, silent, np.empty(0), np.empty(0, dtype=bool))
    points = [log.points for log in logs if log.points is not None]
    none = PointStream(np.empty(0), np.empty((0, 3)), np.empty((0, 3)), np.empty(0, dtype=np.str_))
    return Streams(
        site.robot.joint_names,
        arm,
        _chained(wrenches) if wrenches else unfelt,
        _chained(points) if points else none,
        (),
    )


def _chained(streams: Sequence[Stream]) -> Stream:
    """Return one stream of several, in order of time."""
    joined = joined_streams(streams)
    return stream_rows(joined, np.argsort(joined.time, kind="stable"))


def _in_sensor(log: LogStreams, arm: ArmStream, site: Site) -> WrenchStream:
    """Return wrenches in the frame and about the origin of the sensor."""
    wrench = present(log.wrench, "wrench")
    if log.entry.frame == "sensor":
        return wrench
    T = site.sensor.T_tcp_sensor
    R: FloatArray = np.broadcast_to(T[:3, :3], (len(wrench.time), 3, 3))
    if log.entry.frame == "base":
        _, first = np.unique(arm.time, return_index=True)
        turns = Slerp(arm.time[first], Rotation.from_matrix(arm.T_base_tcp[first, :3, :3]))
        inside = np.clip(wrench.time, arm.time[first[0]], arm.time[first[-1]])
        R = turns(inside).as_matrix() @ T[:3, :3]
    force = np.einsum("nji,nj->ni", R, wrench.force)
    moment = np.einsum("nji,nj->ni", R, wrench.moment)
    # Both other frames state moments about the tcp.
    return replace(wrench, force=force, moment=moment - np.cross(T[:3, :3].T @ T[:3, 3], force))


@brief_repr
@dataclass(frozen=True, eq=False)
class Standing:
    """Plateaus, before their loads are known."""

    bare: list[Plateau]
    readings: list[Reading]
    """Means over each."""
    least: int
    """Samples that a mean needs."""


def standing(streams: Streams, site: Site, by_word: LogStreams | None) -> Standing:
    """Return all plateaus, with their poses."""
    if by_word is not None:
        spans = list(handshake_spans(by_word).values())
        parts = spans
    else:
        spans = standing_spans(streams, site.marker)
        parts = [averaged_part(*span) for span in spans]
    if not spans:
        raise LogError(
            "there is no plateau in the logs: nowhere do arm, force and marker stand for half a"
            " second at the same time; are the clocks the same, is the noise that large?"
        )
    numbers = number_poses(spans, streams)
    least = LEAST_SAMPLES if by_word is None else 1
    bare = [Plateau(*part, pose) for part, pose in zip(parts, numbers, strict=True)]
    return Standing(bare, [_reading(each, streams, least) for each in bare], least)


def _with_references(plateaus: Sequence[Plateau]) -> list[Plateau]:
    """Return plateaus without those of poses that lack reference or load, with renumbered poses."""
    kept: list[int] = []
    for pose in dict.fromkeys(each.pose for each in plateaus if each.pose >= 0):
        loads = [each.load for each in plateaus if each.pose == pose]
        first = next((n for n, load in enumerate(loads) if load is not None), None)
        if first:
            kept.append(pose)
    numbers = {pose: number for number, pose in enumerate(kept)}
    return [replace(each, pose=numbers.get(each.pose, -1)) for each in plateaus]


def _readings(streams: Streams, plateaus: Sequence[Plateau], least: int) -> list[PoseReadings]:
    """Return the readings of each pose, its last unloaded plateau before the loads first."""
    found = []
    for pose in range(max((each.pose for each in plateaus), default=-1) + 1):
        own = [each for each in plateaus if each.pose == pose]
        first = next(n for n, each in enumerate(own) if each.load is not None)
        readings = [_reading(each, streams, least) for each in own[first - 1 :]]
        windows = tuple(each.window for each in readings)
        log = PoseLog(pose=pose, attempt=1, streams="", windows=windows)
        loads = tuple(each for each in readings[1:] if each.window.load_case is not None)
        after = [each for each in readings[1:] if each.window.load_case is None]
        found.append(PoseReadings(log, readings[0], loads, after[-1] if after else None))
    foreign = [each.force_tcp for each in plateaus if each.load == ""]
    if not found and foreign:
        forces = dict.fromkeys(f"({x:.0f}, {y:.0f}, {z:.0f}) N" for x, y, z in foreign)
        raise LogError(
            f"no load is near a load case of the map: on the robot, in the tcp, they are"
            f" {', '.join([*forces][:3])} …; is the sense right (acts_on), are the axes?"
        )
    if len(found) < _WORTH_POSES:
        raise LogError(
            f"only {counted(len(found), 'pose')} of {len(plateaus)} plateaus has an unloaded"
            " reference and loads after it: a dataset needs two"
        )
    return found


def _reading(plateau: Plateau, streams: Streams, least: int) -> Reading:
    """Return the means over a plateau, by the station that saw most of it."""
    near = plateau.start - SAME_TIME, plateau.end + SAME_TIME

    def cut(stream: Stream) -> Stream:
        return stream_rows(stream, slice(*np.searchsorted(stream.time, near)))

    own = replace(
        streams, arm=cut(streams.arm), wrench=cut(streams.wrench), points=cut(streams.points)
    )
    stations = Counter(own.points.station.tolist()).most_common(1)
    window = Window(
        load_case=plateau.load,
        start=plateau.start,
        end=plateau.end,
        station=stations[0][0] if stations else None,
        status=ReadingStatus.OK,
    )
    return average(own, window, least)


def _dataset(
    poses: Sequence[PoseReadings],
    rows: Sequence[LoadRow],
    log_map: LogMap,
    site: Site,
    registration: Registration,
    files: Sequence[Path],
) -> Dataset:
    had = {row.load_case for row in rows if row.status is ReadingStatus.OK}
    if not had:
        reasons = [*registration.unregistered.values(), *(row.note for row in rows if row.note)]
        raise LogError(f"no usable reading among {len(rows)}: {next(iter(reasons), 'none')}")
    found = [str(load.window.load_case) for pose in poses for load in pose.loads]
    cases = [case for case in log_map.load_cases or dict.fromkeys(found) if case in had]
    arm = MeasuredArm(site.robot, site.urdf, site.gravity, check=log_map.check)
    names = ", ".join(path.name for path in files)
    return dataset_of(poses, rows, cases, arm, registration, site.sensor, f"{IMPORTED} {names}")


def _warnings(
    plateaus: Sequence[Plateau],
    rows: Sequence[LoadRow],
    registration: Registration,
    log_map: LogMap,
) -> tuple[str, ...]:
    """Return the findings to look at before the dataset is used."""
    found = []
    unnamed = sum(each.pose < 0 and each.load == "" for each in plateaus)
    if unnamed:
        found.append(f"{counted(unnamed, 'loaded plateau')} near none of the load cases of the map")
    missing = [name for name in log_map.load_cases if all(r.load_case != name for r in rows)]
    if missing:
        found.append(f"load case {', '.join(missing)} is at no pose")
    lost = [row for row in rows if row.status is not ReadingStatus.OK]
    if lost:
        found.append(f"{counted(len(lost), 'reading')} missing, the first: {lost[0].note}")
    for blunder in registration.blunders:
        found.append(
            f"pose {blunder.pose}: the marker is {1e3 * blunder.distance:.3g} mm from where it"
            " should be"
        )
    for move in registration.moves:
        found.append(
            f"station {move.station} moved {1e3 * move.distance:.2g} mm before pose {move.pose}"
        )
    if not registration.stations and not registration.unregistered:
        found.append(
            "no log holds a marker: the dataset has no marker displacement, which `calibrate` needs"
        )
    elif registration.undetermined_lever:
        axes = ", ".join(registration.undetermined_lever)
        found.append(f"the place of the marker along {axes} of the tcp is the map's")
    return tuple(found)
