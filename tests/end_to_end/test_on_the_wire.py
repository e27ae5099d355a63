"""Procedure 1 with everything on the wire: RSI arm, Net F/T box, line stream, over loopback."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from elastocal import workflows
from elastocal.dataset import read_dataset
from support.run_cells import planned_cell

QUIET = min(1.0, (os.cpu_count() or 1) / max(os.getloadavg()[0], 1.0))
RATE = float(os.environ.get("ELASTOCAL_WIRE_RATE", max(0.25, QUIET)))
"""Seconds of the cell a second of the wall, 250 messages each way in each of them: slow motion
where the machine has other things to do."""
NOISE = 16e-6
"""Standard deviation of a deflection's component between two runs in process, in m: over six seeds
of this cell and plan; stops, slips, ramps and sensors differ."""
ENTRY = "from elastocal.cli.main import run; run()"


def free(kind: socket.SocketKind) -> int:
    with socket.socket(socket.AF_INET, kind) as line:
        line.bind(("127.0.0.1", 0))
        return line.getsockname()[1]


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


@pytest.mark.slow
@pytest.mark.end_to_end
def test_a_run_over_sockets_is_the_run_in_process(tmp_path):
    planned = planned_cell(tmp_path, 3)
    text = planned.cell.read_text(encoding="utf-8")
    text = text.replace("\nsimulation:", "\nsimulation:\n  sensor: {rate: 500 Hz}", 1)
    planned.cell.write_text(text, encoding="utf-8")
    wired = planned.with_text("wired.yaml", devices())
    process = simulated(wired.cell, tmp_path / "ports.json")
    try:
        over = workflows.run(wired.cell, plan=wired.plan, out=tmp_path / "over", confirmed=True)
    finally:
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=30)
    assert process.returncode == 0
    ports = json.loads((tmp_path / "ports.json").read_text())["ports"]
    lines = out.decode().splitlines()
    assert (
        {line.split()[0] for line in lines} == set(ports) == {"kuka_rsi", "net_ft", "line_stream"}
    )
    assert (over.figures.readings, over.figures.failed_attempts) == ({"ok": 6}, 0)

    workflows.run(planned.cell, plan=planned.plan, out=tmp_path / "within", confirmed=True)
    apart = deflections(tmp_path / "over") - deflections(tmp_path / "within")
    assert np.sqrt(np.mean(apart**2)) < 2.0 * np.sqrt(2.0) * NOISE
    forces = [read_dataset(tmp_path / name / "dataset.nc").force for name in ("over", "within")]
    np.testing.assert_allclose(*forces, atol=10.0)
