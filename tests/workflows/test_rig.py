"""The rig of a cell: drivers found by name, asked in order, closed whatever happened."""

import numpy as np
import pytest

from elastocal.cell import KINDS, DeviceSet, WallClock
from elastocal.drivers import DRIVERS
from elastocal.errors import DeviceError, PluginError, SchemaError
from elastocal.sim.workcell import simulated_devices
from elastocal.workflows._operator_and_devices import rig_of
from support import drivers
from support.simulated import example_cell, places

SENSOR_ONLY = """
from typing import Any

from elastocal.cell import DeviceSet, DeviceSettings
from elastocal.errors import DeviceError

closed = []


class Settings(DeviceSettings):
    address: str = "127.0.0.1"
    port: int = 49152


class Feed:
    def newest(self):
        return None


class Driver:
    kinds = frozenset({"sensor"})
    real = False

    def settings(self, kind):
        return Settings

    def connect(self, cell, wanted, context):
        self.seen = wanted["sensor"], context

        def close():
            closed.append("sensor")
            raise DeviceError("the line was dead")

        sensor = object() if wanted["sensor"].port else None
        return DeviceSet(sensor=sensor, feed=Feed(), close=close)


DRIVER = Driver()
"""


@pytest.fixture
def bench(tmp_path, monkeypatch):
    """A driver of another maker."""
    drivers.install(tmp_path, monkeypatch, "bench_sensor", SENSOR_ONLY)
    import bench_sensor

    yield bench_sensor
    monkeypatch.delitem(__import__("sys").modules, "bench_sensor")


def mixed(**devices):
    return example_cell(devices={"sensor": {"driver": "bench_sensor"} | devices})


def test_a_driver_of_another_maker_is_found_by_its_entry_point(bench):
    assert "bench_sensor" in DRIVERS
    assert DRIVERS["bench_sensor"] is bench.DRIVER


def test_what_stands_under_a_device_is_checked_by_its_driver(bench):
    assert rig_of(mixed(port=7)).wanted["bench_sensor"]["sensor"].port == 7
    with pytest.raises(SchemaError, match=r"devices.sensor: unknown key .prt.; did you mean .port"):
        rig_of(mixed(prt=7))
    with pytest.raises(SchemaError, match=r"devices.arm: unknown key 'port'"):
        rig_of(example_cell(devices={"arm": {"driver": "simulated", "port": 7}}))


def test_a_driver_is_asked_only_for_what_it_makes(bench):
    with pytest.raises(DeviceError, match=r"devices.arm: .*makes none \(it makes: sensor\)"):
        rig_of(example_cell(devices={"arm": "bench_sensor"}))


def test_a_driver_that_cannot_be_loaded_says_why(tmp_path, monkeypatch):
    drivers.install(tmp_path, monkeypatch, "lame", "import no_such_package")
    with pytest.raises(PluginError, match=r"^driver 'lame' of lame 1.0 cannot be .*no_such_pac"):
        DRIVERS.named("lame")


def test_devices_of_two_drivers_share_the_clock_and_the_arm_comes_last(bench):
    rig = rig_of(mixed())
    assert tuple(rig.drivers) == ("bench_sensor", "simulated")
    assert not rig.real
    with rig.reserved("test") as reserved:
        devices = reserved.connect(0, 5.0)
    settings, context = bench.DRIVER.seen
    assert (settings.port, context.start, context.feed) == (49152, 5.0, None)
    assert devices.clock is context.clock
    assert isinstance(devices.clock, WallClock)
    assert 5.0 <= devices.arm.state().time <= devices.clock.now()
    with pytest.raises(DeviceError, match="the line was dead"):
        devices.close()


def test_what_was_made_is_closed_when_another_device_fails(bench):
    bench.closed.clear()
    with (
        rig_of(mixed(port=0)).reserved("test") as reserved,
        pytest.raises(DeviceError, match="driver 'bench_sensor' made none"),
    ):
        reserved.connect(0, 0.0)
    assert bench.closed == ["sensor"]


def test_time_runs_faster_only_on_this_machine(bench):
    devices = {"sensor": {"driver": "bench_sensor"}, "clock_rate": 20.0}
    with rig_of(example_cell(devices=devices)).reserved("test") as reserved:
        assert reserved.connect(0, 0.0).clock.rate == 20.0
    devices["sensor"]["address"] = "192.168.1.1"
    with pytest.raises(DeviceError, match=r"clock_rate is 20.*devices.sensor is at 192.168.1.1"):
        rig_of(example_cell(devices=devices))


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        ("metrology", {"driver": "emscon", "stations": {"station_1": {"address": "10.0.0.7"}}}),
        ("metrology", {"driver": "line_stream", "role": "server", "port": 7, "peer": "10.0.0.7"}),
        ("arm", {"driver": "kuka_rsi", "robot": "10.0.0.7"}),
    ],
)
def test_no_device_is_far_away_where_time_runs_faster(kind, told):
    devices = {kind: told, "clock_rate": 2.0}
    with pytest.raises(DeviceError, match=rf"clock_rate is 2, .*devices.{kind} is at 10.0.0.7"):
        rig_of(example_cell(devices=devices))
    assert rig_of(example_cell(devices=devices | {"clock_rate": 1.0}))


def test_where_all_is_simulated_the_devices_are_those_of_before():
    cell = example_cell()
    with rig_of(cell).reserved("test") as reserved:
        by_rig, before = reserved.connect(3, 5.0), simulated_devices(cell, 3, 5.0)
    for devices in (by_rig, before):
        devices.arm.enable()
        devices.arm.move_joints(places()[0].q_approach, 0.5)
        devices.clock.sleep(0.5)
    np.testing.assert_array_equal(by_rig.sensor.read().force, before.sensor.read().force)
    np.testing.assert_array_equal(
        by_rig.metrology.read().position, before.metrology.read().position
    )
    by_rig.close()


def test_the_clock_of_the_wall_keeps_its_rate():
    wall, pauses = [100.0], []
    clock = WallClock(7.0, 4.0, monotonic=lambda: wall[0], pause=pauses.append)
    wall[0] += 2.0
    assert clock.now() == 15.0
    clock.sleep(1.0)
    assert pauses == [0.25]


def test_a_set_of_devices_gives_nothing_back_by_default():
    assert DeviceSet().close() is None
    assert {"arm", "sensor", "metrology"} == set(KINDS)


def test_a_device_is_written_as_it_stands_in_the_cell_file(bench):
    told = {"driver": "bench_sensor", "port": 7}
    devices = example_cell(devices={"sensor": told}).file.model_dump(mode="json")["devices"]
    assert devices == {
        "arm": "simulated",
        "sensor": told,
        "metrology": "simulated",
        "clock_rate": 1.0,
    }
