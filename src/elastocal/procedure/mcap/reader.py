"""Read an MCAP file whole: messages by topic, in order of time."""

import struct
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, DataEnd, Metadata
from mcap.stream_reader import get_chunk_data_stream

from elastocal.errors import FileAccessError, SchemaError
from elastocal.procedure.mcap.topic import MAGIC, MESSAGE, RECORD


@dataclass
class Messages:
    """Messages of one topic."""

    time: list[int] = field(default_factory=list)
    """In ns."""
    data: list[bytes] = field(default_factory=list)


@dataclass(frozen=True)
class Contents:
    """What a file holds."""

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
        position += RECORD.size + len(body)
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
        number, _, time, _ = MESSAGE.unpack_from(body)
        if number not in names:
            raise ValueError(f"a message is of channel {number}, which is not described before it")
        messages = topics[names[number]]
        messages.time.append(time)
        messages.data.append(body[MESSAGE.size :])

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
    position, unpack, size = 0, RECORD.unpack_from, RECORD.size
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
