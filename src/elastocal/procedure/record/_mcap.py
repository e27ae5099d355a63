"""The form of stream files: MCAP containers, and samples as JSON messages in them.

The `mcap` package writes and reads the containers; what it takes beside messages packed by hand is
measured in ``benchmarks/record.py``.

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
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from io import BytesIO
from operator import itemgetter
from pathlib import Path

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

from elastocal.arrays import FloatArray
from elastocal.cell import ArmState, PointBlock, WrenchBlock
from elastocal.errors import SchemaError
from elastocal.files import Limit, read_bytes, write_bytes

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
"""What the libraries raise for damage; to a user all of it means the same."""


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
    """Return what a file holds, in its chunks and beside them."""
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


def schemas(joint_names: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Return name and text of the JSON schema of each topic.

    Parameters
    ----------
    joint_names : sequence of str
        Joints, which are the keys of ``q``.
    """
    fields: dict[str, tuple[str, dict[str, object]]] = {
        ARM: (
            "elastocal.ArmState",
            {
                "q": _object(
                    "joint positions of the controller, in rad (m if prismatic)", joint_names
                ),
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
    numbers = np.hstack([np.array([state.q for state in states]), poses[:, :3, 3], quaternions])
    keys = ",".join(json.dumps(name) + ":" + _HERE for name in joint_names)
    head = f'{{"q":{{{keys}}},"position":{_XYZ},"orientation":{_XYZW}'
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


# These texts hardly ever change from one look at a device to the next.
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
