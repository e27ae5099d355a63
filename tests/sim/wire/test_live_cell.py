"""The simulated cell moved along by another clock, for several threads at once."""

import threading

import numpy as np
import pytest

from elastocal.cell import Motion
from elastocal.sim.wire import LiveCell
from elastocal.sim.workcell import SimClock, SimulatedCell
from support.simulated import example_cell, places


@pytest.fixture
def clock():
    return SimClock(5.0)


@pytest.fixture
def live(clock):
    return LiveCell(example_cell(), 3, clock)


def test_it_is_the_simulated_cell_at_the_time_of_the_clock(live, clock):
    alone = SimulatedCell.of(example_cell(), 3, 5.0).devices
    sensor, metrology = live.sensor(), live.metrology()
    for arm in (live.arm(), alone.arm):
        arm.enable()
        arm.move_joints(places()[0].q_approach, 1.0)
    for each in (clock, alone.clock):
        each.sleep(0.5)
    assert live.arm().state().time == 5.5
    np.testing.assert_array_equal(live.arm().state().q, alone.arm.state().q)
    np.testing.assert_array_equal(sensor.read().force, alone.sensor.read().force)
    np.testing.assert_array_equal(metrology.read().position, alone.metrology.read().position)


def test_every_reader_gets_every_sample(live, clock):
    readers = live.sensor(), live.sensor()
    for _ in range(5):
        clock.sleep(0.1)
        live.arm().state()
    first, second = (reader.read() for reader in readers)
    assert len(first) == 50
    np.testing.assert_array_equal(first.force, second.force)
    assert len(readers[0].read()) == 0
    newest = live.wrench()
    assert newest.time == first.time[-1]
    np.testing.assert_array_equal(newest.force, first.force[-1])


def test_what_another_station_saw_is_left_out(live, clock):
    live = LiveCell(example_cell("machining"), 3, clock)
    tracker = live.metrology()
    clock.sleep(0.1)
    tracker.look(tracker.stations[-1])
    clock.sleep(0.1)
    block = tracker.read()
    assert block.station == tracker.stations[-1]
    assert block.time[0] > 5.1 or len(tracker.stations) == 1


def test_the_marker_is_where_it_truly_is(live, clock):
    clock.sleep(1.0)
    T = live.sim.tracker.T_base_station(live.sim.tracker.stations[0])
    seen = live.metrology()
    clock.sleep(1.0)
    block = seen.read()
    position = block.position.mean(axis=0) @ T[:3, :3].T + T[:3, 3]
    assert np.linalg.norm(position - live.marker()) < 50e-6


def test_threads_do_not_get_into_one_another(live, clock):
    arm = live.arm()
    arm.enable()
    arm.move_joints(places()[0].q_approach, 1.0)
    failed = []

    def look():
        try:
            for _ in range(50):
                arm.state()
                live.wrench()
        except Exception as error:  # noqa: BLE001 - of another thread
            failed.append(error)

    threads = [threading.Thread(target=look) for _ in range(4)]
    for thread in threads:
        thread.start()
    for _ in range(40):
        clock.sleep(0.1)
    for thread in threads:
        thread.join()
    assert failed == []
    assert arm.state().motion is Motion.IDLE
