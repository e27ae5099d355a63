"""What any tracker's points have to pass, whoever sends them."""

import numpy as np
import pytest

from elastocal.cell import BeamState
from elastocal.drivers.stations import NEWEST, StationFeed, StationsMetrology
from elastocal.errors import DeviceError
from elastocal.sim.workcell import SimClock
from support.simulated import example_cell

PLACE = np.array([3.0, 0.5, 2.0])
SIGMA = np.full(3, 20e-6)


@pytest.fixture
def clock():
    return SimClock(5.0)


def feed(clock, **figures):
    (tracker,) = example_cell().file.trackers
    return StationFeed(tracker, "tracker at 127.0.0.1:1", clock, **figures)


def test_points_come_once_and_in_order(clock):
    station = feed(clock)
    for number in range(3):
        station.point(PLACE + number, SIGMA, 100.0 + number)
        clock.sleep(0.1)
    block = station.take()
    np.testing.assert_array_equal(block.position[:, 0], [3.0, 4.0, 5.0])
    assert np.all(np.diff(block.time) > 0.0)
    assert block.beam is BeamState.LOCKED
    assert len(station.take()) == 0


def test_a_caller_that_does_not_look_gets_the_newest_few_hundred(clock):
    station = feed(clock)
    for number in range(3 * NEWEST):
        station.point(PLACE, SIGMA, float(number) * 1e-3)
    assert len(station.take()) == NEWEST


def test_silence_is_a_broken_beam_and_the_next_point_mends_it(clock):
    station = feed(clock, silence=0.2)
    station.point(PLACE, SIGMA)
    clock.sleep(0.3)
    block = station.take()
    assert (block.beam, len(block), block.note) == (BeamState.BROKEN, 0, "it says nothing")
    station.point(PLACE, SIGMA)
    assert station.take().beam is BeamState.LOCKED


def test_a_broken_beam_leaves_no_points_behind(clock):
    station = feed(clock)
    station.point(PLACE, SIGMA)
    station.beam_broken("prism error")
    block = station.take()
    assert (block.beam, len(block), block.note) == (BeamState.BROKEN, 0, "prism error")


@pytest.mark.parametrize(
    ("raw", "stated", "looks_like"),
    [(1e3, "m", "mm"), (1e-3, "mm", "m"), (1.0 / 0.0254, "m", "in")],
)
def test_lengths_in_another_unit_are_found_by_the_range_of_the_station(
    clock, raw, stated, looks_like
):
    station = feed(clock, unit=stated)
    for _ in range(9):
        station.point(PLACE * raw, SIGMA)
    station.take()  # nine blunders in a row are none of our business
    station.point(PLACE * raw, SIGMA)
    with pytest.raises(DeviceError, match=f"look like {looks_like}, not {stated}"):
        station.take()


def test_points_far_out_of_range_in_any_unit_are_in_another_frame(clock):
    station = feed(clock)
    for _ in range(10):
        station.point(np.array([0.1, 0.0, 0.0]), SIGMA)
    with pytest.raises(DeviceError, match=r"station_1, whose range is 1 m to 15 m: .*frame"):
        station.take()


def test_in_a_working_frame_distances_say_nothing(clock):
    station = feed(clock, own_frame=False)
    for _ in range(20):
        station.point(PLACE * 100.0, SIGMA)
    assert len(station.take()) == 20


def test_a_blunder_now_and_then_is_let_through_for_the_registration(clock):
    station = feed(clock)
    for number in range(60):
        station.point(PLACE * (1e3 if number % 3 == 0 else 1.0), SIGMA)
    assert len(station.take()) == 60


def test_a_fault_stays_until_somebody_is_told_each_time(clock):
    station = feed(clock)
    station.fail("its server is closing")
    for _ in range(2):
        with pytest.raises(DeviceError, match=r"127.0.0.1:1: its server is closing"):
            station.take()


def test_only_the_station_that_was_looked_at_is_read(clock):
    feeds = {name: feed(clock) for name in ("near", "far")}
    looked = []
    metrology = StationsMetrology(feeds, 100.0, looked.append)
    for each in feeds.values():
        each.point(PLACE, SIGMA)
    metrology.look("far")
    assert len(metrology.read()) == 0, "points from before it was asked are of another time"
    feeds["far"].point(PLACE, SIGMA)
    assert len(metrology.read()) == 1
    assert looked == ["far"]
    with pytest.raises(DeviceError, match="did you mean 'near'"):
        metrology.look("neer")


def test_points_and_breaks_are_counted_once_each(clock):
    station = feed(clock, silence=0.2)
    for _ in range(2):
        station.point(PLACE, SIGMA)
        station.point(PLACE, SIGMA)
        station.beam_broken("prism error")
        station.beam_broken("prism error")
    station.point(PLACE, SIGMA)
    clock.sleep(0.3)
    station.take()
    station.take()
    (counts,) = StationsMetrology({"one": station}, 100.0, lambda _: None).lines()
    assert (counts.received, counts.breaks) == (5, 3)
    assert counts.device.startswith("tracker at 127.0.0.1:1: ")
