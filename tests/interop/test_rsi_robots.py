"""Other people's idea of a robot talks to our driver's link.

The echo server is that of ``rsipi``, which is no dependency: see test_rsipi.py. The plain robot
does as the simulators of ros-industrial and kroshu do: it counts datagrams, by 1.
"""

import re
import socket
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from elastocal.cell import WallClock
from elastocal.drivers.kuka_rsi import Bounds, RsiSettings, controller_files
from elastocal.drivers.kuka_rsi.corrections import PathCorrections
from elastocal.drivers.kuka_rsi.link import LinkAddress, RsiLink
from elastocal.sim.wire._rsi_messages import EthernetConfig
from support.cli import PATIENCE
from support.simulated import example_cell
from support.waiting import until

WANTED = np.array([0.5e-3, -0.2e-3, 0.1e-3])
BOUNDS = Bounds(
    correction=2e-3, poscorr=5e-3, monitor=6e-3, turn=0.1, speed=0.05, force=1e3, travel=0.01
)


@dataclass
class Steady:
    """Wants one correction, whatever the robot says."""

    heard: list = field(default_factory=list)

    def correction(self, message, _now, _begins):
        self.heard.append(message)
        return WANTED


@pytest.fixture
def linked():
    """Return what opens a link that corrects a path, and its source of corrections."""
    opened = []

    def start(sentype):
        source = Steady()
        handler = PathCorrections(source, BOUNDS, 0.004, sentype)
        link = RsiLink(LinkAddress("127.0.0.1", 0, "127.0.0.1", 0.004), handler, WallClock())
        link.start()
        opened.append(link)
        return link, source

    yield start
    for link in opened:
        link.close()


def test_a_plain_robot_that_counts_by_one_loses_nothing(linked):
    link, source = linked("ImFree")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as robot:
        robot.bind(("127.0.0.1", 0))
        robot.settimeout(PATIENCE)
        corrected = np.zeros(3)
        for ipoc in range(60):
            x, y, z = np.array([1620.9, 0.0, 1909.9]) + corrected
            robot.sendto(
                f'<Rob TYPE="KUKA"><RIst X="{x:.4f}" Y="{y:.4f}" Z="{z:.4f}" A="0" B="90" C="0"/>'
                f'<RSol X="1620.9" Y="0" Z="1909.9" A="0" B="90" C="0"/>'
                f'<AIPos A1="0" A2="-90" A3="90" A4="0" A5="90" A6="0"/><Delay D="0"/>'
                f"<IPOC>{ipoc}</IPOC></Rob>".encode(),
                ("127.0.0.1", link.port),
            )
            answer = robot.recv(4096).decode()
            assert f"<IPOC>{ipoc}</IPOC>" in answer
            corrected = np.array([float(v) for v in re.findall(r' [XYZ]="([-\d.]+)"', answer)])
    np.testing.assert_allclose(corrected, 1e3 * WANTED, atol=1e-4)
    patience = time.monotonic() + PATIENCE
    while (counts := link.statistics()).answered < 60 and time.monotonic() < patience:
        time.sleep(0.01)  # an answer is counted when it has been sent
    assert (counts.answered, counts.lost, counts.jumps, counts.malformed) == (60, 0, 0, 0)
    np.testing.assert_allclose(source.heard[-1].actual[:3], [1621.4, -0.2, 1910.0], atol=1e-3)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_the_echo_server_of_rsipi_is_corrected(linked, tmp_path, monkeypatch):
    rsipi = pytest.importorskip("RSIPI", reason="rsipi is not installed")
    monkeypatch.chdir(tmp_path)  # it writes logs where it stands
    from RSIPI.rsi_echo_server import EchoServer

    link, source = linked("ImFree")
    text = Path(rsipi.context("basic")).read_text("utf-8-sig")
    path = tmp_path / "ethernet.xml"
    path.write_text(text.replace("64000", str(link.port)).replace("10.10.10.10", "127.0.0.1"))
    server = EchoServer(str(path), mode="absolute", timeout_packets=10**6)
    server.start()
    try:
        until(lambda: len(source.heard) > 300)
        actual = np.array(server.state["RIst"]["X"]), server.state["RIst"]["Y"]
    finally:
        server.stop()
    np.testing.assert_allclose(actual, [0.5, -0.2], atol=1e-4)
    counts = link.statistics()
    assert (counts.jumps, counts.malformed, counts.foreign) == (0, 0, 0)
    np.testing.assert_allclose(source.heard[-1].actual[:3], [0.5, -0.2, 0.1], atol=1e-3)
    print(counts.sentence(), "; rejected by the echo server:", server.faulty_packets)


@pytest.mark.parametrize(("mode", "channels"), [("run", 22), ("comp", 7), ("meas", 0)])
def test_the_simulated_controller_takes_the_files_made_for_a_real_one(mode, channels):
    settings = RsiSettings(mode="contact", port=59152, delay="12 ms")
    files = controller_files(example_cell(), settings)
    config = EthernetConfig.from_xml(files[f"elcal_{mode}.xml"].decode("ascii"))
    assert (config.port, config.sentype, config.only_send) == (59152, "elastocal", mode == "meas")
    assert len(config.receive) == channels
    holds = {each.hold for each in config.receive if each.tag.startswith("RKorr")}
    assert holds == {"run": {False}, "comp": {True}, "meas": set()}[mode]
