"""``measure-delay`` finds the delay of the simulated controller."""

import socket

import pytest

from elastocal import workflows
from support.ports import free
from support.simulated import QUIET, example_cell


@pytest.mark.slow
@pytest.mark.parametrize("delay", [8, 12, 120])
def test_the_measured_delay_is_the_true_one(delay, tmp_path):
    udp, tcp = socket.SOCK_DGRAM, socket.SOCK_STREAM
    arm = {"driver": "kuka_rsi", "mode": "contact", "port": free(udp), "delay": f"{delay} ms"}
    sensor = {"driver": "net_ft", "port": free(udp), "http_port": free(tcp), "tcp_port": free(tcp)}
    metrology = {"driver": "line_stream", "port": free(tcp)}
    devices = {"arm": arm, "sensor": sensor, "metrology": metrology}
    cell = example_cell(simulation=QUIET, devices=devices)
    found = []

    def measure(_):
        out = tmp_path / "commissioning.json"
        found.append(workflows.measure_delay(cell.path, out=out, seconds=3.0, confirmed=True))

    workflows.simulate(cell.path, meanwhile=measure)
    print(found[0].measured.delay, found[0].measured.link.sentence())
    assert found[0].measured.delay == pytest.approx(1e-3 * delay, abs=1.5e-3)
