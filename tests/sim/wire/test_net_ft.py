"""The simulated Net F/T box and its driver over loopback: two readings of one layout."""

import http.client
import socket
import time
from contextlib import closing

import numpy as np
import pytest

from elastocal.cell import WallClock
from elastocal.drivers.net_ft import NetFtSettings
from elastocal.drivers.net_ft.driver import BoxLine
from elastocal.errors import DeviceError
from elastocal.sim.wire import LiveCell, Told, wire_servers
from elastocal.sim.wire.net_ft import NetFtBox, NetFtServer
from support.simulated import QUIET, example_cell

RATE = 20.0
"""Seconds of the cell a second of the wall."""


@pytest.fixture
def live():
    return LiveCell(example_cell(simulation=QUIET), 3, WallClock(rate=RATE))


@pytest.fixture
def server(live):
    server = NetFtServer(live)
    server.start()
    yield server
    server.close()


def settings(server, **changes):
    ports = server.ports
    told = {"port": ports["udp"], "http_port": ports["http"], "tcp_port": ports["tcp"]}
    return NetFtSettings(**told | changes)


def connected(server, **changes):
    return closing(BoxLine(settings(server, **changes), WallClock(rate=RATE)))


def read_until(line, samples):
    blocks = []
    for _ in range(500):
        blocks.append(line.sensor.read())
        if sum(map(len, blocks)) >= samples:
            return blocks
        time.sleep(0.01)
    raise AssertionError("too few samples")


def reason(line):
    """Wait until the line is refused; return why."""
    for _ in range(500):
        try:
            line.sensor.read()
        except DeviceError as error:
            return str(error)
        time.sleep(0.01)
    raise AssertionError("nothing was wrong")


@pytest.mark.parametrize(("force", "torque"), [("N", "N-m"), ("N", "N-mm"), ("lb", "lb-in")])
def test_the_driver_reads_the_wrench_of_the_cell_in_every_unit(live, force, torque):
    server = NetFtServer(live, box=NetFtBox.of(live.cell, force, torque))
    server.start()
    try:
        with connected(server) as line:
            blocks = read_until(line, 50)
            assert line.sensor.rate == live.sensor().rate
            assert line.sensor.lost == 0
        truth = live.wrench()
        for name in ("force", "moment"):
            seen = np.concatenate([getattr(block, name) for block in blocks])
            np.testing.assert_allclose(
                seen, np.tile(getattr(truth, name), (len(seen), 1)), atol=1e-4
            )
    finally:
        server.close()


def test_another_client_takes_the_stream_and_the_driver_says_so(server):
    with connected(server) as line, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as thief:
        read_until(line, 5)
        thief.sendto(bytes.fromhex("1234000200000000"), ("127.0.0.1", server.port))
        assert "another client has taken the stream" in reason(line)


def test_a_box_that_goes_off_is_told_from_a_stream_that_is_taken(server):
    with connected(server) as line:
        read_until(line, 5)
        server.close()
        assert "its page does not answer: is it off" in reason(line)


def test_a_box_that_was_off_for_a_moment_is_refused(server):
    with connected(server) as line:
        read_until(line, 100)
        server.restart()
        assert "back to" in reason(line)


def test_lost_records_are_counted(server):
    with connected(server) as line:
        read_until(line, 5)
        server.box.lose = 3
        read_until(line, 20)
        assert line.sensor.lost == 3


def test_a_box_that_stalls_is_refused(server):
    with connected(server) as line:
        read_until(line, 5)
        server.box.stalled = True
        assert "it has stalled" in reason(line)


def test_a_box_in_trouble_says_which(server):
    with connected(server) as line:
        server.box.status = 0x80000004
        assert "status 0x80000004: error, temperature" in reason(line)


def test_counts_that_change_while_it_streams_are_noticed(server, monkeypatch):
    monkeypatch.setattr("elastocal.drivers.net_ft.driver._LOOK_AGAIN", 0.02)
    for tcp_port in (server.ports["tcp"], None):
        with connected(server, tcp_port=tcp_port) as line:
            read_until(line, 5)
            server.box.counts_per_force *= 2
            assert "it was set to another one" in reason(line)


def test_an_answer_that_is_nonsense_ends_no_stream(server, monkeypatch):
    monkeypatch.setattr("elastocal.drivers.net_ft.driver._LOOK_AGAIN", 0.02)
    asked = []

    class Garbled(NetFtBox):
        def calibration(self):
            asked.append(len(asked))
            return b"\0\0" + super().calibration()[2:]

    with connected(server) as line:
        server.box = Garbled(**vars(server.box))
        while len(asked) < 3:
            read_until(line, 5)
        assert not line.sensor.failed
        read_until(line, 5)


def test_page_and_calibration_that_differ_are_refused(server):
    class Lying(NetFtBox):
        def calibration(self):
            return super().calibration()[:4] + bytes([0, 0, 0, 9]) + super().calibration()[8:]

    server.box = Lying(**vars(server.box))
    with pytest.raises(DeviceError, match=r"1e\+0\d counts a N.* by its page, 9 counts a N"):
        BoxLine(settings(server), WallClock())


@pytest.mark.parametrize(
    ("box", "told", "why"),
    [
        ({"transform": (0, 0, 12, 0, 0, 0)}, {}, "has the tool transform 0, 0, 12, 0, 0, 0"),
        ({"bias": (0, 0, 5, 0, 0, 0)}, {}, "has a software bias, which hides the tool's weight"),
        ({"rdt": False}, {}, "RDT is switched off"),
        ({}, {"tool_transform": (1.0,) * 6}, "has the tool transform 0, 0, 0"),
    ],
)
def test_a_box_that_is_set_up_for_something_else_is_refused(server, box, told, why):
    for name, value in box.items():
        setattr(server.box, name, value)
    with pytest.raises(DeviceError, match=why):
        BoxLine(settings(server, **told), WallClock())


def test_a_tool_transform_that_the_cell_states_is_accepted(server):
    server.box.transform = (0.0, 0.0, 12.0, 0.0, 0.0, 90.0)
    with connected(server, tool_transform=server.box.transform) as line:
        read_until(line, 1)


def test_a_box_that_is_not_there_is_told_at_once():
    free = NetFtServer(LiveCell(example_cell(), 0, WallClock()))
    ports = settings(free)
    free.close()
    with pytest.raises(DeviceError, match=r"Net F/T at 127.0.0.1 does not answer: Connection refu"):
        BoxLine(ports, WallClock())


def test_a_stream_that_does_not_come_is_told_from_a_box_that_is_off(server, monkeypatch):
    monkeypatch.setattr("elastocal.drivers.net_ft.driver._SILENCE", 0.02)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as deaf:
        deaf.bind(("127.0.0.1", 0))
        port = deaf.getsockname()[1]
        with pytest.raises(DeviceError, match=f"no stream comes from UDP port {port}"):
            BoxLine(settings(server, port=port), WallClock())


def test_the_driver_never_asks_for_a_software_bias(server):
    asked = []
    obey = server._obey
    server._obey = lambda datagram, client: (asked.append(datagram[2:4]), obey(datagram, client))
    with connected(server) as line:
        read_until(line, 50)
    time.sleep(0.02)
    assert asked == [bytes.fromhex("0002"), bytes.fromhex("0000")]


def test_only_the_page_is_served(server):
    with closing(http.client.HTTPConnection("127.0.0.1", server.ports["http"])) as line:
        line.request("GET", "/etc/passwd")
        assert line.getresponse().status == 404


def test_garbage_is_not_obeyed(server):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
        client.settimeout(0.05)
        client.connect(("127.0.0.1", server.port))
        for garbage in (b"", b"\x12", bytes(8), bytes(64), bytes.fromhex("1234123400000000")):
            client.send(garbage)
        with pytest.raises(TimeoutError):
            client.recv(100)
        client.send(bytes.fromhex("1234000300000007"))
        assert [len(client.recv(1000)) for _ in range(2)] == [5 * 36, 2 * 36]


def test_it_is_the_server_of_its_driver(live):
    server = wire_servers()["net_ft"](live, Told())
    assert list(server.ports) == ["udp", "tcp", "http"]
    server.close()
    with pytest.raises(DeviceError, match=r"cannot take port 1 of 203\.0\.113\.1"):
        NetFtServer(live, 1, address="203.0.113.1")
