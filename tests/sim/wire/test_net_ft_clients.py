"""Other people's clients read the simulated Net F/T box; extra ``interop``."""

import numpy as np
import pytest

from elastocal.cell import WallClock
from elastocal.sim.wire import LiveCell, NetFtBox, NetFtServer
from support.simulated import QUIET, example_cell


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
