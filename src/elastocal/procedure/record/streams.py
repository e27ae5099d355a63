"""Raw streams of one attempt at a pose: recorded to an MCAP file, and read again as arrays.

Raw means as the devices gave it: forces in the sensor's frame with bias and tool weight still in,
marker positions in the frame of the station that measured.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Any, Protocol, TypeVar

import numpy as np
from mcap.records import Metadata
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from elastocal import __version__
from elastocal.arrays import BoolArray, FloatArray
from elastocal.cell import ArmState, PointBlock, SensorStatus, WrenchBlock
from elastocal.errors import ProcedureError, SchemaError
from elastocal.files import Limit
from elastocal.procedure.record._mcap import (
    ARM,
    MARKER,
    MARKS,
    WRENCH,
    Messages,
    TimeArray,
    Topic,
    arm_messages,
    mark_message,
    point_messages,
    read_mcap,
    schemas,
    wrench_messages,
    write_mcap,
)
from elastocal.procedure.record.folder import file_sha256
from elastocal.records import check_schema, parse_json
from elastocal.results import brief_repr

STREAMS_SCHEMA = "elastocal.streams/1"
SAME_TIME = 1e-6
"""Times that differ by less are equal, in s: clocks of floating point, logs of nanoseconds."""
_METADATA = "elastocal"
"""Name of the metadata record that carries the schema."""
_NANOSECONDS = 1e9
"""In a second."""
_DAMAGE = (ValueError, TypeError, LookupError, AttributeError, OverflowError, RecursionError)
"""What JSON of another shape, of other types, of endless numbers or brackets raises."""

_MOST_VALUES = Limit("ELASTOCAL_MAX_STREAM_VALUES", 20_000_000, "values")
"""Of a topic; ten times as many as of a document: an hour of a pose takes 3 million."""

_Stream = TypeVar("_Stream")


@dataclass(frozen=True)
class Mark:
    """Something that happened."""

    time: float
    """In s of the clock."""
    text: str


class StreamRecorder(Protocol):
    """Keeps the raw streams of one attempt; `PoseRecorder` is one."""

    def arm(self, state: ArmState) -> None:
        """Keep a state of the arm."""

    def wrenches(self, block: WrenchBlock) -> None:
        """Keep a block of the force sensor."""

    def points(self, block: PointBlock) -> None:
        """Keep a block of the tracker."""

    def mark(self, time: float, text: str) -> None:
        """Keep a remark."""

    def save(self, path: Path) -> str | None:
        """Write everything, atomically, and wait until it is on the disk.

        Returns
        -------
        str or None
            SHA-256 of the file, for the journal; None from a recorder that keeps none.
        """


class PoseRecorder:
    """Collects what the devices say during one pose attempt; `save` writes it.

    Make a new one for each attempt. States and blocks are kept as they are given: they must not
    change afterwards. Empty blocks are welcome; a beam or a sensor that changes its state becomes
    a mark.

    Parameters
    ----------
    joint_names : sequence of str
        Joints of the arm, in the order of ``q``.
    """

    def __init__(self, joint_names: Sequence[str]) -> None:
        self._joint_names = tuple(joint_names)
        self._arm: list[ArmState] = []
        self._wrenches: list[WrenchBlock] = []
        self._points: list[PointBlock] = []
        self._marks: list[Mark] = []
        self._condition: dict[str, str] = {}

    def arm(self, state: ArmState) -> None:
        """Keep a state of the arm; one that was kept last is not kept twice."""
        if not self._arm or state.time != self._arm[-1].time:
            self._arm.append(state)

    def wrenches(self, block: WrenchBlock) -> None:
        """Keep the samples of a force sensor."""
        self._note("sensor", block.status.value)
        if len(block):
            self._wrenches.append(block)

    def points(self, block: PointBlock) -> None:
        """Keep the samples of a tracker."""
        self._note(f"beam of station {block.station}", block.beam.value)
        if len(block):
            self._points.append(block)

    def mark(self, time: float, text: str) -> None:
        """Keep a remark."""
        self._marks.append(Mark(time, text))

    def save(self, path: Path) -> str:
        """Write everything to an MCAP file, atomically and to the disk.

        Returns
        -------
        str
            SHA-256 of the file.

        Raises
        ------
        ProcedureError
            If a device's time is not a number, or negative.
        FileAccessError
            If the file cannot be written.
        """
        joints = json.dumps(self._joint_names)
        note = Metadata(name=_METADATA, metadata={"schema": STREAMS_SCHEMA, "joints": joints})
        write_mcap(path, self._topics(), f"elastocal {__version__}", note)
        return file_sha256(path)

    def _note(self, what: str, condition: str) -> None:
        """Mark a condition that changed; an empty block has no time, so the arm's is taken."""
        if self._condition.get(what, "") != condition:
            self._condition[what] = condition
            self.mark(self._arm[-1].time if self._arm else 0.0, f"{what}: {condition}")

    def _topics(self) -> list[Topic]:
        texts = {
            ARM: arm_messages(self._arm, self._joint_names),
            WRENCH: wrench_messages(self._wrenches),
            MARKER: point_messages(self._points),
            MARKS: [mark_message(mark.text) for mark in self._marks],
        }
        times = {
            ARM: np.array([state.time for state in self._arm]),
            WRENCH: _joined([block.time for block in self._wrenches]),
            MARKER: _joined([block.time for block in self._points]),
            MARKS: np.array([mark.time for mark in self._marks]),
        }
        return [
            Topic(topic, name, schema, _nanoseconds(topic, times[topic]), texts[topic])
            for topic, (name, schema) in schemas(self._joint_names).items()
        ]


def _nanoseconds(topic: str, time: FloatArray) -> TimeArray:
    wrong = time[~((time >= 0.0) & (time < 2.0**63 / _NANOSECONDS))]
    if len(wrong):
        raise ProcedureError(f"{topic}: time {wrong[0]} s cannot be recorded: it must be 0 or more")
    return np.rint(time * _NANOSECONDS).astype(np.int64)


def _joined(arrays: Sequence[FloatArray]) -> FloatArray:
    return np.concatenate(arrays) if arrays else np.empty(0)


@brief_repr
@dataclass(frozen=True, eq=False)
class ArmStream:
    """States of the arm, as the controller says them."""

    time: FloatArray
    """Shape (sample,), in s of the clock."""
    q: FloatArray
    """Joint positions, shape (sample, joint), in rad or m."""
    T_base_tcp: FloatArray
    """Tool frame, shape (sample, 4, 4), in m."""


@brief_repr
@dataclass(frozen=True, eq=False)
class WrenchStream:
    """Raw wrenches, in the sensor's frame, bias and tool weight still in."""

    time: FloatArray
    """Shape (sample,), in s of the clock."""
    force: FloatArray
    """Shape (sample, 3), in N."""
    moment: FloatArray
    """About the sensor's origin, shape (sample, 3), in N·m."""
    force_sigma: FloatArray
    """Standard deviation of one sample and axis by the maker, shape (sample,), in N; NaN where
    not known."""
    ok: BoolArray
    """Whether the sensor called the sample good, shape (sample,)."""


@brief_repr
@dataclass(frozen=True, eq=False)
class PointStream:
    """Marker positions in the frame of the station that measured them."""

    time: FloatArray
    """Shape (sample,), in s of the clock."""
    position: FloatArray
    """Shape (sample, 3), in m."""
    sigma: FloatArray
    """Standard deviation of one sample by the maker, shape (sample, 3), in m; NaN where not
    known."""
    station: NDArray[np.str_]
    """Station of each sample, shape (sample,)."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Streams:
    """All samples of the devices during one pose attempt; the arrays are read-only."""

    joint_names: tuple[str, ...]
    arm: ArmStream
    wrench: WrenchStream
    points: PointStream
    marks: tuple[Mark, ...]


def read_streams(path: Path, spans: Sequence[tuple[float, float]] | None = None) -> Streams:
    """Return the raw streams of a pose attempt.

    Parameters
    ----------
    path : Path
        A file that `PoseRecorder.save` wrote.
    spans : sequence of (float, float), optional
        Starts and ends in s of the clock, to read nothing else: most of the time at a pose goes
        by between its windows. Default: everything.

    Raises
    ------
    FileAccessError
        If it cannot be read.
    SchemaError
        If it is no such file, cut off or damaged.
    """
    contents = read_mcap(path)
    note = contents.metadata.get(_METADATA, {})
    check_schema(note.get("schema"), STREAMS_SCHEMA, str(path))
    joints = _joints(path, note)

    def topic(name: str, make: Callable[[FloatArray, list[Any]], _Stream]) -> _Stream:
        try:
            return make(*_parsed(contents.topics.get(name, Messages()), spans))
        except _DAMAGE as error:
            kind = "" if isinstance(error, SchemaError) else f"{type(error).__name__} "
            reason = f"{kind}{' '.join(str(error).split())}"
            message = f"{path}: {name} holds a message that is not ours: {reason}"
            raise SchemaError(message) from error

    return Streams(
        joints,
        topic(ARM, lambda time, messages: _arm_stream(time, messages, joints)),
        topic(WRENCH, _wrench_stream),
        topic(MARKER, _point_stream),
        topic(MARKS, _marks),
    )


def _joints(path: Path, note: Mapping[str, str]) -> tuple[str, ...]:
    try:
        return tuple(map(str, parse_json(note["joints"], str(path))))
    except _DAMAGE as error:
        raise SchemaError(f"{path}: its metadata do not name the joints of the arm") from error


def _parsed(
    messages: Messages, spans: Sequence[tuple[float, float]] | None
) -> tuple[FloatArray, list[Any]]:
    """Return times in s and parsed messages of a topic."""
    time, data = np.array(messages.time, dtype=float) / _NANOSECONDS, messages.data
    if spans is not None:
        inside = np.zeros(len(time), dtype=bool)
        for start, end in spans:
            inside |= (time >= start - SAME_TIME) & (time <= end + SAME_TIME)
        time, data = time[inside], [data[row] for row in np.flatnonzero(inside).tolist()]
    # One parse of all of them is several times as quick as one each.
    whole = b"[" + b",".join(data) + b"]"
    parsed: list[Any] = parse_json(whole, "its text", most=_MOST_VALUES)
    return time, parsed


def _arm_stream(time: FloatArray, messages: list[Any], joints: tuple[str, ...]) -> ArmStream:
    T = np.zeros((len(messages), 4, 4))
    T[:, 3, 3] = 1.0
    T[:, :3, 3] = _columns(messages, "position", "xyz")
    if messages:
        quaternions = _columns(messages, "orientation", "xyzw")
        T[:, :3, :3] = Rotation.from_quat(quaternions).as_matrix()
    return ArmStream(_frozen(time), _frozen(_columns(messages, "q", joints)), _frozen(T))


def _wrench_stream(time: FloatArray, messages: list[Any]) -> WrenchStream:
    ok = np.array([message["status"] == SensorStatus.OK.value for message in messages], dtype=bool)
    ok.setflags(write=False)
    sigma = np.array([message["force_sigma"] for message in messages], dtype=float)
    force, moment = (_columns(messages, key, "xyz") for key in ("force", "moment"))
    return WrenchStream(_frozen(time), _frozen(force), _frozen(moment), _frozen(sigma), ok)


def _point_stream(time: FloatArray, messages: list[Any]) -> PointStream:
    station = np.array([message["station"] for message in messages], dtype=np.str_)
    station.setflags(write=False)
    position, sigma = (_columns(messages, key, "xyz") for key in ("position", "sigma"))
    return PointStream(_frozen(time), _frozen(position), _frozen(sigma), station)


def _marks(time: FloatArray, messages: list[Any]) -> tuple[Mark, ...]:
    texts = (str(message["text"]) for message in messages)
    return tuple(Mark(*mark) for mark in zip(time.tolist(), texts, strict=True))


def _columns(messages: list[Any], key: str, names: Sequence[str]) -> FloatArray:
    """Return the numbers under a key, shape (message, name); null becomes NaN."""
    if not messages or not names:
        return np.empty((len(messages), len(names)))
    pick = itemgetter(*names)
    return np.array([pick(message[key]) for message in messages], dtype=float).reshape(
        len(messages), -1
    )


def _frozen(array: FloatArray) -> FloatArray:
    array.setflags(write=False)
    return array
