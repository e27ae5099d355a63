"""From logs of three instruments to one dataset: one clock, plateaus, readings, registration.

What a run of elastocal records in its journal is found here in the logs: the times at which
everything was at rest (`elastocal.logs.plateaus`), in one time base (`elastocal.logs.clocks`). From
there both use `elastocal.procedure.derive`: means, tare and tool weight, registration of the
stations.

Contradictions between logs and map (`elastocal.logs.doubts`) are found before readings are formed.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from elastocal.arrays import FloatArray
from elastocal.dataset import Dataset, write_doubts
from elastocal.errors import LogError, present
from elastocal.files import sha256
from elastocal.logs.clocks import ClockFit, align, handshake_spans
from elastocal.logs.doubts import (
    marker_contradictions,
    postures_at_rest,
    sensor_contradictions,
    sensor_doubts,
    sensor_misfit,
    still_columns,
    stream_doubts,
)
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
from elastocal.wording import counted


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
    named = [each.message for each in sensor]
    doubts = (*still, *astray, *named, *stream_doubts(logs, clocks, site))
    try:
        found = _imported(streams, at_rest, log_map, site, files, progress)
    except LogError as error:
        why = next(iter(doubts), None if judged is None else sensor_misfit(judged, site))
        if why is None:
            raise
        raise LogError(f"{why} ({error})") from error
    turned = () if still or sensor else sensor_doubts(postures, _loads(found.plateaus), site)
    # What its readings may contain; a pose has a zero of its own.
    carried = [each.message for each in sensor if each.about != "zero of the sensor"]
    attributes = {**found.dataset.attributes, **write_doubts([*astray, *carried, *turned])}
    return replace(
        found,
        dataset=replace(found.dataset, attributes=attributes),
        clocks=clocks,
        warnings=(*doubts, *turned, *found.warnings),
    )


def _loads(plateaus: Sequence[Plateau]) -> FloatArray:
    """Return the forces on the robot in the tcp that the map names, shape (load, 3), in N."""
    loads = [each.force_tcp for each in plateaus if each.pose >= 0 and each.load]
    return np.array(loads).reshape(-1, 3)


def _imported(
    streams: Streams,
    at_rest: "Standing",
    log_map: LogMap,
    site: Site,
    files: Sequence[Path],
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
    warnings = _warnings(plateaus, rows, registration, log_map)
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
