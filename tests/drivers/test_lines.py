"""The lines of a stream: what they mean, and what they are refused for."""

import contextlib

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from elastocal.drivers.line_stream.driver import (
    LONGEST_LINE,
    AdapterFault,
    BeamLine,
    FrameLine,
    LineReader,
    MarkerPoint,
    columns_of,
)
from elastocal.errors import DeviceError

HEADER = b"t[s],x[mm],y[mm],z[mm],sigma[um]\n"


def events(*parts, columns=()):
    reader = LineReader(columns_of(columns) if columns else ())
    return [event for part in parts for event in reader.feed(part)]


def test_a_point_is_in_si_whatever_the_header_has():
    (point,) = events(HEADER + b"12.345,2412.071,-310.442,1203.118,12\n")
    np.testing.assert_allclose(point.position, [2.412071, -0.310442, 1.203118])
    np.testing.assert_allclose(point.sigma, 12e-6)
    assert point.stamp == 12.345


@pytest.mark.parametrize(
    ("header", "line"),
    [
        (b"# t[ms];x[m];y[m];z[m];u95[mm]", b"12345;2,412071;-0,310442;1,203118;0,024"),
        (b"t[s]\tx[mm]\ty[mm]\tz[mm]\tsigma[mm]", b"12.345\t2412.071\t-310.442\t1203.118\t0.012"),
        (b"x[mm] y[mm] z[mm] t[s] sigma[mm]", b"2412,071 -310,442 1203,118 12,345 0,012"),
        (
            b"\xef\xbb\xbfT[s],X[mm],Y[mm],Z[mm],Sigma[mm]\r",
            b"12.345,2412.071,-310.442,1203.118,0.012\r",
        ),
    ],
)
def test_delimiters_decimal_commas_units_and_order_are_the_headers(header, line):
    (point,) = events(header + b"\n" + line + b"\n")
    np.testing.assert_allclose(point.position, [2.412071, -0.310442, 1.203118])
    np.testing.assert_allclose(point.sigma, 12e-6)
    assert point.stamp == pytest.approx(12.345)


def test_columns_of_the_settings_take_the_place_of_a_header():
    (point,) = events(b"1,2,3\n", columns=("x[m]", "y[m]", "z[m]"))
    np.testing.assert_array_equal(point.position, [1.0, 2.0, 3.0])
    assert point.stamp is None
    assert np.isnan(point.sigma).all()


def test_bytes_may_come_in_any_pieces():
    whole = HEADER + b"1,2,3,4,5\nbeam broken\n6,7,8,9,10\n"
    pieces = [whole[i : i + 1] for i in range(len(whole))]
    kinds = [type(event) for event in events(*pieces)]
    assert kinds == [MarkerPoint, BeamLine, MarkerPoint]


def test_a_quaternion_turns_a_6d_marker():
    header = b"x[m],y[m],z[m],qx,qy,qz,qw\n"
    (point,) = events(header + b"1,2,3,0,0,0.70710678,0.70710678\n")
    np.testing.assert_allclose(point.R @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-7)


def test_words_tell_beam_frame_and_faults():
    found = events(
        b"beam broken\nbeam locked station_2\nframe setup 3\nerror laser is cold\n#x\n\n"
    )
    assert found == [
        BeamLine(False, None),
        BeamLine(True, "station_2"),
        FrameLine("setup 3"),
        AdapterFault("laser is cold"),
    ]


@pytest.mark.parametrize("cell", [b"nan", b"", b"-"])
def test_a_marker_without_a_place_is_a_broken_beam(cell):
    assert events(HEADER + b"1," + cell + b",2,3,4\n") == [BeamLine(False, None)]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"1,2,3,4\n", "begins with '1,2,3,4', without a header"),
        (HEADER + b"1,2,3\n", "has 3 cells, the stream 5 columns"),
        (HEADER + b"1,2,3,x,5\n", "'x' in '1,2,3,x,5' is no number"),
        (HEADER + b"nan,2,3,4,5\n", "has no time"),
        (HEADER + b"beam gone\n", "the beam is broken or locked"),
        (b"t,x,y,z\n", "column 't' of the stream has no unit"),
        (b"t[s],x[mm],y[mm]\n", "has no column z"),
        (b"t[s],x[furlong],y[mm],z[mm]\n", "furlong"),
        (b"t[s],x[s],y[mm],z[mm]\n", r"column 'x\[s\]' of the stream"),
        (b"t[s],x[mm],y[mm],z[mm],qw\n", "has no column qx, qy, qz"),
        (b"t[s],x[mm],x[mm],y[mm],z[mm]\n", "'x' of the stream is there twice"),
        (b"x[m],y[m],z[m],sigma[m],u95[m]\n", "uncertainty twice"),
        (b"x[m],y[m],z[m],qx,qy,qz,qw\n1,2,3,1,1,1,1\n", "length 2, not 1"),
        (b"t[s],x[mm],y[mm],z[mm],w[mm]\n", r"'w\[mm\]' of the stream is none of t, x"),
        (b"9" * (LONGEST_LINE + 1), "longer than 1024 bytes"),
    ],
)
def test_what_is_none_of_a_streams_lines_is_named(text, message):
    with pytest.raises(DeviceError, match=message):
        events(text)


LINES = st.one_of(
    st.binary(max_size=60),
    st.text("0123456789.,;-eE \t#tbx[]naqz", max_size=40).map(str.encode),
    st.sampled_from([HEADER, b"beam broken", b"frame 2", b"1,2,3,4,5", b"x[m],y[m],z[m]"]),
)


@pytest.mark.slow
@settings(max_examples=300, deadline=None)
@given(st.lists(LINES, max_size=12))
def test_no_bytes_make_anything_but_events_or_our_refusal(lines):
    reader = LineReader()
    for line in lines:
        with contextlib.suppress(DeviceError):
            for event in reader.feed(line + b"\n"):
                if isinstance(event, MarkerPoint):
                    assert np.isfinite(event.position).all()
    assert len(reader._rest) <= LONGEST_LINE
