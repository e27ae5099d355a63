"""The contracts that every driver keeps, and every set of devices, simulated or real."""

import itertools
import json
import pkgutil
import struct
from dataclasses import replace

import numpy as np
import pytest

from elastocal import drivers
from elastocal.cell import (
    KINDS,
    SIMULATED,
    DeviceSet,
    polled_readings,
)
from elastocal.cell.devices import BeamState, Devices, Motion, SensorStatus
from elastocal.drivers import DRIVERS
from elastocal.drivers.net_ft.driver import NetFtSensor
from elastocal.drivers.net_ft.protocol import CountScale
from elastocal.errors import DeviceError, ElastocalError
from elastocal.records import to_data
from elastocal.sim.wire.net_ft import NetFtBox
from elastocal.testing import DriverSuite
from support.simulated import CYCLE, Place, Session, example_cell, places

PRESS = np.array([0.0, 0.0, -300.0])


def _simulated(like: str) -> tuple[Devices, Place]:
    return Session.of(example_cell(like), start=5.0).devices, places(like)[0]


def _read_from_a_box(like: str) -> tuple[Devices, Place]:
    """Return the simulated devices with their sensor behind the records of a Net F/T box."""
    devices, place = _simulated(like)
    box, there = NetFtBox.of(example_cell(like)), devices.sensor
    units = CountScale(box.counts_per_force, box.counts_per_torque, "N", "N-m")
    sensor = NetFtSensor(devices.clock, units, there.rate, "Net F/T at 127.0.0.1")
    sent = itertools.count(1)

    def send(now: int) -> None:
        block = there.read()
        for counts in box.count(block):
            number = next(sent)
            sensor.received(struct.pack(">III6i", number, 70 * number, 0, *counts))

    devices.clock.on_wake(send)
    return replace(devices, sensor=sensor), place


RIGS = {
    "Net F/T": lambda: _read_from_a_box("afp"),
    "simulated fibre placement": lambda: _simulated("afp"),
    "simulated machining": lambda: _simulated("machining"),
}


def test_every_package_of_drivers_is_one():
    packages = {each.name for each in pkgutil.iter_modules(drivers.__path__) if each.ispkg}
    assert packages | {SIMULATED} == set(DRIVERS)


@pytest.mark.parametrize("name", DRIVERS)
class TestEveryDriver(DriverSuite):
    """Each of them, before it connects to anything."""


@pytest.fixture(params=RIGS)
def rig(request) -> tuple[Devices, Place]:
    """Devices, drives off, and somewhere to press."""
    devices, place = RIGS[request.param]()
    devices.arm.disable()
    return devices, place


@pytest.fixture
def devices(rig) -> Devices:
    return rig[0]


@pytest.fixture
def place(rig) -> Place:
    return rig[1]


def wait(devices, *motions):
    for _ in range(5000):
        state = devices.arm.state()
        if state.motion in motions:
            return state
        devices.clock.sleep(CYCLE)
    raise AssertionError(f"still {state.motion}")


def go_to_surface(devices, place):
    devices.arm.enable()
    devices.arm.move_joints(place.q_approach, 1.0)
    wait(devices, Motion.IDLE)
    devices.arm.approach(-place.normal, 0.13, 0.05, 50.0)
    return wait(devices, Motion.IDLE)


def commands(arm, place):
    return {
        "move_joints": lambda: arm.move_joints(place.q_approach, 1.0),
        "approach": lambda: arm.approach(-place.normal, 0.01, 0.01, 50.0),
        "hold": lambda: arm.hold(PRESS, 100.0),
        "release": lambda: arm.release(100.0),
        "retract": lambda: arm.retract(place.normal, 0.01, 0.01),
    }


class TestEveryArm:
    def test_state_has_a_number_a_joint_and_a_rigid_pose(self, devices):
        state = devices.arm.state()
        assert state.q.shape == (len(devices.arm.joint_names),)
        R = state.T_base_tcp[:3, :3]
        np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-9)
        assert np.all(state.T_base_tcp[3] == (0, 0, 0, 1))
        assert state.time == devices.clock.now()
        assert state.source

    def test_nothing_moves_before_it_is_enabled(self, devices, place):
        before = devices.arm.state()
        assert before.motion is Motion.DISARMED
        for name, command in commands(devices.arm, place).items():
            with pytest.raises(DeviceError, match=name):
                command()
        devices.clock.sleep(1.0)
        np.testing.assert_array_equal(devices.arm.state().q, before.q)

    def test_commands_return_at_once_and_states_follow(self, devices, place):
        arm = devices.arm
        arm.enable()
        assert arm.state().motion is Motion.IDLE
        now = devices.clock.now()
        arm.move_joints(place.q_approach, 1.0)
        assert devices.clock.now() == now
        assert arm.state().motion is Motion.MOVING
        state = wait(devices, Motion.IDLE)
        np.testing.assert_allclose(state.q, place.q_approach, atol=1e-9)

    def test_no_command_interrupts_a_move(self, devices, place):
        devices.arm.enable()
        devices.arm.move_joints(place.q_approach, 0.1)
        for name, command in commands(devices.arm, place).items():
            with pytest.raises(DeviceError, match=f"refuses {name}: it is moving"):
                command()

    def test_stop_is_always_allowed_and_needs_enable_after_it(self, devices, place):
        arm = devices.arm
        arm.stop()
        assert arm.state().motion is Motion.DISARMED
        arm.enable()
        arm.move_joints(place.q_approach, 0.2)
        devices.clock.sleep(0.5)
        for _ in range(3):
            arm.stop()
            assert arm.state().motion is Motion.STOPPED
        standing = arm.state().q
        devices.clock.sleep(1.0)
        np.testing.assert_array_equal(arm.state().q, standing)
        with pytest.raises(DeviceError, match="stopped"):
            arm.move_joints(place.q_approach, 0.2)
        arm.enable()
        assert arm.state().motion is Motion.IDLE

    def test_from_the_surface_and_back(self, devices, place):
        arm = devices.arm
        state = go_to_surface(devices, place)
        assert state.in_contact
        arm.hold(PRESS, 500.0)
        assert arm.state().motion is Motion.HOLDING
        devices.clock.sleep(3.0)
        assert arm.state().motion is Motion.HOLDING
        arm.release(500.0)
        assert arm.state().motion is Motion.RELEASING
        assert wait(devices, Motion.IDLE).in_contact
        arm.retract(place.normal, 0.02, 0.05)
        assert arm.state().motion is Motion.RETRACTING
        state = wait(devices, Motion.IDLE)
        assert not state.in_contact
        assert state.fault is None

    def test_in_contact_it_neither_approaches_again_nor_moves_joints(self, devices, place):
        go_to_surface(devices, place)
        for name in ("approach", "move_joints"):
            with pytest.raises(DeviceError, match=f"{name}.*retract"):
                commands(devices.arm, place)[name]()

    def test_out_of_contact_there_is_nothing_to_hold_or_release(self, devices, place):
        devices.arm.enable()
        for name in ("hold", "release"):
            with pytest.raises(DeviceError, match=f"{name}.*only in contact"):
                commands(devices.arm, place)[name]()

    def test_a_guarded_move_without_contact_goes_its_way_straight(self, devices, place):
        arm = devices.arm
        arm.enable()
        arm.move_joints(place.q_approach, 1.0)
        start = wait(devices, Motion.IDLE).T_base_tcp
        arm.approach(-place.normal, 0.03, 0.05, 50.0)
        state = wait(devices, Motion.IDLE)
        assert not state.in_contact
        moved = state.T_base_tcp[:3, 3] - start[:3, 3]
        np.testing.assert_allclose(moved, -0.03 * place.normal, atol=1e-7)
        np.testing.assert_allclose(state.T_base_tcp[:3, :3], start[:3, :3], atol=1e-7)

    @pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
    def test_what_is_not_finite_is_refused(self, devices, place, bad):
        arm = devices.arm
        arm.enable()
        q = place.q_approach.copy()
        q[-1] = bad
        for command in (
            lambda: arm.move_joints(q, 1.0),
            lambda: arm.move_joints(place.q_approach, bad),
            lambda: arm.approach(np.array([0.0, 0.0, bad]), 0.1, 0.1, 50.0),
            lambda: arm.approach(-place.normal, bad, 0.1, 50.0),
            lambda: arm.retract(place.normal, 0.1, bad),
            lambda: arm.hold(np.array([0.0, 0.0, bad]), 100.0),
            lambda: arm.release(bad),
        ):
            with pytest.raises(DeviceError) as caught:
                command()
            assert "\n" not in str(caught.value)
        assert arm.state().motion is Motion.IDLE


class TestEveryForceSensor:
    def test_samples_come_once_in_order_and_on_time(self, devices):
        sensor, clock = devices.sensor, devices.clock
        sensor.read()
        began = clock.now()
        times = []
        for _ in range(10):
            clock.sleep(CYCLE)
            block = sensor.read()
            assert len(block) == len(block.time)
            assert block.force.shape == block.moment.shape == (len(block), 3)
            times += block.time.tolist()
            assert len(sensor.read()) == 0
        assert np.all(np.diff(times) > 0.0)
        assert began < times[0]
        assert times[-1] <= clock.now()
        assert len(times) == pytest.approx(10 * CYCLE * sensor.rate, abs=1)

    def test_a_block_says_how_good_it_is(self, devices):
        devices.clock.sleep(0.1)
        block = devices.sensor.read()
        assert block.status is SensorStatus.OK
        assert not block.force_sigma < 0.0
        assert not block.moment_sigma < 0.0
        assert block.source

    def test_nobody_is_flooded_after_a_long_pause(self, devices):
        devices.clock.sleep(3600.0)
        block = devices.sensor.read()
        assert 100 <= len(block) <= 1000
        assert devices.clock.now() - block.time[-1] < 0.1


class TestEveryMetrology:
    def test_points_come_once_in_order_and_on_time(self, devices):
        tracker, clock = devices.metrology, devices.clock
        tracker.read()
        clock.sleep(1.0)
        block = tracker.read()
        assert block.position.shape == block.sigma.shape == (len(block), 3)
        assert len(block) == pytest.approx(tracker.rate, abs=1)
        assert np.all(np.diff(block.time) > 0.0)
        assert block.time[-1] <= clock.now()
        assert len(tracker.read()) == 0

    def test_a_block_says_who_measured_and_how_well(self, devices):
        devices.clock.sleep(0.1)
        block = devices.metrology.read()
        assert block.beam is BeamState.LOCKED
        assert block.station in devices.metrology.stations
        assert np.all(block.sigma > 0.0)

    def test_every_station_can_be_looked_from(self, devices):
        for station in devices.metrology.stations:
            devices.metrology.look(station)
            devices.clock.sleep(0.1)
            assert devices.metrology.read().station == station

    def test_an_unknown_station_is_refused_with_those_there_are(self, devices):
        with pytest.raises(DeviceError, match=devices.metrology.stations[0]):
            devices.metrology.look("station_9")


class TestEveryReading:
    def test_a_person_sees_a_row_a_device_whose_numbers_are_numbers(self, devices):
        look = polled_readings(DeviceSet(devices.arm, devices.sensor, devices.metrology))
        devices.clock.sleep(0.1)
        arm, sensor, metrology = shown = look()
        assert tuple(each.kind for each in shown) == KINDS
        assert all(each.heard and not each.problem for each in shown)
        assert arm.position == tuple(devices.arm.state().T_base_tcp[:3, 3])
        assert sensor.force is not None
        assert metrology.state == "locked"
        assert all(len(each.cells()) == len(each.COLUMNS) for each in shown)
        json.dumps(to_data(shown), allow_nan=False)


class TestEveryClock:
    def test_sleeping_is_what_makes_time_pass_and_exactly_so(self, devices):
        start = devices.clock.now()
        for _ in range(25):
            devices.clock.sleep(0.04)
        assert devices.clock.now() - start == pytest.approx(1.0, abs=1e-9)

    @pytest.mark.parametrize("seconds", [-1.0, np.nan, np.inf])
    def test_time_neither_goes_back_nor_to_nowhere(self, devices, seconds):
        with pytest.raises(ElastocalError, match="sleep"):
            devices.clock.sleep(seconds)
