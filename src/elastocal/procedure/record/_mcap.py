"""MCAP files: topics written in compressed chunks with the index that viewers jump by, read whole.

The `mcap` package does both; what it takes beside messages packed by hand is measured in
``benchmarks/record.py``.
"""

import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from operator import itemgetter
from pathlib import Path

import numpy as np
import zstandard
from mcap.exceptions import McapError
from mcap.records import Channel, Chunk, DataEnd, McapRecord, Message, Metadata
from mcap.stream_reader import CRCValidationError, StreamReader, breakup_chunk
from mcap.writer import Writer
from numpy.typing import NDArray

from elastocal.errors import FileAccessError, SchemaError
from elastocal.files import replacing

TimeArray = NDArray[np.int64]
"""Times in ns."""

_MAGIC = b"\x89MCAP0\r\n"
"""First and last bytes of a file."""
_CHUNK = 512 * 1024
"""Bytes of a chunk before it is compressed: as much as viewers load at a time."""

_DAMAGE = (
    McapError,
    ValueError,
    OverflowError,
    RuntimeError,
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
    with replacing(path) as temporary:
        temporary.write_bytes(buffer.getbuffer())


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
    if not data.startswith(_MAGIC):
        raise SchemaError(f"{path} is not an MCAP file: it does not begin with the MCAP signature")
    if not data.endswith(_MAGIC) or len(data) == len(_MAGIC):
        raise SchemaError(f"{path} is cut off: it does not end with the MCAP signature")
    try:
        return _contents(_records(data))
    except _DAMAGE as error:
        wrong_sum = isinstance(error, CRCValidationError)
        reason = "its checksum is wrong" if wrong_sum else " ".join(str(error).split())
        reason = reason or type(error).__name__
        raise SchemaError(f"{path} is a damaged MCAP file: {reason}") from error


def _records(data: bytes) -> Iterator[McapRecord]:
    """Yield the records of a file, those within its chunks too."""
    # Chunks stay packed until the checksum of all of them is known to be right: a damaged one may
    # ask for more memory than there is. Tools that do not make a checksum write 0; it passes.
    reader = StreamReader(BytesIO(data), emit_chunks=True, validate_crcs=True)
    records = list(reader.records)
    if not any(isinstance(record, DataEnd) for record in records):
        raise ValueError("its data have no end")
    for record in records:
        if isinstance(record, Chunk):
            yield from breakup_chunk(record, validate_crc=True)
        else:
            yield record


def _contents(records: Iterator[McapRecord]) -> Contents:
    metadata: dict[str, Mapping[str, str]] = {}
    topics: dict[str, Messages] = {}
    channels: dict[int, Messages] = {}
    for record in records:
        if isinstance(record, Message):
            number = record.channel_id
            if number not in channels:
                raise ValueError(
                    f"a message is of channel {number}, which is not described before it"
                )
            channels[number].time.append(record.log_time)
            channels[number].data.append(record.data)
        elif isinstance(record, Channel):
            channels[record.id] = topics.setdefault(record.topic, Messages())
        elif isinstance(record, Metadata):
            metadata[record.name] = record.metadata
    return Contents(metadata, {name: _in_order(each) for name, each in topics.items()})


def _in_order(messages: Messages) -> Messages:
    order = sorted(range(len(messages.time)), key=messages.time.__getitem__)
    time, data = messages.time, messages.data
    return Messages([time[row] for row in order], [data[row] for row in order])
