"""The public program ``rsipi`` (its PC side) talks to our simulated controller.

It is no dependency: ``pip install --no-deps --target DIR rsipi`` and ``PYTHONPATH=DIR`` run these.
"""

import socket
from pathlib import Path

import pytest

from elastocal.cell import WallClock
from elastocal.sim.wire import LiveCell
from elastocal.sim.wire._rsi_messages import EthernetConfig
from elastocal.sim.wire.rsi import RsiContext, RsiServer, corrected_program
from support.ports import free
from support.simulated import QUIET, example_cell
from support.waiting import until

RSIPI = pytest.importorskip("RSIPI", reason="rsipi is not installed")


@pytest.mark.slow
@pytest.mark.parametrize("context", ["basic", "joints", "stop"])
def test_its_client_reads_the_pose_and_corrects_it(context, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # it writes logs where it stands
    port = free(socket.SOCK_DGRAM)
    text = Path(RSIPI.context(context)).read_text("utf-8-sig")
    path = tmp_path / "ethernet.xml"
    path.write_text(text.replace("64000", str(port)).replace("10.10.10.10", "127.0.0.1"))
    live = LiveCell(example_cell(simulation=QUIET), 0, WallClock())
    patient = RsiContext(program=corrected_program, patience=5.0)
    server = RsiServer(live, EthernetConfig.read(path), patient)
    with RSIPI.RSIAPI(str(path), rsi_mode="relative") as pc:
        pc.start()
        server.start()
        assert pc.wait_for_connection(timeout=20.0)
        until(lambda: server.statistics.answered > 50)
        before = pc.motion.get_current_pose()["X"]
        pc.motion.update_cartesian(X=0.02)
        until(lambda: pc.motion.get_current_pose()["X"] > before + 0.5)
        pc.motion.update_cartesian(X=0.0)
        here = server.statistics.answered
        until(lambda: server.statistics.answered > here + 50)
        after = pc.motion.get_current_pose()["X"]
        steps = (after - before) / 0.02
        assert steps == pytest.approx(round(steps), abs=1e-3)
        server.close()
        true = live.arm().state().T_base_tcp[0, 3]
    assert after == pytest.approx(1e3 * true, abs=1e-3)
    statistics = server.statistics
    assert (statistics.late, statistics.stops) == (0, [])
