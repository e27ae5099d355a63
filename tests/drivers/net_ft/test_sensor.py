"""The stream of a box, datagram by datagram, in a time of its own."""

import struct

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from elastocal.cell import SensorStatus
from elastocal.compensation.online import every_sample
from elastocal.drivers.net_ft.driver import NetFtSensor
from elastocal.drivers.net_ft.protocol import CountScale
from elastocal.errors import DeviceError
from elastocal.sim.workcell import SimClock

SCALE = CountScale(1e4, 1e3, "N", "N-mm")


class Stream:
    """A box that sends what a test wants."""

    def __init__(self) -> None:
        self.clock = SimClock(5.0)
        self.sensor = NetFtSensor(self.clock, SCALE, 1000.0, "Net F/T at 10.0.0.5")
        self.rdt = self.ft = 0

    def send(self, rdt=1, ft=7, status=0, counts=(10_000, 0, -20_000, 5_000, 0, 0)) -> None:
        """Send a record that goes on by so much."""
        self.rdt, self.ft = (self.rdt + rdt) % 2**32, (self.ft + ft) % 2**32
        self.clock.sleep(1e-3)
        self.sensor.received(struct.pack(">III6i", self.rdt, self.ft, status, *counts))

    def reason(self) -> str:
        """Return why the stream is refused for good."""
        with pytest.raises(DeviceError):
            self.sensor.newest()
        return self.hole()

    def hole(self) -> str:
        """Return why the readings of a procedure are refused."""
        with pytest.raises(DeviceError) as caught:
            self.sensor.read()
        return str(caught.value)


@pytest.fixture
def stream():
    return Stream()


def test_samples_are_si_in_the_time_of_the_rig_and_come_once(stream):
    for _ in range(3):
        stream.send()
    block = stream.sensor.read()
    np.testing.assert_allclose(block.force, np.tile([1.0, 0.0, -2.0], (3, 1)))
    np.testing.assert_allclose(block.moment, np.tile([5e-3, 0.0, 0.0], (3, 1)))
    np.testing.assert_allclose(block.time, [5.001, 5.002, 5.003])
    assert block.status is SensorStatus.OK
    assert np.isnan(block.force_sigma)
    assert len(stream.sensor.read()) == 0


def test_the_feed_takes_no_sample_away(stream):
    assert stream.sensor.newest() is None
    stream.send()
    sample = stream.sensor.newest()
    assert sample.time == pytest.approx(5.001)
    np.testing.assert_allclose(sample.force, [1.0, 0.0, -2.0])
    assert len(stream.sensor.read()) == 1
    assert stream.sensor.newest() == sample or stream.sensor.newest().time == sample.time


def test_two_records_of_one_datagram_have_two_times(stream):
    record = struct.pack(">III6i", 1, 7, 0, *(0,) * 6) + struct.pack(">III6i", 2, 14, 0, *(0,) * 6)
    stream.sensor.received(record)
    assert np.all(np.diff(stream.sensor.read().time) > 0.0)


def test_records_that_come_in_a_bunch_are_as_far_apart_as_the_box_says(stream):
    for number in range(1, 401):
        if number % 4 == 1:
            stream.clock.sleep(4e-3)
        stream.sensor.received(struct.pack(">III6i", number, 7 * number, 0, *(0,) * 6))
    block = stream.sensor.read()
    np.testing.assert_allclose(np.diff(block.time)[40:], 1e-3, atol=1e-5)
    assert np.all(np.diff(block.time) > 0.0)
    assert stream.clock.now() - block.time[-1] < 1e-4


@pytest.mark.parametrize("slower", [-0.05, -0.002, 0.002, 0.05])
def test_a_box_whose_rate_is_not_the_stated_one_keeps_the_time_of_the_rig(stream, slower):
    for number in range(1, 5001):
        stream.clock.sleep(1e-3 * (1.0 + slower))
        stream.sensor.received(struct.pack(">III6i", number, 7 * number, 0, *(0,) * 6))
    block = stream.sensor.read()
    assert 0.0 <= stream.clock.now() - block.time[-1] <= 0.051
    assert np.all(np.diff(block.time) > 0.0)


def test_a_lost_record_is_counted_and_a_late_one_dropped(stream):
    stream.send()
    stream.send(rdt=3)
    stream.send(rdt=-1)
    stream.send(rdt=2)
    assert (stream.sensor.lost, stream.sensor.late) == (2, 1)
    assert len(stream.sensor.read()) == 3


def test_the_count_of_records_may_wrap(stream):
    stream.send(rdt=2**32 - 1)
    stream.send()
    stream.send()
    assert stream.sensor.lost == 0
    assert len(stream.sensor.read()) == 3


def test_a_line_that_loses_a_tenth_is_refused(stream):
    for _ in range(100):
        stream.send(rdt=2)
    stream.sensor.read()
    for _ in range(2):
        stream.send(rdt=2)
    with pytest.raises(DeviceError, match="101 of 202 records were lost on the way"):
        stream.sensor.read()
    assert stream.sensor.newest() is not None, "a correction goes by the newest"


def test_a_line_that_loses_single_records_goes_on(stream):
    for _ in range(300):
        for _ in range(9):
            stream.send()
        stream.send(rdt=2)
    stream.sensor.read()
    assert stream.sensor.lost == 300


def test_a_stalled_box_is_refused(stream):
    stream.send()
    for _ in range(100):
        stream.send(ft=0)
    assert "it repeats sample 7: it has stalled" in stream.hole()


def test_a_box_that_was_started_anew_is_refused(stream):
    for _ in range(1000):
        stream.send()
    stream.send(rdt=-900)
    assert "count of records went from 1000 back to 100" in stream.reason()


def test_a_counter_of_samples_that_goes_back_is_refused(stream):
    stream.send(ft=1000)
    stream.send(ft=-500)
    assert "count of samples went from 1000 back to 500" in stream.reason()
    assert "Net F/T at 10.0.0.5" in stream.reason()


def test_a_saturated_gauge_spoils_the_block_alone(stream):
    stream.send(status=0x80020000)
    stream.send()
    assert stream.sensor.read().status is SensorStatus.SATURATED
    stream.send()
    assert stream.sensor.read().status is SensorStatus.OK


def test_a_serious_status_is_told_by_name(stream):
    stream.send(status=0x80004000)
    assert "status 0x80004000: error, watchdog" in stream.hole()


def test_a_bad_status_is_a_bad_sample_for_a_correction_which_follows_again(stream):
    stream.send()
    stream.send(status=0x80004000)
    assert stream.sensor.newest().status is SensorStatus.FAULT
    stream.send()
    assert stream.sensor.newest().status is SensorStatus.OK
    assert not stream.sensor.failed
    with pytest.raises(DeviceError, match="watchdog"):
        stream.sensor.read()


@pytest.mark.parametrize("wrong", ["stalled", "nonsense"])
def test_a_stream_that_comes_to_itself_is_followed_again_by_a_correction(stream, wrong):
    stream.send()
    for _ in range(120):
        stream.clock.sleep(0.001)
        if wrong == "stalled":
            stream.send(ft=0)
        else:
            stream.sensor.received(b"hello")
    old = stream.sensor.newest().time
    assert stream.clock.now() - old > 0.015
    stream.send()
    assert stream.sensor.newest().time > old
    with pytest.raises(DeviceError):
        stream.sensor.read()


def test_datagrams_that_are_no_records_are_counted_then_refused(stream):
    for _ in range(10):
        stream.sensor.received(b"hello")
    stream.send()
    assert len(stream.sensor.read()) == 1
    for _ in range(11):
        stream.sensor.received(b"hello")
    assert "no RDT records: a datagram of 5 bytes" in stream.hole()


def test_a_flood_is_bounded(stream):
    for _ in range(3000):
        stream.send()
    assert len(stream.sensor.read()) == 1000


@given(st.lists(st.binary(max_size=80) | st.binary(min_size=36, max_size=36), max_size=20))
@settings(max_examples=100, deadline=None)
def test_whatever_comes_is_taken_or_refused(datagrams):
    stream = Stream()
    for each in datagrams:
        stream.sensor.received(each)
    try:
        block = stream.sensor.read()
    except DeviceError:
        return
    assert np.all(np.isfinite(block.force))
    assert np.all(np.diff(block.time) > 0.0)


def test_a_stream_that_was_silent_has_a_hole_for_a_run_and_goes_on_for_a_correction(stream):
    stream.send()
    stream.sensor.leave_gap("no record for 0.25 s")
    assert stream.sensor.newest().time == pytest.approx(5.001), "as old as it is"
    stream.clock.sleep(1.0)
    stream.send()
    assert stream.sensor.newest().time == pytest.approx(6.002, abs=0.06)
    with pytest.raises(DeviceError, match=r"no record for 0\.25 s"):
        stream.sensor.read()


def test_a_bad_record_costs_a_correction_at_the_sensors_rate_one_cycle(stream):
    read = every_sample(stream.sensor)
    stream.send()
    stream.send(status=0x80004000)
    with pytest.raises(DeviceError, match="watchdog"):
        read()
    stream.send()
    (sample,) = read()
    assert sample.ok
    assert sample.time == stream.sensor.newest().time


def test_what_is_wrong_with_the_stream_is_counted(stream):
    stream.send()
    stream.send(rdt=4)
    stream.send(status=0x80020000)
    stream.sensor.received(b"nonsense")
    (counts,) = stream.sensor.lines()
    assert (counts.received, counts.lost, counts.saturated, counts.malformed) == (3, 3, 1, 1)
    assert counts.status == ("0x80020000: error, gauge saturated",)
