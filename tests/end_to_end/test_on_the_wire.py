"""Procedure 1 with everything on the wire: RSI or RTDE arm, Net F/T box, line stream, loopback."""

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import elastocal as ec
from elastocal import locks
from elastocal.dataset import read_dataset
from elastocal.drivers import rtde
from elastocal.sim.wire.rtde import PORTS
from support import live_bench
from support.cli import ENTRY, PATIENCE
from support.ports import free
from support.run_cells import PlannedCell, planned_cell
from support.ur_client import UrClient

QUIET = min(1.0, (os.cpu_count() or 1) / max(os.getloadavg()[0], 1.0))
RATE = float(os.environ.get("ELASTOCAL_WIRE_RATE", max(0.25, QUIET)))
"""Seconds of the cell a second of the wall, 250 messages each way in each of them: slow motion
where the machine has other things to do."""
NOISE = 16e-6
"""Standard deviation of a deflection's component between two runs in process, in m: over six seeds
of the fibre placement cell and its plan (the UR20: 18e-6 over four); stops, slips, ramps and
sensors differ."""


def devices() -> str:
    udp, tcp = socket.SOCK_DGRAM, socket.SOCK_STREAM
    return f"""
devices:
  arm: {{driver: kuka_rsi, mode: contact, port: {free(udp)}, delay: "8 ms", ptp_percent: 30}}
  sensor: {{driver: net_ft, port: {free(udp)}, http_port: {free(tcp)}, tcp_port: {free(tcp)}}}
  metrology: {{driver: line_stream, port: {free(tcp)}}}
  clock_rate: {RATE:g}
"""


def simulated(cell: Path, ports: Path) -> subprocess.Popen:
    """Start ``elastocal simulate``; return when all of it answers."""
    words = ["simulate", str(cell), "--ports", str(ports)]
    process = subprocess.Popen(
        [sys.executable, "-c", ENTRY, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    while not ports.exists():
        assert process.poll() is None, process.communicate()[1].decode()
        time.sleep(0.05)
    return process


def deflections(run: Path) -> np.ndarray:
    data = read_dataset(run / "dataset.nc")
    return np.asarray(data.marker_displacement) - np.asarray(data.controller_displacement)


def run_over_sockets(cell: Path, plan: Path, out: Path, drivers: set[str]):
    """Run a cell against its simulators in another process; each driver has one."""
    ports = out.with_suffix(".json")
    process = simulated(cell, ports)
    try:
        found = ec.run(cell, plan=plan, out=out, confirmed=True)
    finally:
        process.send_signal(signal.SIGINT)
        told, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0
    served = json.loads(ports.read_text())["ports"]
    assert {line.split()[0] for line in told.decode().splitlines()} == set(served) == drivers
    return found


def require_same(over: Path, within: Path) -> None:
    """Hold the dataset over sockets against that in process: apart by noise alone."""
    apart = deflections(over) - deflections(within)
    assert np.sqrt(np.mean(apart**2)) < 2.0 * np.sqrt(2.0) * NOISE
    forces = [read_dataset(each / "dataset.nc").force for each in (over, within)]
    np.testing.assert_allclose(*forces, atol=10.0)


def refused_meanwhile(wired: PlannedCell, out: Path, told: list[tuple[int, str]]) -> None:
    """Try everything else that talks to devices while a run goes on."""
    live = wired.cell.with_name("live.yaml")
    limits = 'mode: compensation, largest_correction: "1 mm", correction_speed: "30 mm/s"'
    live.write_text(wired.cell.read_text().replace("mode: contact", limits))
    model = live_bench.write_model_of(live, live.with_suffix(".json"))
    while not (out / "journal.jsonl").is_file() or "approach" not in (
        out / "journal.jsonl"
    ).read_text(encoding="utf-8"):
        time.sleep(0.2)
    plan, again = ("--plan", wired.plan, "--yes"), out.with_name("again")
    for words in (
        ("run", wired.cell, "--out", again, *plan),
        ("run", wired.cell, "--out", out, "--resume", *plan),
        ("measure-delay", wired.cell, "--out", out.with_name("delay.json"), "--yes"),
        ("live", live, "--model", model, "--arm"),
        ("simulate", wired.cell),
    ):
        done = subprocess.run(
            [sys.executable, "-c", ENTRY, *map(str, words)],
            capture_output=True,
            text=True,
            check=False,
        )
        told.append((done.returncode, done.stderr.strip().splitlines()[-1]))


@pytest.mark.slow
@pytest.mark.end_to_end
def test_a_run_over_sockets_is_the_run_in_process_whatever_else_is_tried(tmp_path, monkeypatch):
    # The folder that programs of their own take.
    monkeypatch.setattr(locks, "SHARED", Path("/tmp/elastocal-locks"))
    planned = planned_cell(tmp_path, 3)
    text = planned.cell.read_text(encoding="utf-8")
    text = text.replace("\nsimulation:", "\nsimulation:\n  sensor: {rate: 500 Hz}", 1)
    planned.cell.write_text(text, encoding="utf-8")
    wired = planned.with_text("wired.yaml", devices())
    drivers = {"kuka_rsi", "net_ft", "line_stream"}
    told: list[tuple[int, str]] = []
    others = threading.Thread(target=refused_meanwhile, args=(wired, tmp_path / "over", told))
    others.start()
    over = run_over_sockets(wired.cell, wired.plan, tmp_path / "over", drivers)
    others.join(PATIENCE)
    assert [code for code, _ in told] == [1, 1, 1, 1, 1]
    asked = ["elastocal run"] * 4 + ["elastocal simulate"]
    assert all(f"is in use by {by}" in text for by, (_, text) in zip(asked, told, strict=True))
    assert not (tmp_path / "again").exists()
    assert (over.figures.readings, over.figures.failed_attempts) == ({"ok": 6}, 0)
    assert over.figures.lines == over.summary.lines
    devices_seen = [each.device.split(" ")[0] for each in over.figures.lines]
    assert devices_seen == ["Net", *["line_stream"] * (len(devices_seen) - 2), "kuka_rsi"]
    assert min(each.received for each in over.figures.lines if each.received) > 100
    ec.run(planned.cell, plan=planned.plan, out=tmp_path / "within", confirmed=True)
    require_same(tmp_path / "over", tmp_path / "within")


def ur_devices() -> str:
    udp, tcp = socket.SOCK_DGRAM, socket.SOCK_STREAM
    return f"""
devices:
  arm: {{driver: rtde}}
  sensor: {{driver: net_ft, port: {free(udp)}, http_port: {free(tcp)}, tcp_port: {free(tcp)}}}
  metrology: {{driver: line_stream, port: {free(tcp)}}}
  clock_rate: {min(RATE, 1.0):g}
"""


@pytest.fixture(params=["ur-rtde", "a client of ours"])
def ur_client(request, monkeypatch):
    """Let the driver talk through the package ``ur-rtde``, or through a client without it."""
    for port in PORTS.values():
        with socket.socket() as line:
            if line.connect_ex(("127.0.0.1", port)) == 0:
                pytest.skip(f"somebody else has port {port}, which a controller's clients take")
    if request.param == "ur-rtde":
        pytest.importorskip("rtde_control", reason="pip install 'elastocal[ur]'")
        return
    opened = []

    def receive(*_):
        opened.append(UrClient(SimpleNamespace(ports=PORTS)))
        return opened[0]

    def control(*_):
        opened[0].reuploadScript()
        return opened[0]

    monkeypatch.setattr(rtde.DRIVER, "_open_receive", receive)
    monkeypatch.setattr(rtde.DRIVER, "_open_control", control)


@pytest.mark.slow
@pytest.mark.end_to_end
@pytest.mark.usefixtures("ur_client")
def test_the_procedure_over_rtde_is_the_run_in_process(tmp_path):
    """A UR20 presses by force mode; sensor and tracker are other makers'."""
    planned = planned_cell(tmp_path, 3, "ur20")
    wired = planned.with_text("wired.yaml", ur_devices())
    text = wired.cell.read_text(encoding="utf-8")
    # The package holds Python's lock for up to 0.1 s; a loaded machine adds to that.
    text = text.replace("\nprocedure:", '\nprocedure:\n  stale: "1 s"', 1)
    wired.cell.write_text(text, encoding="utf-8")
    drivers = {"rtde", "net_ft", "line_stream"}
    over = run_over_sockets(wired.cell, wired.plan, tmp_path / "over", drivers)
    assert (over.figures.readings, over.figures.failed_attempts) == ({"ok": 6}, 0)
    ec.run(planned.cell, plan=planned.plan, out=tmp_path / "within", confirmed=True)
    require_same(tmp_path / "over", tmp_path / "within")
