"""Print what the streams of one pose attempt take to save and to read, beside packing by hand.

20 s of an arm at 25 Hz, with a force sensor and a tracker at 100 Hz, as in the example cells, and
at 1 kHz. The hand packer frames all messages of a chunk at once with NumPy and writes no index: no
writer of our own could do with less. Machines differ and are noisy, so the ratios are what counts;
times are the least processor times of several calls. Run with ``python benchmarks/record.py``.
"""

import struct
import tempfile
import time
import tracemalloc
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import zstandard

from elastocal.cell import (
    ArmState,
    BeamState,
    Motion,
    PointBlock,
    SensorStatus,
    WrenchBlock,
)
from elastocal.files import replacing
from elastocal.procedure import PoseRecorder, read_streams
from elastocal.procedure.record import streams

SECONDS, CYCLE = 20.0, 0.04
CHUNK = 4096
"""Messages packed at a time."""
HEAD = np.dtype("u1,<u8,<u2,<u4,<u8,<u8")
"""Opcode, length, channel, sequence, log time, publish time."""


def recorded(rate: float) -> PoseRecorder:
    """Return a recorder that has seen sensor and tracker at a rate in Hz."""
    recorder, rng = PoseRecorder([f"joint_{n}" for n in range(1, 7)]), np.random.default_rng(0)
    count = round(CYCLE * rate)
    for cycle in range(round(SECONDS / CYCLE)):
        start = 100.0 + CYCLE * cycle
        T = np.eye(4)
        T[:3, 3] = rng.normal(size=3)
        recorder.arm(ArmState(start, rng.normal(size=6), T, Motion.HOLDING, True, None, "arm"))
        time, xyz = start + np.arange(count) / rate, rng.normal(size=(3, count, 3))
        force, moment, position = 100.0 * xyz[0], 10.0 * xyz[1], xyz[2]
        recorder.wrenches(WrenchBlock(time, force, moment, 0.5, 0.05, SensorStatus.OK, "sensor"))
        sigma = np.full((count, 3), 2e-5)
        recorder.points(PointBlock(time, position, sigma, BeamState.LOCKED, "A", "tracker"))
        if cycle % 25 == 0:
            recorder.mark(start, "settle")
    return recorder


def pack(path: Path, topics: Sequence[streams.Topic], *_: object) -> None:
    """Write chunks of messages that are framed many at once, with their checksums."""
    time = np.concatenate([topic.time for topic in topics])
    channel = np.repeat(np.arange(len(topics)), [len(topic.time) for topic in topics])
    data = [message for topic in topics for message in topic.messages]
    order, file = np.argsort(time, kind="stable"), bytearray()
    for start in range(0, len(order), CHUNK):
        rows = order[start : start + CHUNK]
        messages = [data[row] for row in rows.tolist()]
        head = np.empty(len(rows), HEAD)
        head["f0"], head["f1"] = 5, [len(message) + 22 for message in messages]
        head["f2"], head["f3"], head["f4"], head["f5"] = channel[rows], rows, time[rows], time[rows]
        raw, size = head.tobytes(), HEAD.itemsize
        pieces = [raw[n * size : n * size + size] + each for n, each in enumerate(messages)]
        plain = b"".join(pieces)
        packed = zstandard.compress(plain, 1)
        file += struct.pack("<QQI", len(packed), len(plain), zlib.crc32(plain)) + packed
    with replacing(path) as temporary:
        temporary.write_bytes(file)


def unpack(path: Path) -> streams.Contents:
    """Read what `pack` has written; the last file's metadata are those of the package."""
    file, position = path.read_bytes(), 0
    topics = [streams.Messages() for _ in range(4)]
    message_head = struct.Struct("<BQHIQQ")
    while position < len(file):
        length, plain_length, checksum = struct.unpack_from("<QQI", file, position)
        position += 20
        plain = zstandard.decompress(file[position : position + length], plain_length)
        assert zlib.crc32(plain) == checksum
        position, at = position + length, 0
        while at < plain_length:
            _, size, channel, _, when, _ = message_head.unpack_from(plain, at)
            topics[channel].time.append(when)
            topics[channel].data.append(plain[at + HEAD.itemsize : at + 9 + size])
            at += 9 + size
    names = ("/arm", "/wrench", "/marker", "/marks")
    joints = '["joint_1","joint_2","joint_3","joint_4","joint_5","joint_6"]'
    note = {"elastocal": {"schema": streams.STREAMS_SCHEMA, "joints": joints}}
    return streams.Contents(note, dict(zip(names, topics, strict=True)))


def processor_seconds(work: Callable[[], object], repetitions: int = 7) -> float:
    """Return the least processor time of a call, after one call that is not counted."""
    work()
    times = []
    for _ in range(repetitions):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


def peak(work: Callable[[], object]) -> float:
    """Return the most memory that a call has in use at a time, in MB."""
    tracemalloc.start()
    work()
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return most / 1e6


def measure(recorder: PoseRecorder, path: Path) -> tuple[float, float, int, float, float]:
    """Return times to save and to read in s, size in bytes, and the peaks of both in MB."""

    def save() -> object:
        return recorder.save(path)

    def read() -> object:
        return read_streams(path)

    saving, reading = processor_seconds(save), processor_seconds(read)
    return saving, reading, path.stat().st_size, peak(save), peak(read)


def main() -> None:
    """Measure and print."""
    package = streams.write_mcap, streams.read_mcap
    for rate in (100.0, 1000.0):
        recorder = recorded(rate)
        with tempfile.TemporaryDirectory() as folder:
            save, read, size, *peaks = measure(recorder, Path(folder) / "package.mcap")
            streams.write_mcap, streams.read_mcap = pack, unpack
            hand_save, hand_read, hand_size, *hand_peaks = measure(recorder, Path(folder) / "hand")
            streams.write_mcap, streams.read_mcap = package
        print(f"streams of one attempt, {SECONDS:g} s, sensor and tracker at {rate:g} Hz")
        for what, taken, by_hand in (("save", save, hand_save), ("read", read, hand_read)):
            print(
                f"  {what}: {1e3 * taken:.0f} ms with the mcap package, {1e3 * by_hand:.0f} ms"
                f" packed by hand; ratio {taken / by_hand:.2f}"
            )
        print(f"  file: {size / 1e6:.2f} MB, {hand_size / 1e6:.2f} MB by hand")
        for what, most, by_hand in zip(("saving", "reading"), peaks, hand_peaks, strict=True):
            print(f"  memory while {what}: {most:.1f} MB, {by_hand:.1f} MB by hand")


if __name__ == "__main__":
    main()
