"""A live compensation over loopback: cell, model and tool files, and both ends of the line."""

import contextlib
import socket
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import yaml

from elastocal.cell import WallClock, load_cell
from elastocal.sim.wire import LiveCell, Told, wire_servers
from elastocal.sim.wire.net_ft import NetFtServer
from elastocal.sim.wire.rsi import IPOC_START, RsiContext, RsiServer, corrected_program, rsi_server
from support import live_bench
from support.ports import free
from support.simulated import QUIET, example_cell

TIMEOUT = 100


@dataclass
class LiveFiles:
    """Files of a cell whose arm and sensor are on this machine."""

    cell: Path
    model: Path
    tool: Path

    @classmethod
    def written(cls, folder: Path, bias: float = 0.0, **arm: object) -> "LiveFiles":
        """Write them; a bias that the sensor has not is as good as a force."""
        udp, tcp = socket.SOCK_DGRAM, socket.SOCK_STREAM
        devices = {
            "arm": {
                "driver": "kuka_rsi", "mode": "compensation", "port": free(udp),
                "largest_correction": "1 mm", "correction_speed": "30 mm/s", "timeout": TIMEOUT,
            } | arm,
            "sensor": {
                "driver": "net_ft", "port": free(udp), "http_port": free(tcp), "tcp_port": free(tcp)
            },
        }  # fmt: skip
        cell = example_cell("afp")
        data = yaml.safe_load(cell.path.read_text()) | {"devices": devices}
        quiet = QUIET | {"sensor": QUIET["sensor"] | {"rate": "500 Hz"}}
        data["simulation"] = {"preset": "kind", "seed": 0} | quiet
        data["surface"]["file"] = str(cell.path.parent / data["surface"]["file"])
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / "cell.yaml"
        path.write_text(yaml.safe_dump(data))
        return cls(
            path,
            live_bench.write_model_of(path, folder / "model.json"),
            live_bench.write_tool_of(path, folder / "tool.json", bias),
        )


@contextlib.contextmanager
def served(
    files: LiveFiles, patience: float = 0.5, first_ipoc: int = IPOC_START
) -> Iterator[tuple[RsiServer, NetFtServer]]:
    """Serve controller and box; the controller is patient, its time stands where we are slow."""
    cell = load_cell(files.cell)
    devices = cell.file.devices
    live = LiveCell(cell, 0, WallClock())
    box = wire_servers()["net_ft"](live, Told(settings=dict(devices.sensor.told)))
    context = RsiContext(
        program=corrected_program, absolute=True, timeout=TIMEOUT, patience=patience, delay=0.008
    )
    robot = rsi_server(live, Told(settings=dict(devices.arm.told)), context)
    robot.first_ipoc = first_ipoc
    box.start()
    try:
        robot.start()
        yield robot, box
    finally:
        robot.close()
        box.close()
