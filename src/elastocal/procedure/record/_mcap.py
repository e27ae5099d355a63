"""MCAP files: written in compressed chunks with the index that viewers jump by, and read whole.

The library's records are used for everything but the messages themselves: one Python object a
sample, at thousands of samples a second, would take longer than the pose (see `_framed`).
"""

import struct
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path

import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)
from mcap.stream_reader import get_chunk_data_stream
from numpy.typing import NDArray

from elastocal.errors import FileAccessError, SchemaError
from elastocal.files import replacing

TimeArray = NDArray[np.int64]
"""Times in ns."""

MAGIC = b"\x89MCAP0\r\n"
"""First and last bytes of a file."""
RECORD_HEAD = struct.Struct("<BQ")
"""Head of every record: opcode, length."""
MESSAGE_HEAD = struct.Struct("<HIQQ")
"""Head of a message: channel, sequence, log time, publish time."""


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

    def schema_record(self, number: int) -> Schema:
        """Return the record that describes the messages."""
        data = self.schema.encode()
        return Schema(id=number, name=self.schema_name, encoding="jsonschema", data=data)

    def channel_record(self, number: int) -> Channel:
        """Return the record that names the channel; its schema has the same number."""
        return Channel(
            id=number, topic=self.name, message_encoding="json", metadata={}, schema_id=number
        )


CHUNK = 4096
"""Messages in a chunk: half a megabyte of JSON, which is what viewers load at a time."""
_LEVEL = 1
"""Of zstd, the fastest: higher levels save a tenth of the size for twice the time."""

_HEAD = np.dtype(
    [
        ("opcode", "u1"),
        ("length", "<u8"),
        ("channel", "<u2"),
        ("sequence", "<u4"),
        ("log_time", "<u8"),
        ("publish_time", "<u8"),
    ]
)
"""`RECORD_HEAD` and `MESSAGE_HEAD` of many messages at once."""
_INDEX = struct.Struct("<HI")
"""Head of a message index: channel, bytes that follow."""


@dataclass(frozen=True, eq=False)
class _Messages:
    """Messages of all channels in order of time, a column each."""

    time: TimeArray
    channel: TimeArray
    sequence: TimeArray
    data: Sequence[bytes]

    def __len__(self) -> int:
        return len(self.data)

    def take(self, rows: slice) -> "_Messages":
        return _Messages(self.time[rows], self.channel[rows], self.sequence[rows], self.data[rows])


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
    opening = MAGIC + _records(Header(profile="", library=library))
    note = _records(metadata)
    index = MetadataIndex(offset=len(opening), length=len(note), name=metadata.name)
    data, chunks = bytearray(opening + note), []
    messages, described = _merged(topics), _records(*_descriptive(topics))
    for start in range(0, len(messages), CHUNK):
        chunk, entry = _chunk(messages.take(slice(start, start + CHUNK)), described, len(data))
        data += chunk
        chunks.append(entry)
    data += _records(DataEnd(data_section_crc=zlib.crc32(data)))
    with replacing(path) as temporary:
        temporary.write_bytes(data + _closing(len(data), topics, chunks, index))


def _merged(topics: Sequence[Topic]) -> _Messages:
    counts = [len(topic.messages) for topic in topics]
    none = np.arange(0)
    time = np.concatenate([none, *(topic.time for topic in topics)])
    order = np.argsort(time, kind="stable")
    data = [message for topic in topics for message in topic.messages]
    return _Messages(
        time[order],
        np.repeat(np.arange(1, len(topics) + 1), counts)[order],
        np.concatenate([none, *(np.arange(count) for count in counts)])[order],
        [data[row] for row in order.tolist()],
    )


def _descriptive(topics: Sequence[Topic]) -> Iterator[McapRecord]:
    for number, topic in enumerate(topics, start=1):
        yield topic.schema_record(number)
        yield topic.channel_record(number)


def _chunk(messages: _Messages, described: bytes, offset: int) -> tuple[bytes, ChunkIndex]:
    """Return a chunk with its message indexes, as written at ``offset``, and its index entry."""
    lengths = np.array([len(message) for message in messages.data])
    data = described + _framed(messages, lengths)
    first, last = int(messages.time[0]), int(messages.time[-1])
    packed = zstandard.compress(data, _LEVEL)
    chunk = _records(Chunk("zstd", packed, last, first, zlib.crc32(data), len(data)))
    starts = len(described) + np.cumsum(lengths + _HEAD.itemsize) - lengths - _HEAD.itemsize
    indexes, offsets = b"", {}
    for number in np.unique(messages.channel).tolist():
        mine = messages.channel == number
        offsets[number] = offset + len(chunk) + len(indexes)
        pairs = np.stack([messages.time[mine], starts[mine]], axis=1).astype("<u8").tobytes()
        head = RECORD_HEAD.pack(Opcode.MESSAGE_INDEX, _INDEX.size + len(pairs))
        indexes += head + _INDEX.pack(number, len(pairs)) + pairs
    entry = ChunkIndex(
        chunk_length=len(chunk),
        chunk_start_offset=offset,
        compression="zstd",
        compressed_size=len(packed),
        message_end_time=last,
        message_index_length=len(indexes),
        message_index_offsets=offsets,
        message_start_time=first,
        uncompressed_size=len(data),
    )
    return chunk + indexes, entry


def _framed(messages: _Messages, lengths: TimeArray) -> bytes:
    """Return the message records, one after the other."""
    head = np.empty(len(messages), dtype=_HEAD)
    head["opcode"], head["length"] = int(Opcode.MESSAGE), lengths + MESSAGE_HEAD.size
    head["channel"], head["sequence"] = messages.channel, messages.sequence
    head["log_time"] = head["publish_time"] = messages.time
    raw, size = head.tobytes(), _HEAD.itemsize
    pieces: list[bytes] = []
    for row, message in enumerate(messages.data):
        pieces += (raw[row * size : row * size + size], message)
    return b"".join(pieces)


def _closing(
    start: int, topics: Sequence[Topic], chunks: Sequence[ChunkIndex], metadata: MetadataIndex
) -> bytes:
    """Return the summary section, the footer and the last magic bytes.

    The checksum of the summary covers the footer's first fields (MCAP specification, "Footer").
    """
    statistics = Statistics(
        attachment_count=0,
        channel_count=len(topics),
        channel_message_counts={n: len(t.messages) for n, t in enumerate(topics, start=1)},
        chunk_count=len(chunks),
        message_count=sum(len(topic.messages) for topic in topics),
        message_end_time=max((chunk.message_end_time for chunk in chunks), default=0),
        message_start_time=min((chunk.message_start_time for chunk in chunks), default=0),
        metadata_count=1,
        schema_count=len(topics),
    )
    summary = _records(*_descriptive(topics), statistics, *chunks, metadata)
    footer = _records(Footer(summary_start=start, summary_offset_start=0, summary_crc=0))
    crc = zlib.crc32(summary + footer[:-4])
    return summary + footer[:-4] + struct.pack("<I", crc) + MAGIC


def _records(*records: McapRecord) -> bytes:
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]


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
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise FileAccessError(f"cannot read {path}: {error.strerror or error}") from error
    if not data.startswith(MAGIC):
        raise SchemaError(f"{path} is not an MCAP file: it does not begin with the MCAP signature")
    if not data.endswith(MAGIC) or len(data) == len(MAGIC):
        raise SchemaError(f"{path} is cut off: it does not end with the MCAP signature")
    try:
        _check_sum(data)
        return _contents(data[len(MAGIC) : -len(MAGIC)])
    except (McapError, ValueError, struct.error, zstandard.ZstdError, RuntimeError) as error:
        # What the libraries raise for damage; to a user all of it means the same.
        reason = " ".join(str(error).split()) or type(error).__name__
        raise SchemaError(f"{path} is a damaged MCAP file: {reason}") from error


def _check_sum(data: bytes) -> None:
    """Refuse a file whose data section does not have the checksum that it states."""
    position = len(MAGIC)
    for opcode, body in _split(data[len(MAGIC) : -len(MAGIC)]):
        if opcode == Opcode.DATA_END:
            stated = DataEnd.read(_stream(body)).data_section_crc
            # Tools that do not make a checksum write 0.
            if stated not in (0, zlib.crc32(data[:position])):
                raise ValueError("its checksum is wrong")
            return
        position += RECORD_HEAD.size + len(body)
    raise ValueError("its data have no end")


def _contents(data: bytes) -> Contents:
    names: dict[int, str] = {}
    metadata: dict[str, Mapping[str, str]] = {}
    topics: dict[str, Messages] = {}

    def take_channel(body: bytes) -> None:
        channel = Channel.read(_stream(body))
        names[channel.id] = channel.topic
        topics.setdefault(channel.topic, Messages())

    def take_message(body: bytes) -> None:
        number, _, time, _ = MESSAGE_HEAD.unpack_from(body)
        if number not in names:
            raise ValueError(f"a message is of channel {number}, which is not described before it")
        messages = topics[names[number]]
        messages.time.append(time)
        messages.data.append(body[MESSAGE_HEAD.size :])

    def take_metadata(body: bytes) -> None:
        record = Metadata.read(_stream(body))
        metadata[record.name] = record.metadata

    def take_chunk(body: bytes) -> None:
        stream, length = get_chunk_data_stream(Chunk.read(_stream(body)), validate_crc=True)
        _each(stream.read(length), takers)

    takers: dict[int, Callable[[bytes], None]] = {
        Opcode.CHANNEL: take_channel,
        Opcode.MESSAGE: take_message,
        Opcode.METADATA: take_metadata,
        Opcode.CHUNK: take_chunk,
    }
    _each(data, takers)
    return Contents(metadata, {name: _in_order(found) for name, found in topics.items()})


def _each(data: bytes, takers: Mapping[int, Callable[[bytes], None]]) -> None:
    """Hand the body of every record to what takes its opcode; others are passed over."""
    for opcode, body in _split(data):
        taker = takers.get(opcode)
        if taker is not None:
            taker(body)


def _split(data: bytes) -> Iterator[tuple[int, bytes]]:
    position, unpack, size = 0, RECORD_HEAD.unpack_from, RECORD_HEAD.size
    while position < len(data):
        opcode, length = unpack(data, position)
        position += size
        if position + length > len(data):
            raise ValueError(f"a record of {length} bytes goes beyond the end")
        yield opcode, data[position : position + length]
        position += length


def _stream(body: bytes) -> ReadDataStream:
    return ReadDataStream(BytesIO(body))


def _in_order(messages: Messages) -> Messages:
    order = sorted(range(len(messages.time)), key=messages.time.__getitem__)
    time, data = messages.time, messages.data
    return Messages([time[row] for row in order], [data[row] for row in order])
