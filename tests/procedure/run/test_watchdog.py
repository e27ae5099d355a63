"""The watchdog, one look at a time; whole runs are in test_runner_faults."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.cell import (
    ArmState,
    BeamState,
    CollisionWatch,
    Motion,
    PointBlock,
    SensorStatus,
    WrenchBlock,
)
from elastocal.procedure.run._watchdog import Guard, Snapshot, Watchdog
from elastocal.procedure.run.steps import Fault, FaultError

STALE, BEAM = 0.3, 2.0
WEIGHT = np.array([0.0, 0.0, -600.0])


def seen(now, *, arm=None, sensor=None, force=0.0, points=None, beam=BeamState.LOCKED, row=None):
    """What comes in one cycle; devices are up to date unless told otherwise."""
    arm, sensor = now if arm is None else arm, now if sensor is None else sensor
    value = now if row is None else row
    points = now if points is None else points
    return Snapshot(
        now,
        ArmState(arm, np.zeros(3), np.eye(4), Motion.IDLE, False, None, "arm"),
        WrenchBlock(
            np.array([sensor]), np.full((1, 3), value), np.zeros((1, 3)), 1.0, 1.0,
            SensorStatus.OK, "sensor",
        ),
        PointBlock(np.array([points]), np.zeros((1, 3)), np.zeros((1, 3)), beam, "s", "tracker"),
        np.array([[0.0, 0.0, force]]),
    )  # fmt: skip


@pytest.fixture
def watch():
    watch = Watchdog(STALE, BEAM, CollisionWatch(WEIGHT, 100.0, 300.0), np.eye(3))
    watch.restart(0.0)
    return watch


def fault_of(watch, what, guard=Guard(beam=True)):  # noqa: B008 - frozen
    with pytest.raises(FaultError) as caught:
        watch.check(what, guard)
    return caught.value.fault


def test_devices_that_are_up_to_date_pass(watch):
    assert watch.check(seen(0.04), Guard(force=10.0, beam=True)) is False


@pytest.mark.parametrize(
    ("what", "fault"),
    [
        ({"arm": 0.6}, Fault.ARM_STALE),
        ({"arm": np.nan}, Fault.ARM_STALE),
        ({"arm": 1.4}, Fault.CLOCK),
        ({"sensor": 0.6}, Fault.SENSOR_STALE),
        ({"sensor": np.nan}, Fault.CLOCK),
        ({"sensor": -0.5}, Fault.SENSOR_STALE),
        ({"points": 0.6}, Fault.TRACKER_STALE),
        ({"force": 11.0}, Fault.FORCE_LIMIT),
        ({"force": np.nan}, Fault.SENSOR_FAULT),
    ],
)
def test_each_device_is_watched(watch, what, fault):
    assert fault_of(watch, seen(1.0, **what), Guard(force=10.0, beam=True)) is fault


def test_samples_that_go_back_are_a_clock_out_of_order(watch):
    watch.check(seen(0.5), Guard())
    assert fault_of(watch, seen(1.0, sensor=0.1)) is Fault.CLOCK


def test_samples_of_a_time_in_which_nobody_watched_are_none_too_early(watch):
    watch.check(seen(0.5), Guard())
    watch.restart(2.0)
    late = seen(2.04)
    times = np.array([0.6, 2.04])
    both = replace(late.wrenches, time=times, force=np.full((2, 3), 7.0), moment=np.zeros((2, 3)))
    watch.check(replace(late, wrenches=both), Guard())


def test_the_limit_itself_is_allowed(watch):
    watch.check(seen(0.04, force=10.0), Guard(force=10.0))


def test_equal_samples_are_frozen_after_the_stale_time(watch):
    for n in range(1, 9):
        watch.check(seen(0.04 * n, row=5.0), Guard())
    assert fault_of(watch, seen(0.36, row=5.0)) is Fault.SENSOR_FROZEN


def test_one_sample_that_differs_is_enough_to_be_alive(watch):
    for n in range(1, 30):
        watch.check(seen(0.04 * n, row=5.0 + (n % 7 == 0)), Guard())


def test_a_broken_beam_is_looked_for_and_lost_after_its_time(watch):
    asked = [watch.check(seen(t, beam=BeamState.BROKEN), Guard(beam=True)) for t in (0.1, 0.2, 1.2)]
    assert asked == [True, False, True]
    assert (watch.sees, watch.breaks) == (False, 1)
    assert fault_of(watch, seen(2.2, beam=BeamState.BROKEN)) is Fault.BEAM_LOST


def test_a_beam_that_is_found_again_counts_as_one_break(watch):
    watch.check(seen(0.1, beam=BeamState.BROKEN), Guard(beam=True))
    watch.check(seen(1.9), Guard(beam=True))
    assert (watch.sees, watch.breaks) == (True, 1)


def test_between_poses_nobody_asks_for_the_beam(watch):
    assert watch.check(seen(9.0, beam=BeamState.BROKEN, points=0.0), Guard()) is False


@pytest.mark.parametrize(
    ("pressing", "fault"), [(True, Fault.SENSOR_OVERLOAD), (False, Fault.SENSOR_SATURATED)]
)
def test_an_overload_counts_as_more_where_the_tool_may_press(watch, pressing, fault):
    what = seen(0.04)
    block = replace(what.wrenches, status=SensorStatus.SATURATED)
    assert fault_of(watch, replace(what, wrenches=block), Guard(pressing=pressing)) is fault


def test_another_station_is_let_pass_only_for_a_moment(watch):
    watch.station = "other"
    watch.check(seen(0.2), Guard(beam=True))
    assert fault_of(watch, seen(0.4)) is Fault.TRACKER_FAULT


def test_a_blow_on_a_free_move_is_a_collision_and_near_the_surface_is_none(watch):
    watch.check(seen(0.04), Guard(free=True))
    blow = seen(0.08, row=400.0)
    assert fault_of(watch, blow, Guard(free=True)) is Fault.COLLISION
    assert watch.check(blow, Guard()) is False


def test_a_force_that_grows_over_the_way_is_a_collision_in_the_end(watch):
    for step in range(33):
        watch.check(seen(0.04 * step, row=5.0 * step), Guard(free=True))
    # Three axes grow by 5 N a cycle, 17 N in 50 ms: 300 N are there after 35.
    with pytest.raises(FaultError, match=r"hit something on the way: the force is 3\d\d N off"):
        watch.check(seen(0.04 * 33, row=180.0), Guard(free=True))
