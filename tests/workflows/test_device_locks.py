"""One program talks to a cell's devices: locks by device, ports before questions, no folder."""

import re
import socket
import threading

import pytest
import yaml

from elastocal import workflows
from elastocal.cell import DevicePlace, LocalPort
from elastocal.drivers import kuka_rsi
from elastocal.drivers.emscon.driver import EmsconSettings
from elastocal.drivers.line_stream.driver import LineStreamSettings
from elastocal.drivers.rtde.driver import RtdeSettings
from elastocal.errors import DeviceError
from elastocal.sim.wire.net_ft import NetFtServer
from elastocal.workflows._operator_and_devices import rig_of
from support.by_day import some_by_day
from support.cli import elastocal
from support.live_on_wire import LiveFiles, served
from support.ports import free
from support.run_cells import planned_cell
from support.simulated import example_cell
from support.waiting import until

UDP, TCP = socket.SOCK_DGRAM, socket.SOCK_STREAM
BOX = {"driver": "net_ft", "address": "10.11.12.13"}


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    """A cell with a plan."""
    return planned_cell(tmp_path_factory.mktemp("planned"), 3)


@pytest.fixture
def cell():
    return lambda **devices: example_cell(devices=devices)


def places(settings) -> list[str]:
    return [str(each) for each in settings.device_places()]


def test_devices_are_known_by_where_they_are():
    two = {"a": {"address": "10.0.0.1"}, "b": {"address": "10.0.0.2", "port": 701}}
    trackers = EmsconSettings.model_validate({"stations": two})
    assert places(trackers) == ["10.0.0.1:700", "10.0.0.2:701"]
    assert places(RtdeSettings(address="10.0.0.3")) == ["10.0.0.3:30004"]
    arm = kuka_rsi.RsiSettings(address="10.0.0.5", robot="10.0.0.4")
    assert places(arm) == ["10.0.0.5:49152", "10.0.0.4:49152"]
    assert arm.own_ports() == (LocalPort("udp", "10.0.0.5", 49152),)
    adapter = LineStreamSettings(address="10.0.0.6", port=7)
    assert (places(adapter), adapter.own_ports()) == (["10.0.0.6:7"], ())
    server = {"role": "server", "address": "10.0.0.5", "peer": "10.0.0.7", "port": 8}
    served = LineStreamSettings.model_validate(server)
    assert places(served) == ["10.0.0.7:8"]
    assert served.own_ports() == (LocalPort("tcp", "10.0.0.5", 8),)


def test_cells_that_name_one_box_exclude_one_another_and_others_do_not(cell):
    one = rig_of(cell(sensor=BOX))
    same = rig_of(cell(sensor=BOX | {"http_port": 8080}, arm={"driver": "kuka_rsi", "port": 0}))
    other = rig_of(cell(sensor=BOX | {"address": "10.11.12.14"}))
    with one.reserved("run"):
        with other.reserved("run"):
            pass
        with pytest.raises(DeviceError) as refused, same.reserved("live"):
            pass
    text = str(refused.value)
    assert "devices.sensor: 10.11.12.13:49152 is in use by elastocal run " in text
    assert re.search(r"\.yaml \(process \d+, \S+, since 20\d\d-\d\d-\d\d \d\d:\d\d:\d\d", text)
    assert "\n" not in text
    with same.reserved("live"):
        pass


def test_a_name_of_an_address_is_the_address(cell):
    by_name = rig_of(cell(sensor={"driver": "net_ft", "address": "localhost", "port": 9}))
    by_number = rig_of(cell(sensor={"driver": "net_ft", "port": 9}))
    with (
        by_name.reserved("run"),
        pytest.raises(DeviceError, match=r"127.0.0.1:9 is in use"),
        by_number.reserved("run"),
    ):
        pass


def test_who_asks_no_tracker_leaves_it_to_others(cell):
    rig = rig_of(cell(metrology={"driver": "emscon", "address": "10.11.12.15"}))
    with rig.reserved("live", ("arm", "sensor")), rig.reserved("run"):
        pass


def test_what_is_simulated_here_is_nobody_elses(cell):
    with rig_of(cell()).reserved("run"), rig_of(cell()).reserved("run"):
        pass


def test_where_nothing_can_be_locked_nothing_is_asked(cell, tmp_path, monkeypatch):
    monkeypatch.setattr("elastocal.locks.SHARED", tmp_path / "nowhere" / "shared")
    with (
        pytest.raises(DeviceError, match=r"sensor: .*cannot be locked .*No such file.*nowhere"),
        rig_of(cell(sensor=BOX)).reserved("run"),
    ):
        pass


def test_the_port_of_the_arm_is_taken_before_the_box_is_asked(planned):
    box = socket.create_server(("127.0.0.1", 0))
    box.settimeout(0.0)
    with box, socket.socket(socket.AF_INET, UDP) as taken:
        taken.bind(("127.0.0.1", 0))
        port, page = taken.getsockname()[1], box.getsockname()[1]
        wired = planned.with_text(
            "wired.yaml",
            "devices:\n"
            f"  arm: {{driver: kuka_rsi, mode: contact, port: {port}}}\n"
            f"  sensor: {{driver: net_ft, http_port: {page}, port: {free(UDP)}}}\n",
        )
        out = planned.plan.with_name("run")
        found = elastocal("run", wired.cell, "--plan", wired.plan, "--out", out, "--yes")
        assert f"devices.arm: cannot listen at 127.0.0.1:{port}: Address already" in found.reason
        assert not out.exists()
        with pytest.raises(BlockingIOError):
            box.accept()


def test_two_simulators_of_one_device_exclude_one_another_and_no_client(cell):
    port = free(UDP)
    simulated = cell(arm={"driver": "kuka_rsi", "port": port})
    tried = []

    def meanwhile(_):
        with pytest.raises(DeviceError) as refused:
            workflows.simulate(simulated.path, meanwhile=lambda _: None)
        with rig_of(simulated).reserved("run"):
            tried.append(str(refused.value))

    workflows.simulate(simulated.path, meanwhile=meanwhile)
    assert f"simulated 127.0.0.1:{port} is in use by elastocal simulate" in tried[0]


def test_a_live_compensation_goes_on_while_others_are_refused(tmp_path, planned, monkeypatch):
    """Over sockets: nobody asks the box, nobody hears the controller, nothing is written."""
    files = LiveFiles.written(tmp_path / "live")
    devices = yaml.safe_load(files.cell.read_text())["devices"]
    devices["arm"] = {"driver": "kuka_rsi", "mode": "contact", "port": devices["arm"]["port"]}
    other = planned.with_text("other.yaml", yaml.safe_dump({"devices": devices})).cell
    refused, asked_of_box, obey = [], [], NetFtServer._obey
    monkeypatch.setattr(
        NetFtServer, "_obey", lambda box, *said: (asked_of_box.append(said), obey(box, *said))
    )

    def others() -> None:
        for words in (
            ("run", other, "--plan", planned.plan, "--out", tmp_path / "run", "--yes"),
            ("measure-delay", other, "--out", tmp_path / "delay.json", "--yes"),
            ("live", files.cell, "--model", files.model, "--tool", files.tool, "--arm"),
        ):
            refused.append(elastocal(*words))

    asked = threading.Event()

    def report(_) -> None:
        if not asked.is_set():
            asked.set()
            others()

    with served(files):
        found = workflows.live(
            files.cell, model=files.model, tool=files.tool, arm=True, duration=3.0, report=report
        )
        # The last datagram may still be on its way to the box.
        until(lambda: len(asked_of_box) >= 2)
    assert (found.problem, found.line.jumps, found.line.foreign) == (None, 0, 0)
    assert len(asked_of_box) == 2  # for the stream, and at the end for silence
    assert [each.reason.count("is in use by elastocal live") for each in refused] == [1, 1, 1]
    assert [each.name for each in tmp_path.iterdir()] == ["live"]


@pytest.mark.parametrize("address", some_by_day(["0.0.0.0", "::"]))
def test_an_address_for_all_networks_is_said_aloud_by_check_and_run(cell, address, planned):
    devices = {"arm": {"driver": "kuka_rsi", "address": address}}
    (text,) = rig_of(cell(**devices)).warnings
    assert text.startswith(f"devices.arm.address is {address}: whoever is in any network")
    wired = planned.with_text("open.yaml", yaml.safe_dump({"devices": devices}))
    assert text in elastocal("check", wired.cell).err + elastocal("check", wired.cell).out
    (lost,) = rig_of(cell(sensor=BOX | {"address": address})).warnings
    assert lost.startswith(f"devices.sensor: the address {address} names no device")
    assert rig_of(cell(sensor=BOX, arm={"driver": "kuka_rsi"})).warnings == []


def test_a_place_without_a_port_is_written_as_its_host():
    assert str(DevicePlace("10.0.0.1", 0)) == "10.0.0.1"
