"""Packets of emScon: sizes and offsets of the published layout, and what is refused."""

import contextlib
import struct

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from elastocal.drivers.emscon.packets import (
    Answer,
    Code,
    Complaint,
    MeasuredPoints,
    PacketReader,
    Reflector,
    StatusChange,
    command,
    status_text,
)
from elastocal.errors import DeviceError


def packets(*parts):
    reader = PacketReader()
    return [packet for part in parts for packet in reader.feed(part)]


def multi(points, mode=1):
    """Type 3: a header of 48 bytes, 36 a point; offsets as published."""
    body = b"".join(struct.pack("<iii3d", q, s, us, *v) for q, s, us, v in points)
    head = struct.pack("<iiiiii", 48 + len(body), 3, 0, len(points), mode, 0)
    return head + struct.pack("<3d", 20.0, 1013.0, 50.0) + body


@pytest.mark.parametrize(
    ("packet", "size"),
    [
        (command(Code.INITIALIZE), 12),
        (command(Code.SET_UNITS, 0, 0, 0, 0, 0, form="5i"), 32),
        (command(Code.SET_MEASUREMENT_MODE, 1, form="i"), 16),
        (command(Code.SET_CONTINUOUS_TIME, 10, 0, 0, 0, form="4i"), 28),
        (command(Code.SET_SYSTEM_SETTINGS, *range(9), form="9i"), 48),
        (command(Code.SET_REFLECTOR, 1, form="i"), 16),
        (command(Code.FIND_REFLECTOR, 3.0, form="d"), 20),
        (command(Code.SET_STATISTIC_MODE, 1, 1, form="2i"), 20),
    ],
)
def test_commands_have_the_published_sizes(packet, size):
    assert len(packet) == size
    assert struct.unpack_from("<ii", packet) == (size, 0)


def test_points_are_where_the_layout_has_them():
    (found,) = packets(multi([(0, 12, 345678, (1.0, 2.0, 3.0)), (3, 12, 355678, (4.0, 5.0, 6.0))]))
    assert isinstance(found, MeasuredPoints)
    np.testing.assert_allclose(found.stamp, [12.345678, 12.355678], rtol=0, atol=1e-9)
    np.testing.assert_array_equal(found.position, [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_array_equal(found.quality, [0, 3])
    assert (found.temperature, found.pressure, found.humidity) == (20.0, 1013.0, 50.0)
    assert found.quaternion is None


def test_a_6d_point_has_212_bytes_after_a_head_of_68():
    point = struct.pack("<5i24d", 0, 0, 1, 7, 500000, *range(24))
    assert len(point) == 212
    head = struct.pack("<iiiiiiiiiii", 68 + 212, 5, 0, 1, 7, 0, 1, 0, 0, 0, 0)
    (found,) = packets(head + struct.pack("<3d", 20.0, 1013.0, 50.0) + point)
    assert found.stamp.tolist() == [7.5]
    np.testing.assert_array_equal(found.position, [[0, 1, 2]])
    np.testing.assert_array_equal(found.sigma, [[3, 4, 5]])
    np.testing.assert_array_equal(found.quaternion, [[10, 11, 12, 13]])
    assert found.rotation_status.tolist() == [1]


def test_answers_errors_changes_and_reflectors_are_told_apart():
    name = "CCR-1.5in".encode("utf-16-le").ljust(64, b"\0")
    found = packets(
        struct.pack("<iiii", 16, 0, 7, 39),
        struct.pack("<iiii", 16, 1, 49, 10011),
        struct.pack("<iii", 12, 8, 25),
        struct.pack("<iiiiiiid", 100, 0, 42, 0, 2, 1, 1, 0.0) + name,
    )
    assert found == [
        Answer(7, 39),
        Complaint(49, 10011),
        StatusChange(25),
        Reflector(42, 0, 2, 1, "CCR-1.5in"),
    ]


def test_packets_may_come_in_any_pieces_and_unknown_types_are_left_out():
    whole = (
        struct.pack("<iii", 12, 6, 0)
        + multi([(0, 1, 0, (1, 2, 3))])
        + struct.pack("<iii", 12, 8, 27)
    )
    kinds = [type(p) for p in packets(*(whole[i : i + 1] for i in range(len(whole))))]
    assert kinds == [MeasuredPoints, StatusChange]


CUT = struct.pack("<i", 83) + multi([(0, 1, 0, (1, 2, 3))])[4:-1]
"""A byte is missing, and the size agrees."""


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (struct.pack("<ii", 7, 0), "a packet of 7 bytes: this is no emScon server"),
        (struct.pack("<ii", 1 << 24, 0), "no emScon server"),
        (b"HTTP/1.1 400 Bad Request\r\n", "no emScon server"),
        (struct.pack("<iii", 12, 0, 7), "a packet of type 0 is cut off: 12 bytes"),
        (CUT, "of 1 points has 83 bytes, not 84"),
        (struct.pack("<iiii", 16, 3, 0, 2**31 - 1), "cut off"),
    ],
)
def test_what_is_no_packet_is_named(data, message):
    with pytest.raises(DeviceError, match=message):
        packets(data)


def test_a_status_is_told_in_words_with_its_number():
    assert status_text(39) == "the tracker is not initialised (status 39)"
    assert status_text(12345) == "it refuses (status 12345)"


SHAPED = st.builds(
    lambda kind, body: struct.pack("<ii", 8 + len(body), kind) + body,
    st.integers(-1, 12),
    st.binary(max_size=300),
)


@settings(max_examples=300, deadline=None)
@given(st.lists(st.one_of(st.binary(max_size=40), SHAPED), max_size=8))
def test_no_bytes_make_anything_but_packets_or_our_refusal(parts):
    reader = PacketReader()
    for part in parts:
        with contextlib.suppress(DeviceError):
            list(reader.feed(part))
    assert len(reader._rest) <= 65536
