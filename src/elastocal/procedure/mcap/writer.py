"""Write an MCAP file: compressed chunks in order of time, then the index that viewers jump by."""

import struct
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Statistics,
)

from elastocal.files import replacing
from elastocal.procedure.mcap.topic import MAGIC, MESSAGE, RECORD, TimeArray, Topic

CHUNK = 4096
"""Messages in a chunk: half a megabyte of JSON, which is what viewers load at a time."""
LEVEL = 1
"""Of the compression: the fastest; higher ones save a tenth of the size for twice the time."""

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
"""`RECORD` and `MESSAGE` of many messages at once."""
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
    messages, described = _merged(topics), _descriptions(topics)
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


def _descriptions(topics: Sequence[Topic]) -> bytes:
    """Return schema and channel of every topic, with which each chunk begins."""
    return _records(*_descriptive(topics))


def _descriptive(topics: Sequence[Topic]) -> Iterator[McapRecord]:
    for number, topic in enumerate(topics, start=1):
        yield topic.schema_record(number)
        yield topic.channel_record(number)


def _chunk(messages: _Messages, described: bytes, offset: int) -> tuple[bytes, ChunkIndex]:
    """Return a chunk with its message indexes, as written at ``offset``, and its index entry."""
    lengths = np.array([len(message) for message in messages.data])
    data = described + _framed(messages, lengths)
    first, last = int(messages.time[0]), int(messages.time[-1])
    packed = zstandard.compress(data, LEVEL)
    chunk = _records(Chunk("zstd", packed, last, first, zlib.crc32(data), len(data)))
    starts = len(described) + np.cumsum(lengths + _HEAD.itemsize) - lengths - _HEAD.itemsize
    indexes, offsets = b"", {}
    for number in np.unique(messages.channel).tolist():
        mine = messages.channel == number
        offsets[number] = offset + len(chunk) + len(indexes)
        pairs = np.stack([messages.time[mine], starts[mine]], axis=1).astype("<u8").tobytes()
        head = RECORD.pack(Opcode.MESSAGE_INDEX, _INDEX.size + len(pairs))
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
    head["opcode"], head["length"] = int(Opcode.MESSAGE), lengths + MESSAGE.size
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
