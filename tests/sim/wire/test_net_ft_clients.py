"""Clients of other people read the simulated Net F/T box (extra ``interop``); its TCP commands."""

import socket
import struct

import numpy as np
import pytest

from elastocal.cell import WallClock
from elastocal.sim.wire import LiveCell
from elastocal.sim.wire.net_ft import NetFtBox, NetFtServer
from support.simulated import QUIET, example_cell
from support.waiting import until


@pytest.fixture
def live():
    return LiveCell(example_cell(simulation=QUIET), 3, WallClock(rate=10.0))


@pytest.fixture
def server(live):
    server = NetFtServer(live, box=NetFtBox.of(live.cell, "N", "N-mm"))
    server.start()
    yield server
    server.close()


def test_pynetft_reads_counts_units_and_wrenches(live, server):
    pynetft = pytest.importorskip("pynetft", reason="the extra interop is not installed")
    config = pynetft.Config(
        sensor_host="127.0.0.1", rdt_port=server.ports["udp"], http_port=server.ports["http"]
    )
    with pynetft.Client(config, queue_size=256) as client:
        samples = client.samples()
        seen = [next(samples) for _ in range(100)]
        health = client.health()
    truth = live.wrench()
    assert health.sensor_configuration.calibration.torque_unit == "N-mm"
    np.testing.assert_allclose(seen[-1].force, truth.force, atol=1e-3)
    np.testing.assert_allclose(seen[-1].torque, 1e3 * truth.moment, atol=1e-1)
    assert [each.rdt_sequence for each in seen] == list(range(1, 101))
    assert (health.lost_count, health.malformed_count, health.ft_stall_count) == (0, 0, 0)


def test_pynetft_stops_at_a_status_that_is_serious(server):
    pynetft = pytest.importorskip("pynetft", reason="the extra interop is not installed")
    config = pynetft.Config(
        sensor_host="127.0.0.1",
        rdt_port=server.ports["udp"],
        http_port=server.ports["http"],
        recovery_policy=pynetft.RecoveryPolicy.FAIL_STOP,
    )
    with pynetft.Client(config) as client:
        samples = client.samples()
        next(samples)
        server.box.status = 0x80004000
        with pytest.raises(pynetft.SensorFaultError):
            for _ in samples:
                pass


def test_netft_reads_counts(live, server):
    netft = pytest.importorskip("NetFT", reason="the extra interop is not installed")
    client = netft.Sensor("127.0.0.1")
    # It knows one port only.
    client.sock.connect(("127.0.0.1", server.ports["udp"]))
    client.sock.settimeout(5.0)
    try:
        counts = client.getMeasurement()
        client.startStreaming(handler=False)
        streamed = [client.receive() for _ in range(20)]
        client.stopStreaming()
    finally:
        client.sock.close()
    truth = live.wrench()
    scale = np.repeat([server.box.counts_per_force, 1e3 * server.box.counts_per_torque], 3)
    wanted = scale * np.concatenate([truth.force, truth.moment])
    for each in (counts, *streamed):
        np.testing.assert_allclose(each, wanted, atol=1.0)


def command(code, orders=0):
    return struct.pack(">B15xHH", code, 0, orders)


def exactly(line, count):
    data = b""
    while len(data) < count:
        more = line.recv(count - len(data))
        assert more, "the box closed the line"
        data += more
    return data


def calibration(line):
    line.sendall(command(1))
    header, force, torque, cpf, cpt, *scales = struct.unpack(">HBBII6H", exactly(line, 24))
    assert (header, force, torque) == (0x1234, 2, 4)
    return np.repeat([cpf, cpt], 3) / np.array(scales)


def reading(line, orders=0):
    line.sendall(command(0, orders))
    header, status, *counts = struct.unpack(">HH6h", exactly(line, 16))
    assert header == 0x1234
    return status, np.array(counts)


def test_readft_gives_the_wrench_in_counts_over_the_scale_of_readcalinfo(live, server):
    with socket.create_connection(("127.0.0.1", server.ports["tcp"]), 10.0) as line:
        per_unit = calibration(line)
        until(lambda: reading(line)[1].any())
        status, counts = reading(line)
        truth = live.wrench()
        wanted = np.concatenate([truth.force, 1e3 * truth.moment])
        assert np.abs(counts / per_unit - wanted).max() < 1.0 / per_unit.min()
        assert status == 0
        server.box.status = 0x80020000
        until(lambda: reading(line)[0] == 0x8002)


def test_readft_can_take_the_bias(server):
    with socket.create_connection(("127.0.0.1", server.ports["tcp"]), 10.0) as line:
        until(lambda: reading(line)[1].any())
        assert server.box.bias == (0,) * 6
        reading(line, orders=1)
        assert any(server.box.bias)
        until(lambda: not reading(line)[1].any())


def test_a_client_that_stays_keeps_no_other_from_the_calibration(server):
    with (
        socket.create_connection(("127.0.0.1", server.ports["tcp"]), 10.0) as first,
        socket.create_connection(("127.0.0.1", server.ports["tcp"]), 10.0) as other,
    ):
        first.sendall(command(1)[:7])
        assert calibration(other).all()
        first.sendall(command(1)[7:])
        assert exactly(first, 24)[:2] == b"\x12\x34"


@pytest.mark.parametrize("code", [2, 3])
def test_what_writes_to_the_box_is_refused(server, code):
    with socket.create_connection(("127.0.0.1", server.ports["tcp"]), 10.0) as line:
        line.sendall(command(code))
        assert struct.unpack(">HBB", exactly(line, 4)) == (0x1234, code, 1)
