"""Raw streams of one attempt at a pose: recorded to an MCAP file, and read again as arrays.

Raw means as the devices gave it: forces in the sensor's frame with bias and tool weight still in,
marker positions in the frame of the station that measured.

Files are MCAP containers with samples as JSON messages in them. The `mcap` package writes and reads
the containers; what it takes beside messages packed by hand is measured in
``benchmarks/record.py``.

One message a sample, because that is what both viewers draw: Foxglove plots ``/wrench.force.z``
and PlotJuggler lists ``/wrench/force/z``. A block of samples as arrays would be three times as
quick to write, but PlotJuggler makes a series of each array place, a hundred a block.
Numbers have 12 digits: finer than any instrument, and nearly three times as quick to write as all
17. What is not a finite number is null, whatever the schema says.
"""

import json
import math
import struct
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from io import BytesIO
from operator import itemgetter
from pathlib import Path
from typing import Any, Protocol, TypeVar

import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, DataEnd, Metadata
from mcap.stream_reader import CRCValidationError, get_chunk_data_stream
from mcap.writer import Writer
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from elastocal import __version__
from elastocal.arrays import BoolArray, FloatArray
from elastocal.cell import ArmState, PointBlock, SensorStatus, WrenchBlock
from elastocal.errors import ProcedureError, SchemaError
from elastocal.files import Limit, read_bytes, write_bytes
from elastocal.procedure.record.folder import file_sha256
from elastocal.records import check_schema, parse_json
from elastocal.results import brief_repr

TimeArray = NDArray[np.int64]
"""Times in ns."""

_MAGIC = b"\x89MCAP0\r\n"
"""First and last bytes of a file."""
_CHUNK = 512 * 1024
"""Bytes of a chunk before it is compressed: as much as viewers load at a time."""

_RECORD, _MESSAGE = struct.Struct("<BQ"), struct.Struct("<HIQQ")
"""Opcode and length of a record; of a message: channel, sequence, log time, publish time."""
_MOST_UNPACKED = Limit("ELASTOCAL_MAX_STREAM_MB", 256, "MB")
"""An hour of a pose, at the rates of the simulated devices, takes a tenth."""
_MEGABYTE = 1_000_000
_DAMAGE = (
    McapError,
    ValueError,
    OverflowError,
    RuntimeError,
    MemoryError,
    LookupError,
    struct.error,
    zstandard.ZstdError,
)
"""Exceptions of the libraries for damage; for a user all of them mean the same."""


@dataclass(frozen=True, eq=False)
class Topic:
    """One channel with all its messages."""

    name: str
    schema_name: str
    schema: str
    """JSON schema of a message."""
    time: TimeArray
    """Log time of each message, shape (message,), in ns."""
    messages: Sequence[bytes]
    """JSON objects, one a time."""


def write_mcap(path: Path, topics: Sequence[Topic], library: str, metadata: Metadata) -> None:
    """Write topics to a file, atomically and to the disk.

    Parameters
    ----------
    path : Path
        The file.
    topics : sequence of Topic
        What it holds.
    library : str
        Who writes it.
    metadata : Metadata
        Key and value texts, by which the file is known again.

    Raises
    ------
    FileAccessError
        If it cannot be written.
    """
    buffer, messages = BytesIO(), []
    writer = Writer(buffer, chunk_size=_CHUNK, enable_data_crcs=True)
    writer.start(library=library)
    writer.add_metadata(metadata.name, metadata.metadata)
    for topic in topics:
        schema = writer.register_schema(topic.schema_name, "jsonschema", topic.schema.encode())
        channel = writer.register_channel(topic.name, "json", schema)
        pairs = zip(topic.time.tolist(), topic.messages, strict=True)
        messages += [(time, channel, row, data) for row, (time, data) in enumerate(pairs)]
    for time, channel, row, data in sorted(messages, key=itemgetter(0)):
        writer.add_message(channel, time, data, publish_time=time, sequence=row)
    writer.finish()  # type: ignore[no-untyped-call]
    write_bytes(path, buffer.getbuffer())


@dataclass
class Messages:
    """Messages of one topic."""

    time: list[int] = field(default_factory=list)
    """In ns."""
    data: list[bytes] = field(default_factory=list)


@dataclass(frozen=True)
class Contents:
    """Contents of a file."""

    metadata: Mapping[str, Mapping[str, str]]
    """Key and value texts by the name of their record."""
    topics: Mapping[str, Messages]
    """Messages in order of time, by topic."""


def read_mcap(path: Path) -> Contents:
    """Return the messages and the metadata of a file, checked by its checksums.

    Raises
    ------
    FileAccessError
        If it cannot be read.
    SchemaError
        If it is no MCAP file, cut off or damaged.
    """
    data = read_bytes(path)
    if not data.startswith(_MAGIC):
        raise SchemaError(f"{path} is not an MCAP file: it does not begin with the MCAP signature")
    if not data.endswith(_MAGIC) or len(data) == len(_MAGIC):
        raise SchemaError(f"{path} is cut off: it does not end with the MCAP signature")
    try:
        return _contents(data)
    except _DAMAGE as error:
        wrong_sum = isinstance(error, CRCValidationError)
        reason = "its checksum is wrong" if wrong_sum else " ".join(str(error).split())
        reason = reason or type(error).__name__
        raise SchemaError(f"{path} is a damaged MCAP file: {reason}") from error


def _contents(data: bytes) -> Contents:
    """Return the data of a file, in its chunks and beside them."""
    metadata: dict[str, Mapping[str, str]] = {}
    topics: dict[str, Messages] = {}
    channels: dict[int, Messages] = {}
    for part in _unpacked(data):
        for opcode, begin, end in _framed(part):
            if opcode == Opcode.MESSAGE:
                number, _, time, _ = _MESSAGE.unpack_from(part, begin)
                if number not in channels:
                    raise ValueError(
                        f"a message is of channel {number}, which is not described before it"
                    )
                channels[number].time.append(time)
                channels[number].data.append(part[begin + _MESSAGE.size : end])
            elif opcode == Opcode.CHANNEL:
                channel = Channel.read(_stream(part, begin, end))
                channels[channel.id] = topics.setdefault(channel.topic, Messages())
            elif opcode == Opcode.METADATA:
                found = Metadata.read(_stream(part, begin, end))
                metadata[found.name] = found.metadata
    return Contents(metadata, {name: _in_order(each) for name, each in topics.items()})


def _unpacked(data: bytes) -> Iterator[bytes]:
    """Yield the records of a file in pieces: what its chunks hold, and each of the others."""
    # Chunks stay packed until the checksum of all of them is known to be right: a damaged one may
    # ask for more memory than there is. Tools that do not make a checksum write 0; it passes.
    inside = memoryview(data)[len(_MAGIC) : -len(_MAGIC)]
    records = list(_framed(inside))
    ends = [each for each in records if each[0] == Opcode.DATA_END]
    if not ends:
        raise ValueError("its data have no end")
    for _, begin, end in ends:
        stated = DataEnd.read(_stream(inside, begin, end))
        actual = zlib.crc32(data[: len(_MAGIC) + begin - _RECORD.size])
        if stated.data_section_crc not in (0, actual):
            raise CRCValidationError(stated.data_section_crc, actual, stated)
    unpacked = 0.0
    for opcode, begin, end in records:
        if opcode == Opcode.CHUNK:
            chunk = Chunk.read(_stream(inside, begin, end))
            unpacked += _unpacked_size(chunk) / _MEGABYTE
            _MOST_UNPACKED.require(unpacked, "what its chunks hold when they are unpacked")
            stream, size = get_chunk_data_stream(chunk, validate_crc=True)
            yield stream.read(size)
        else:
            yield bytes(inside[begin - _RECORD.size : end])


def _framed(data: bytes | memoryview) -> Iterator[tuple[int, int, int]]:
    """Yield opcode, begin and end of each record; messages are not read number by number."""
    at, size = 0, len(data)
    while at < size:
        opcode, length = _RECORD.unpack_from(data, at)
        begin, at = at + _RECORD.size, at + _RECORD.size + length
        if at > size:
            raise ValueError("a record is longer than what holds it")
        yield opcode, begin, at


def _stream(data: bytes | memoryview, begin: int, end: int) -> ReadDataStream:
    """Return the contents of a record as the package reads them."""
    return ReadDataStream(BytesIO(data[begin:end]))


def _unpacked_size(chunk: Chunk) -> int:
    """Return the bytes that a chunk may take unpacked: what it states, and what its frame does."""
    packed = chunk.data if chunk.compression == "zstd" else b""
    frame = zstandard.get_frame_parameters(packed).content_size if packed else 0
    unknown = frame in (zstandard.CONTENTSIZE_UNKNOWN, zstandard.CONTENTSIZE_ERROR)
    return max(chunk.uncompressed_size, 0 if unknown else frame)


def _in_order(messages: Messages) -> Messages:
    order = sorted(range(len(messages.time)), key=messages.time.__getitem__)
    time, data = messages.time, messages.data
    return Messages([time[row] for row in order], [data[row] for row in order])


ARM, WRENCH, MARKER, MARKS = "/arm", "/wrench", "/marker", "/marks"
"""Topics, in the order of their channels."""

_NUMBER = {"type": "number"}
"""Not ``["number", "null"]``: one type a field is what every viewer's schema reader knows."""
_HERE = "\0"
"""Place of a number; no JSON text holds this letter."""
_XYZ = f'{{"x":{_HERE},"y":{_HERE},"z":{_HERE}}}'
_XYZW = f'{_XYZ[:-1]},"w":{_HERE}}}'


def schemas(joint_names: Sequence[str], links: bool = False) -> dict[str, tuple[str, str]]:
    """Return name and text of the JSON schema of each topic.

    Parameters
    ----------
    joint_names : sequence of str
        Joints, which are the keys of ``q``.
    links : bool
        Whether the arm has secondary encoders.
    """
    link = _object("links by secondary encoders, in rad (m if prismatic)", joint_names)
    fields: dict[str, tuple[str, dict[str, object]]] = {
        ARM: (
            "elastocal.ArmState",
            {
                "q": _object(
                    "joint positions of the controller, in rad (m if prismatic)", joint_names
                ),
                **({"link": link} if links else {}),
                "position": _object("tcp of the controller in base, in m", "xyz"),
                "orientation": _object("tcp of the controller in base, quaternion", "xyzw"),
                "motion": _text("what the arm is doing"),
                "in_contact": {"type": "boolean", "description": "touched, not yet retracted"},
                "fault": _text("why it stopped; empty when nothing is wrong"),
                "source": _text("device"),
            },
        ),
        WRENCH: (
            "elastocal.RawWrench",
            {
                "force": _object("on the tool side, sensor frame, raw, in N", "xyz"),
                "moment": _object("about the sensor's origin, raw, in N m", "xyz"),
                "force_sigma": {**_NUMBER, "description": "of one sample and axis, in N"},
                "moment_sigma": {**_NUMBER, "description": "of one sample and axis, in N m"},
                "status": _text("state of the sensor"),
                "source": _text("device"),
            },
        ),
        MARKER: (
            "elastocal.MarkerPoint",
            {
                "position": _object("of the marker, tracker frame, in m", "xyz"),
                "sigma": _object("standard deviation, tracker frame, in m", "xyz"),
                "station": _text("tracker station"),
                "beam": _text("state of the beam"),
                "source": _text("device"),
            },
        ),
        MARKS: ("elastocal.Mark", {"text": _text("what happened")}),
    }
    return {topic: (name, json.dumps(_schema(keys))) for topic, (name, keys) in fields.items()}


def arm_messages(states: Sequence[ArmState], joint_names: Sequence[str]) -> list[bytes]:
    """Return a message for each state of the arm."""
    if not states:
        return []
    poses = np.array([state.T_base_tcp for state in states])
    quaternions = Rotation.from_matrix(poses[:, :3, :3]).as_quat()
    keys = ",".join(json.dumps(name) + ":" + _HERE for name in joint_names)
    head, joints = f'{{"q":{{{keys}}}', [np.array([state.q for state in states])]
    if has_links(states):
        head += f',"link":{{{keys}}}'
        unread = np.full(len(joint_names), np.nan)
        joints.append(np.array([unread if s.link is None else s.link for s in states]))
    head += f',"position":{_XYZ},"orientation":{_XYZW}'
    numbers = np.hstack([*joints, poses[:, :3, 3], quaternions])
    tails = [
        _tail(
            motion=state.motion.value,
            in_contact=bool(state.in_contact),
            fault=state.fault or "",
            source=state.source,
        )
        for state in states
    ]
    return _joined(head, numbers, tails)


def has_links(states: Sequence[ArmState]) -> bool:
    """Return whether any state holds positions by secondary encoders."""
    return any(state.link is not None for state in states)


def wrench_messages(blocks: Sequence[WrenchBlock]) -> list[bytes]:
    """Return a message for each wrench of some blocks."""
    rows, tails = [np.empty((0, 6))], []
    for block in blocks:
        rows.append(np.hstack([block.force, block.moment]))
        force, moment = _finite(block.force_sigma), _finite(block.moment_sigma)
        status, source = block.status.value, block.source
        tail = _tail(force_sigma=force, moment_sigma=moment, status=status, source=source)
        tails += [tail] * len(block)
    return _joined(f'{{"force":{_XYZ},"moment":{_XYZ}', np.vstack(rows), tails)


def point_messages(blocks: Sequence[PointBlock]) -> list[bytes]:
    """Return a message for each point of some blocks."""
    rows, tails = [np.empty((0, 6))], []
    for block in blocks:
        rows.append(np.hstack([block.position, block.sigma]))
        tail = _tail(station=block.station, beam=block.beam.value, source=block.source)
        tails += [tail] * len(block)
    return _joined(f'{{"position":{_XYZ},"sigma":{_XYZ}', np.vstack(rows), tails)


def mark_message(text: str) -> bytes:
    """Return the message of a mark."""
    return json.dumps({"text": text}).encode()


# These texts hardly ever change between readings of a device.
@lru_cache(maxsize=64)
def _tail(**keys: object) -> str:
    """Return the end of a JSON object, from the comma on."""
    return "," + json.dumps(keys)[1:]


def _joined(head: str, numbers: FloatArray, tails: Sequence[str]) -> list[bytes]:
    """Return JSON objects: the numbers of a row in their places of ``head``, then the tail."""
    head, rows = head.replace("%", "%%"), numbers.tolist()
    if np.all(np.isfinite(numbers)):
        template = head.replace(_HERE, "%.12g")
    else:
        template = head.replace(_HERE, "%s")
        rows = [[_number(value) for value in row] for row in rows]
    return [(template % tuple(row) + tail).encode() for row, tail in zip(rows, tails, strict=True)]


def _number(value: float) -> str:
    return f"{value:.12g}" if math.isfinite(value) else "null"


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _schema(keys: Mapping[str, object]) -> dict[str, object]:
    return {"type": "object", "properties": keys, "required": list(keys)}


def _object(description: str, names: Iterable[str]) -> dict[str, object]:
    return {"description": description, **_schema(dict.fromkeys(names, _NUMBER))}


def _text(description: str) -> dict[str, object]:
    return {"type": "string", "description": description}


STREAMS_SCHEMA = "elastocal.streams/1"
SAME_TIME = 1e-6
"""Times that differ by less are equal, in s: clocks of floating point, logs of nanoseconds."""
_METADATA = "elastocal"
"""Name of the metadata record that carries the schema."""
_NANOSECONDS = 1e9
"""Nanoseconds in a second."""
_BAD_JSON = (ValueError, TypeError, LookupError, AttributeError, OverflowError, RecursionError)
"""Exceptions for JSON of another shape, of other types, or with endless numbers or brackets."""

_MOST_VALUES = Limit("ELASTOCAL_MAX_STREAM_VALUES", 20_000_000, "values")
"""Values of a topic; ten times as many as of a document: an hour of a pose takes 3 million."""

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
            WRENCH: _one_array([block.time for block in self._wrenches]),
            MARKER: _one_array([block.time for block in self._points]),
            MARKS: np.array([mark.time for mark in self._marks]),
        }
        return [
            Topic(topic, name, schema, _nanoseconds(topic, times[topic]), texts[topic])
            for topic, (name, schema) in schemas(self._joint_names, has_links(self._arm)).items()
        ]


def _nanoseconds(topic: str, time: FloatArray) -> TimeArray:
    wrong = time[~((time >= 0.0) & (time < 2.0**63 / _NANOSECONDS))]
    if len(wrong):
        raise ProcedureError(f"{topic}: time {wrong[0]} s cannot be recorded: it must be 0 or more")
    return np.rint(time * _NANOSECONDS).astype(np.int64)


def _one_array(arrays: Sequence[FloatArray]) -> FloatArray:
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
    link: FloatArray | None = None
    """Positions of the links by secondary encoders, shape (sample, joint), in rad or m; NaN at a
    joint without one. None: there are none."""


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
        except _BAD_JSON as error:
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
    except _BAD_JSON as error:
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
    link = None
    if messages and "link" in messages[0]:
        link = _frozen(_columns(messages, "link", joints))
    return ArmStream(_frozen(time), _frozen(_columns(messages, "q", joints)), _frozen(T), link)


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
