"""Damaged streams, a million a night: events, packets, or our refusal, and nothing kept."""

import contextlib
import random
import struct
import tracemalloc
from collections.abc import Callable

import pytest

from elastocal.drivers.emscon.packets import Code, PacketReader, command
from elastocal.drivers.line_stream.driver import LineReader
from elastocal.errors import DeviceError

Make = Callable[[], LineReader | PacketReader]
INPUTS = 500_000
"""Of each kind."""
HALF_A_MEGABYTE = 500_000

LINES = b"""t[s],x[mm],y[mm],z[mm],sigma[mm],station
frame setup 3
12.345,2412.071,-310.442,1203.118,0.012,station_1
12.355;2412,070;-310,441;1203,118;0,012;station_1
beam broken station_1
x[m],y[m],z[m],qx,qy,qz,qw
1.5,0.25,2.0,0,0,0,1
error laser
"""


def _points(kind: int, first: int, size: int) -> bytes:
    body = struct.pack("<iii", 0, 2, 1).ljust(first - 8, b"\0") + bytes(2 * size)
    return struct.pack("<ii", 8 + len(body), kind) + body


PACKETS = (
    command(Code.SET_UNITS, 0, 0, 0, 0, 0, form="5i")
    + struct.pack("<iiii", 16, 0, 7, 39)
    + struct.pack("<iiii", 16, 1, 49, 10004)
    + struct.pack("<iii", 12, 8, 25)
    + _points(3, 48, 36)
    + _points(10, 48, 92)
    + _points(5, 68, 212)
    + struct.pack("<iiiiiiid", 100, 0, 42, 0, 3, 1, 1, 0.0)
    + "CCR-1.5in".encode("utf-16-le").ljust(64, b"\0")
)


def damaged(whole: bytes, rng: random.Random) -> bytes:
    """Return a piece of a stream with a few bytes changed, doubled or left out."""
    start = rng.randrange(len(whole))
    piece = bytearray(whole[start : start + rng.randrange(1, 120)])
    for _ in range(rng.randrange(4)):
        at = rng.randrange(len(piece)) if piece else 0
        match rng.randrange(3):
            case 0:
                piece[at : at + 1] = bytes([rng.randrange(256)])
            case 1:
                del piece[at : at + rng.randrange(1, 9)]
            case 2:
                piece[at:at] = piece[: rng.randrange(1, 40)]
    return bytes(piece)


def refusals(make: Make, whole: bytes, rng: random.Random, inputs: int) -> int:
    """Feed a reader with damaged pieces; return how many it refused."""
    reader, refused = make(), 0
    for number in range(inputs):
        try:
            for _ in reader.feed(damaged(whole, rng)):
                pass
        except DeviceError:
            refused += 1
        if number % 100 == 0:
            # A new connection; what came before may have hidden the header or a size.
            reader = make()
            with contextlib.suppress(DeviceError):
                list(reader.feed(whole))
    return refused


@pytest.mark.slow
@pytest.mark.parametrize(
    ("make", "whole"), [(LineReader, LINES), (PacketReader, PACKETS)], ids=["lines", "packets"]
)
def test_damaged_streams_give_events_or_our_refusal_and_nothing_is_kept(make: Make, whole: bytes):
    rng = random.Random(7)
    refused = refusals(make, whole, rng, INPUTS)
    assert refused > INPUTS // 100
    tracemalloc.start()  # which takes ten times as long
    refusals(make, whole, rng, INPUTS // 50)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < HALF_A_MEGABYTE
    print(f"{INPUTS} inputs, {refused} refused, {most} bytes at most")
