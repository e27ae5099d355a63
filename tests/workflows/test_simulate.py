"""The simulated cell on the wire, as a command."""

import json

import pytest

from elastocal import workflows
from elastocal.cell import load_cell, write_example
from elastocal.errors import DeviceError
from elastocal.sim.wire import servers, suited_servers
from elastocal.workflows._operator_and_devices import rig_of
from support.simulated import example_cell


class Echo:
    """A server of nothing."""

    def __init__(self, live, told):
        self.live, self.told, self.log = live, told, []
        self.ports = {"udp": told.port() or 5555, "tcp": 6666}

    def start(self):
        self.log.append("start")

    def close(self):
        self.log.append("close")


@pytest.fixture
def made(monkeypatch):
    """Servers of nothing, as they are made."""
    made = []

    def make(live, told):
        made.append(Echo(live, told))
        return made[-1]

    servers.wire_servers()  # those of ours are registered once a process
    monkeypatch.setattr(servers, "SERVERS", {"echo": make})
    return made


def test_it_serves_while_the_caller_is_busy_and_closes_then(made, tmp_path):
    cell, file = example_cell(), tmp_path / "ports.json"
    seen = []

    def meanwhile(found):
        seen.append((found.lines(), json.loads(file.read_text()), list(made[0].log)))

    workflows.simulate(cell.path, out=file, rate=50.0, meanwhile=meanwhile)
    ((lines, written, log),) = seen
    assert lines == ["echo udp 127.0.0.1:5555 tcp 127.0.0.1:6666"]
    assert written["ports"] == {"echo": {"udp": 5555, "tcp": 6666}}
    assert log == ["start"]
    assert made[0].log == ["start", "close"]
    assert made[0].live.clock.rate == 50.0


def test_servers_are_closed_when_the_caller_fails(made):
    def fail(_):
        raise RuntimeError

    with pytest.raises(RuntimeError):
        workflows.simulate(example_cell().path, meanwhile=fail)
    assert made[0].log == ["start", "close"]


def test_a_device_without_simulator_is_refused_with_the_nearest(made):
    with pytest.raises(DeviceError, match="no simulator of 'ecco'; did you mean 'echo'"):
        workflows.simulate(example_cell().path, devices="ecco")


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), 1e4])
def test_an_impossible_rate_is_refused(made, rate):
    with pytest.raises(DeviceError, match=r"rate is .*: must be above 0"):
        workflows.simulate(example_cell().path, rate=rate)


@pytest.mark.parametrize(
    ("like", "wanted"),
    [
        ("afp", {"kuka_rsi", "net_ft", "line_stream"}),
        ("machining", {"kuka_rsi", "net_ft", "line_stream"}),
        ("ur20", {"rtde", "line_stream"}),
    ],
)
def test_an_example_on_the_wire_names_devices_that_are_served(tmp_path, like, wanted):
    cell = load_cell(write_example(tmp_path, like, wire=True)[0])
    rig = rig_of(cell)
    assert set(rig.drivers) == wanted
    assert wanted <= set(suited_servers(cell.robot))
    ports = [
        value
        for kinds in rig.wanted.values()
        for settings in kinds.values()
        for key, value in settings
        if key.endswith("port")
    ]
    assert len(set(ports)) == len(ports)


def test_an_example_is_simulated_unless_it_is_asked_for(tmp_path):
    rig = rig_of(load_cell(write_example(tmp_path, "afp")[0]))
    assert set(rig.drivers) == {"simulated"}
