"""From mapped logs to the streams of arm, force sensor and tracker, each by its own clock."""

import fnmatch
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TypeVar

import numpy as np

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.errors import LogError, UnitError, present
from elastocal.logs._frames import ROWS_AT_A_TIME, stated_poses, vectors
from elastocal.logs.map import Joints, LogEntry, LogMap, MarkerColumns
from elastocal.logs.recordings import is_recording, read_recording, read_workbook
from elastocal.logs.table import LogTable, read_text_log
from elastocal.procedure.record import ArmStream, PointStream, WrenchStream
from elastocal.results import brief_repr
from elastocal.robot import Robot, nearest_rotation
from elastocal.units import factor

_WORKBOOKS = (".xlsx", ".xlsm")
_NO_READING = ("", "0", "nan", "none", "false")
"""Words of a handshake column between readings."""
DATES = 3e8, 4e9
"""Seconds since 1970 between which a time is a date: mid 1979 to 2096. No device runs for as
long."""
_BEYOND_LIMITS = 0.2
"""Share of a joint's travel by which a log may be outside its limits."""
_K = 2.0
"""Coverage factor of a 95 % uncertainty."""

Stream = TypeVar("Stream", ArmStream, WrenchStream, PointStream)
"""Samples of one kind of instrument."""


@brief_repr
@dataclass(frozen=True, eq=False)
class LogStreams:
    """Content of one entry of the map; None where its logs do not contain it."""

    name: str
    entry: LogEntry
    time: FloatArray
    """Time of each row, shape (row,), in s of the log's clock; the row's number without one."""
    handshake: tuple[str, ...] | None
    """Word of each row, empty between readings."""
    arm: ArmStream | None
    wrench: WrenchStream | None
    points: PointStream | None
    """The marker, of several on one body its centre."""
    markers: FloatArray | None = None
    """Each marker, shape (row, marker, 3), in m; NaN where hidden."""

    @property
    def clock(self) -> str:
        """Word of its clock."""
        return self.entry.own_clock

    def at(self, time: FloatArray) -> "LogStreams":
        """Return the same with other times, shape (row,)."""

        def moved(stream: Stream | None) -> Stream | None:
            return None if stream is None else replace(stream, time=time)

        return replace(
            self,
            time=time,
            arm=moved(self.arm),
            wrench=moved(self.wrench),
            points=moved(self.points),
        )


def read_streams_of(log_map: LogMap, files: Sequence[Path], robot: Robot) -> tuple[LogStreams, ...]:
    """Return the streams of every entry of a map.

    Parameters
    ----------
    log_map : LogMap
        What the columns are.
    files : sequence of Path
        The logs; each must be named by an entry, and each entry name some.
    robot : Robot
        The robot of the map.

    Raises
    ------
    LogError
        If files and entries do not match, a column is missing or holds no numbers, times go
        backwards, or joints are far outside their limits.
    FileAccessError
        If a file cannot be read.
    """
    found = {
        index: [path for path in files if _is_named(path, entry.log)]
        for index, entry in enumerate(log_map.logs)
    }
    for index, entry in enumerate(log_map.logs):
        if not found[index]:
            raise LogError(
                f"log {entry.log!r} of the map is none of the files"
                f" {', '.join(path.name for path in files)}"
            )
    mapped = {path for paths in found.values() for path in paths}
    for path in files:
        if path not in mapped:
            names = ", ".join(entry.log for entry in log_map.logs)
            raise LogError(f"{path}: no entry of the map is about it (logs: {names})")
    if sum(bool(entry.joints) for entry in log_map.logs) > 1:
        raise LogError("joints stand in two entries of the map: one log must hold them all")
    return tuple(
        _streams(entry, [read_table(path, entry.topic) for path in sorted(found[index])], robot)
        for index, entry in enumerate(log_map.logs)
    )


def _is_named(path: Path, log: str) -> bool:
    """Return whether a map means a file: by its name, or by the end of its path with folders."""
    if fnmatch.fnmatch(path.name, log):
        return True
    # Relative to the map, which may lie elsewhere: what leads upwards says nothing of the file.
    parts = [part for part in Path(log).parts if part not in (".", "..")]
    return len(parts) > 1 and fnmatch.fnmatch(path.resolve().as_posix(), f"*/{'/'.join(parts)}")


def read_table(path: Path, topic: str | None) -> LogTable:
    """Return a log of any form as a table.

    Parameters
    ----------
    path : Path
        The file, or the folder of a ROS 2 bag.
    topic : str or None
        Topic of a recording, sheet of a workbook; None: the only or the first one.

    Raises
    ------
    LogError
        If it cannot be read as a table.
    FileAccessError
        If it cannot be read at all.
    """
    if is_recording(path):
        return read_recording(path, topic)
    if path.suffix.lower() in _WORKBOOKS:
        return read_workbook(path, topic)
    return read_text_log(path)


def _streams(entry: LogEntry, tables: Sequence[LogTable], robot: Robot) -> LogStreams:
    parts = [_stream(entry, table, robot) for table in tables]
    parts.sort(key=lambda part: part.time[0] if len(part.time) else 0.0)
    whole = parts[0] if len(parts) == 1 else _joined(parts)
    if entry.time is not None:
        back = np.flatnonzero(~(np.diff(whole.time) >= 0.0))
        if len(back):
            row = int(back[0]) + 2
            raise LogError(
                f"{whole.name}: row {row} of the data, column {entry.time.column!r}: its time is"
                " before that of the row above, or missing"
            )
    return whole


def _stream(entry: LogEntry, table: LogTable, robot: Robot) -> LogStreams:
    if not len(table):
        raise LogError(f"{table.name}: there are no rows in it")
    time = _time(entry, table)
    words = None
    if entry.handshake is not None:
        texts = table.texts(entry.handshake)
        words = tuple("" if text.lower() in _NO_READING else text for text in texts)
    return LogStreams(
        table.name,
        entry,
        time,
        words,
        _arm(entry, table, time, robot) if entry.joints else None,
        _wrench(entry, table, time) if entry.force else None,
        *(_points(entry, table, time) if entry.markers else (None, None)),
    )


def _time(entry: LogEntry, table: LogTable) -> FloatArray:
    """Return the time of each row, shape (row,), in s; its number where there is none."""
    if entry.time is None:
        return np.arange(len(table), dtype=float)
    if entry.time.unit is None:
        return table.seconds(entry.time.column)
    return table.numbers(entry.time.column) * factor(entry.time.unit, "time")


def days_of(log_map: LogMap, files: Sequence[Path]) -> str | None:
    """Return the day on which logs were taken, of several the first and the last.

    As ISO 8601 has it, ``2026-11-27`` or ``2026-11-27/2026-11-28``, by the clock of the joints if
    it has dates, else by that of the first log that has. None where none has.

    Raises
    ------
    LogError
        If a log cannot be read as the map says.
    FileAccessError
        If a file cannot be read.
    """
    entries = sorted(log_map.logs, key=lambda each: not each.joints)
    return next((days for each in entries if (days := _days(each, files)) is not None), None)


def _days(entry: LogEntry, files: Sequence[Path]) -> str | None:
    """Return the days of one log, as `days_of` has them."""
    if entry.time is None:
        return None
    own = [path for path in files if _is_named(path, entry.log)]
    times = [_time(entry, read_table(path, entry.topic)) for path in own]
    seconds = [float(each) for time in times if len(time) for each in (time.min(), time.max())]
    ends = (min(seconds, default=0.0), max(seconds, default=0.0))
    if not DATES[0] < ends[0] <= ends[1] < DATES[1]:
        return None
    days = dict.fromkeys(datetime.fromtimestamp(each, UTC).date().isoformat() for each in ends)
    return "/".join(days)


def _joined(parts: Sequence[LogStreams]) -> LogStreams:
    """Return one log from several consecutive ones with one clock."""
    first = parts[0]

    def chain(streams: Iterable[Stream | None]) -> Stream | None:
        each = [stream for stream in streams if stream is not None]
        return joined_streams(each) if each else None

    words = tuple(word for part in parts for word in part.handshake or ())
    return LogStreams(
        first.entry.log,
        first.entry,
        np.concatenate([part.time for part in parts]),
        words if first.handshake is not None else None,
        chain(part.arm for part in parts),
        chain(part.wrench for part in parts),
        chain(part.points for part in parts),
        None if first.markers is None else _chained_markers(parts),
    )


def _chained_markers(parts: Sequence[LogStreams]) -> FloatArray:
    return np.concatenate([present(part.markers, "markers") for part in parts])


def joined_streams(streams: Sequence[Stream]) -> Stream:
    """Return the samples of several streams of one kind, one stream after the other."""
    names = [name for name, values in vars(streams[0]).items() if values is not None]
    joined = {name: np.concatenate([getattr(each, name) for each in streams]) for name in names}
    return replace(streams[0], **joined)


def stream_rows(stream: Stream, rows: slice | IndexArray | BoolArray) -> Stream:
    """Return some samples of a stream."""
    there = {name: values for name, values in vars(stream).items() if values is not None}
    return replace(stream, **{name: values[rows] for name, values in there.items()})


def _arm(entry: LogEntry, table: LogTable, time: FloatArray, robot: Robot) -> ArmStream:
    q = _positions(entry.joints, table, robot)
    missing = [
        n for n, values in zip(robot.joint_names, q.T, strict=True) if np.isnan(values).all()
    ]
    if missing:
        raise LogError(f"{table.name}: no column is mapped to joint {', '.join(missing)}")
    link = _positions(entry.link_joints, table, robot) if entry.link_joints else None
    if entry.pose is not None:
        return ArmStream(time, q, stated_poses(entry, table, q, robot), link)
    T: FloatArray = np.empty((len(q), 4, 4))
    for start in range(0, len(q), ROWS_AT_A_TIME):
        rows = slice(start, start + ROWS_AT_A_TIME)
        T[rows] = robot.forward(q[rows])
    return ArmStream(time, q, T, link)


def _positions(blocks: Sequence[Joints], table: LogTable, robot: Robot) -> FloatArray:
    """Return positions of joints, shape (row, joint), in rad or m; NaN where no column is mapped.

    Raises
    ------
    LogError
        If a unit is not the joint's, or a position is far outside its limits.
    """
    q = np.full((len(table), len(robot.joint_names)), np.nan)
    for block in blocks:
        for column, joint, sign, offset in _placed(block, table, robot):
            dimension = "angle" if robot.revolute[joint] else "length"
            try:
                scale = factor(block.unit, dimension)
            except UnitError as error:
                raise LogError(
                    f"{table.name}: column {column!r} is joint {robot.joint_names[joint]}: {error}"
                ) from error
            q[:, joint] = sign * scale * table.numbers(column) + offset
    _require_within_limits(table.name, q, robot)
    return q


def _placed(
    block: Joints, table: LogTable, robot: Robot
) -> Iterable[tuple[str, int, float, float]]:
    """Yield column, number of the joint, sign and offset of each column of a block."""
    names = block.names or _names_by_unit(block, robot)
    for index, (column, name) in enumerate(zip(block.columns, names, strict=True)):
        if name not in robot.joint_names:
            raise LogError(
                f"{table.name}: {name!r} is no joint of {robot.name}"
                f" ({', '.join(robot.joint_names)})"
            )
        sign = float(block.signs[index]) if block.signs else 1.0
        offset = float(block.offsets[index]) if block.offsets else 0.0
        yield column, robot.joint_names.index(name), sign, offset


def _names_by_unit(block: Joints, robot: Robot) -> list[str]:
    """Return the robot's joints that are measured in a unit as this, in its order.

    Raises
    ------
    LogError
        If there is another number of them than columns.
    """
    angle = block.unit in ("rad", "deg")
    of_unit = zip(robot.joint_names, robot.revolute, strict=True)
    names = [name for name, turns in of_unit if bool(turns) == angle]
    if len(names) != len(block.columns):
        raise LogError(
            f"{len(block.columns)} columns of joints in {block.unit}, but {robot.name} has"
            f" {len(names)} such ({', '.join(names)}): name the joint of each column (names)"
        )
    return names


def _require_within_limits(name: str, q: FloatArray, robot: Robot) -> None:
    low, high = robot.limits.lower, robot.limits.upper
    slack = _BEYOND_LIMITS * np.where(np.isfinite(high - low), high - low, 0.0)
    with np.errstate(invalid="ignore"):
        outside = (q < low - slack) | (q > high + slack)
    if outside.any():
        row, joint = np.argwhere(outside)[0].tolist()
        unit = "rad" if robot.revolute[joint] else "m"
        raise LogError(
            f"{name}: row {row + 1} of the data: {robot.joint_names[joint]} at"
            f" {q[row, joint]:.4g} {unit} is far outside its limits {low[joint]:.4g} to"
            f" {high[joint]:.4g} {unit}: is the unit right?"
        )


def _wrench(entry: LogEntry, table: LogTable, time: FloatArray) -> WrenchStream:
    sign = 1.0 if entry.acts_on == "robot" else -1.0
    force = sign * vectors(table, present(entry.force, "force"), "force")
    moment = np.zeros_like(force)
    if entry.moment is not None:
        moment = sign * vectors(table, entry.moment, "moment")
    ok = np.asarray(np.isfinite(np.hstack([force, moment])).all(axis=1))
    return WrenchStream(time, force, moment, np.full(len(time), np.nan), ok)


def _points(entry: LogEntry, table: LogTable, time: FloatArray) -> tuple[PointStream, FloatArray]:
    """Return the marker of a log, of several on one body its centre, and each of them."""
    position = np.stack([vectors(table, each, "length") for each in entry.markers], axis=1)
    sigma = np.stack([_marker_sigma(table, each) for each in entry.markers], axis=1)
    centre = position[:, 0] if len(entry.markers) == 1 else body_centre(position, table.name)
    with np.errstate(invalid="ignore"):
        mean = np.sqrt((sigma**2).mean(axis=1) / sigma.shape[1])
    return PointStream(time, centre, mean, np.full(len(time), entry.station)), position


def _marker_sigma(table: LogTable, marker: MarkerColumns) -> FloatArray:
    if marker.u95 is None:
        return np.full((len(table), 3), np.nan)
    return vectors(table, marker.u95, "length") / _K


def body_centre(position: FloatArray, name: str = "markers") -> FloatArray:
    """Return the centre of the markers of a rigid body, also where some are hidden.

    The body's shape is the mean of the samples that see all markers, each brought onto the first by
    the best rotation (Kabsch, Acta Crystallographica A32, 1976); where three or more are seen it is
    fitted to them.

    Parameters
    ----------
    position : ndarray, shape (sample, marker, 3)
        In m; NaN where a marker is hidden.
    name : str
        For the message.

    Returns
    -------
    ndarray, shape (sample, 3)
        NaN where fewer than three are seen, of two markers where one is hidden.

    Raises
    ------
    LogError
        If no sample sees all markers.
    """
    seen = np.asarray(np.isfinite(position).all(axis=2))
    whole = np.asarray(seen.all(axis=1))
    if not whole.any():
        raise LogError(f"{name}: no row sees all {position.shape[1]} markers of the body")
    centre = np.full((len(position), 3), np.nan)
    centre[whole] = position[whole].mean(axis=1)
    shapes = position[whole] - centre[whole, None]
    turns = _rotations(np.broadcast_to(shapes[0], shapes.shape), shapes)
    shape = np.einsum("sji,smj->smi", turns, shapes).mean(axis=0)
    for pattern in np.unique(seen[~whole], axis=0):
        if pattern.sum() < 3:
            continue
        rows = np.flatnonzero((seen == pattern).all(axis=1))
        some, middle = shape[pattern], shape[pattern].mean(axis=0)
        points = position[np.ix_(rows, np.flatnonzero(pattern))]
        found = points.mean(axis=1)
        model = np.broadcast_to(some - middle, points.shape)
        centre[rows] = found - _rotations(model, points - found[:, None]) @ middle
    return centre


def _rotations(model: FloatArray, points: FloatArray) -> FloatArray:
    """Return the rotations that bring centred models onto centred points, shape (sample, 3, 3)."""
    return nearest_rotation(np.einsum("smi,smj->sij", points, model))
