import io
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Metadata
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from elastocal.errors import FileAccessError, SchemaError
from elastocal.procedure.record.streams import Topic, read_mcap, write_mcap

COUNT = 12_000
"""Of the messages of /a: with those of /b they need two chunks, and the first holds all of /b."""
SCHEMA = json.dumps({"type": "object", "properties": {"x": {"type": "number"}}})


def topic(name: str, time: np.ndarray) -> Topic:
    messages = [json.dumps({"x": int(t)}).encode() for t in time]
    return Topic(name, f"test.{name[1:]}", SCHEMA, time, messages)


@pytest.fixture
def path(tmp_path):
    """Two topics whose messages interleave, in more than one chunk."""
    topics = [topic("/a", np.arange(0, 2 * COUNT, 2)), topic("/b", np.arange(1, COUNT, 3))]
    path = tmp_path / "a.mcap"
    write_mcap(path, topics, "test", Metadata(name="note", metadata={"key": "value"}))
    return path


def test_what_is_written_is_read_again(path):
    contents = read_mcap(path)
    assert contents.metadata == {"note": {"key": "value"}}
    assert contents.topics["/a"].time == list(range(0, 2 * COUNT, 2))
    assert contents.topics["/b"].data[1] == b'{"x": 4}'


def test_the_librarys_own_reader_finds_every_message_by_the_index(path):
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert len(summary.chunk_indexes) > 1
        counts = summary.statistics.channel_message_counts
        found = [(c.topic, m.log_time, m.data) for _, c, m in reader.iter_messages()]
        metadata = list(reader.iter_metadata())
    assert counts == {1: COUNT, 2: len(range(1, COUNT, 3))}
    assert len(found) == sum(counts.values())
    assert [time for _, time, _ in found] == sorted(time for _, time, _ in found)
    assert all(json.loads(data)["x"] == time for _, time, data in found)
    assert metadata[0].metadata == {"key": "value"}


def test_the_message_index_points_at_the_messages(path):
    """A viewer that jumps reads single messages by their offset in the chunk."""
    with path.open("rb") as file:
        records = list(StreamReader(file, emit_chunks=True).records)
    kinds = [type(record).__name__ for record in records]
    assert kinds.count("MessageIndex") == 3  # the second chunk holds one topic only
    import zstandard

    chunk = records[kinds.index("Chunk")]
    data = zstandard.decompress(chunk.data, chunk.uncompressed_size)
    for index in (r for r in records[: kinds.index("Chunk") + 3] if hasattr(r, "records")):
        for time, offset in index.records:
            assert data[offset] == 5
            assert int.from_bytes(data[offset + 9 : offset + 11], "little") == index.channel_id
            assert int.from_bytes(data[offset + 15 : offset + 23], "little") == time


def test_no_message_at_all_makes_a_valid_file(tmp_path):
    path = tmp_path / "a.mcap"
    write_mcap(path, [topic("/a", np.arange(0))], "test", Metadata(name="n", metadata={}))
    assert read_mcap(path).topics["/a"].data == []
    with path.open("rb") as file:
        assert make_reader(file).get_summary().statistics.message_count == 0


@pytest.mark.parametrize("compression", list(CompressionType))
def test_files_that_a_tool_has_written_anew_are_read(path, compression):
    copy, buffer = path.with_suffix(".copy"), io.BytesIO()
    writer = Writer(buffer, compression=compression)
    writer.start()
    schema = writer.register_schema("test.a", "jsonschema", SCHEMA.encode())
    channel = writer.register_channel("/a", "json", schema)
    for time in (3, 1, 2):
        writer.add_message(channel, time, json.dumps({"x": time}).encode(), time)
    writer.finish()
    copy.write_bytes(buffer.getvalue())
    assert read_mcap(copy).topics["/a"].time == [1, 2, 3]


@pytest.mark.parametrize("part", [0.0005, 0.3, 0.7, 0.99])
def test_a_truncated_file_is_refused_in_one_line(path, part):
    data = path.read_bytes()
    path.write_bytes(data[: int(part * len(data))])
    with pytest.raises(SchemaError, match=r"is cut off|not an MCAP file") as caught:
        read_mcap(path)
    assert "\n" not in str(caught.value)


def test_damage_anywhere_in_the_data_is_noticed(path):
    data = path.read_bytes()
    for place in range(8, len(data) // 2, 2999):
        path.write_bytes(data[:place] + bytes([data[place] ^ 0xFF]) + data[place + 1 :])
        with pytest.raises(SchemaError, match="is a damaged MCAP file"):
            read_mcap(path)


def test_other_files_are_refused_by_name(tmp_path):
    path = tmp_path / "a.mcap"
    path.write_text("time,force\n")
    with pytest.raises(SchemaError, match=r"a\.mcap is not an MCAP file"):
        read_mcap(path)
    with pytest.raises(FileAccessError, match="No such file"):
        read_mcap(tmp_path / "b.mcap")


def test_a_file_that_cannot_be_written_leaves_nothing_behind(tmp_path):
    folder = tmp_path / "away"
    with pytest.raises(FileAccessError, match="cannot write"):
        write_mcap(folder / "a.mcap", [], "test", Metadata(name="n", metadata={}))
    shutil.rmtree(folder, ignore_errors=True)
    assert list(tmp_path.iterdir()) == []


PACKED_BY_HAND = Path(__file__).parent / "packed_by_hand.mcap"
"""Written before the mcap package wrote the messages: the streams of ``test_streams``."""


def test_a_flipped_byte_does_no_harm_or_is_refused(tmp_path):
    data, path = PACKED_BY_HAND.read_bytes(), tmp_path / "a.mcap"
    wanted = read_mcap(PACKED_BY_HAND).topics
    for place in range(0, len(data), 11):
        path.write_bytes(data[:place] + bytes([data[place] ^ 0x80]) + data[place + 1 :])
        try:
            found = read_mcap(path).topics
        except SchemaError:
            continue
        # In the summary, which is for those who jump in the file.
        assert {name: found[name] for name in wanted} == wanted
