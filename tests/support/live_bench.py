"""A cell whose arm and sensor run as fast as they are asked: a driver of tests, `install`ed."""

import threading
from pathlib import Path

import numpy as np
import yaml

from elastocal.cell import (
    BeamState,
    CycleStatistics,
    DeviceSet,
    DeviceSettings,
    PathCycle,
    PathLimits,
    PointBlock,
    SensorStatus,
    WrenchSample,
    load_cell,
)
from elastocal.compensation.conditioning import ToolResult, write_tool
from elastocal.compensation.online import LiveCounts
from elastocal.errors import DeviceError
from elastocal.identification import write_model
from elastocal.procedure.derive import sensor_load
from elastocal.robot import parse_urdf
from elastocal.workflows.live import LiveResult
from support import compensated
from support.plugged import describe
from support.simulated import example_cell
from support.summaries import made_up_summary

CYCLE = 0.004
_PAUSE = 2e-4
"""Between two cycles, in s of the wall: others have to come in between."""
STATISTICS = CycleStatistics(
    received=1000, answered=998, lost=1, skipped=1, out_of_order=0, jumps=0, malformed=0, foreign=0,
    late=2, saturated=0, controller_delay=1, answer_p50=2e-4, answer_p99=4e-4, answer_p999=9e-4,
    answer_longest=5e-3, jitter=1e-4,
)  # fmt: skip


class _Settings(DeviceSettings):
    cycles: int = 10**9
    """After which the line breaks."""
    limits: bool = True


class BenchArm:
    """Calls its source as fast as it can, in the time of its own cycles."""

    def __init__(self, driver: "BenchDriver", q, source, most: int) -> None:
        self._driver, self._q, self._source, self._most = driver, q, source, most
        self._closed, self.answers = threading.Event(), []
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._closed.wait(_PAUSE) and len(self.answers) < self._most:
            self._driver.time += CYCLE
            cycle = PathCycle(self._driver.time, self._q, not self.answers)
            self.answers.append(self._source.correction(cycle))

    def wait(self, _seconds: float) -> bool:
        return True

    def require(self) -> None:
        if len(self.answers) >= self._most:
            raise DeviceError("bench: the line broke")

    def statistics(self) -> CycleStatistics:
        return STATISTICS

    def close(self) -> None:
        self._closed.set()
        self._thread.join(10.0)


class BenchDriver:
    """Arm, sensor and tracker; `arm` is the last that was made."""

    kinds = frozenset({"arm", "sensor", "metrology"})
    real = True
    rate = 1000.0
    force = (0.0, 0.0, 0.0)

    def __init__(self) -> None:
        self.time, self.arm = 100.0, None
        self.marker, self.station, self.looked = np.zeros(3), "", 100.0

    def settings(self, _kind: str) -> type[DeviceSettings]:
        return _Settings

    def newest(self) -> WrenchSample:
        zero = np.zeros(3)
        return WrenchSample(self.time, np.array(self.force), zero, SensorStatus.OK)

    def look(self, station: str) -> None:
        self.station = station

    def read(self) -> PointBlock:
        if self.marker is None:
            raise DeviceError("bench: the tracker does not answer")
        time, self.looked = np.arange(self.looked, self.time, 0.05), self.time
        position = np.tile(self.marker, (len(time), 1))
        sigma = np.full(position.shape, 5e-6)
        return PointBlock(time, position, sigma, BeamState.LOCKED, self.station, "bench")

    def connect(self, _cell, wanted, _context) -> DeviceSet:
        if "metrology" in wanted:
            return DeviceSet(metrology=self)
        return DeviceSet(sensor=self, feed=self)

    def path_limits(self, cell, settings) -> PathLimits:
        if not settings.limits:
            raise DeviceError(f"{cell.path}: devices.arm states no limits")
        return PathLimits(2e-3, 0.02, CYCLE, "base")

    def correct_path(self, cell, settings, _context, source) -> BenchArm:
        self.arm = BenchArm(self, cell.home.tolist(), source, settings.cycles)
        return self.arm


DRIVER = BenchDriver()


def install(folder: Path, monkeypatch) -> None:
    """Let cells name the driver ``live_bench``."""
    entry = {"live_bench": "support.live_bench:DRIVER"}
    monkeypatch.syspath_prepend(
        str(describe(folder, "live_bench_driver", {"elastocal.drivers": entry}))
    )


def write_cell(
    path: Path,
    arm: object = "live_bench",
    sensor: object = "live_bench",
    metrology: object = "simulated",
) -> Path:
    """Write the example cell with such devices; return its file."""
    cell = example_cell("afp")
    devices = {"arm": arm, "sensor": sensor, "metrology": metrology}
    data = yaml.safe_load(cell.path.read_text()) | {"devices": devices}
    data["surface"]["file"] = str(cell.path.parent / data["surface"]["file"])
    path.write_text(yaml.safe_dump(data))
    return path


def write_model_of(cell: Path, path: Path) -> Path:
    """Write a made-up model of a cell's robot; return its file."""
    write_model(path, compensated.calibrated(load_cell(cell).robot), made_up_summary())
    return path


def write_tool_of(cell: Path, path: Path, bias: float = 0.0) -> Path:
    """Write the tool file of a cell's tool as it is described, with a bias of each force in N."""
    described = load_cell(cell)
    load, sensor = sensor_load(described), described.file.sensor
    flange = [link.get("name") for link in parse_urdf(described.robot.urdf).findall("link")]
    pose = sensor.T_flange_sensor
    write_tool(
        path,
        ToolResult(
            flange="flange" if "flange" in flange else "tool0", mass=load.mass,
            centre=tuple(load.centre.tolist()), force_bias=(bias,) * 3, moment_bias=(0.0,) * 3,
            R_flange_sensor=tuple(map(tuple, pose[:3, :3].tolist())),
            sensor_origin=tuple(pose[:3, 3].tolist()), gravity=tuple(load.gravity.tolist()),
            half_width={}, undetermined=(), postures=8, force_scatter=0.1, moment_scatter=0.01,
            source="the cell file",
        ),
    )  # fmt: skip
    return path


def result() -> LiveResult:
    """Return the record of a live compensation of four seconds."""
    counts = LiveCounts(998, 900, 8, 90, 0, 3, 0, 98, 0, 0, 0, 1, 4e-4, 8e-5, 3e-5)
    return LiveResult(
        cell="afp", model="model.json", robot="KR", started="2026-11-22T14:00:00+00:00",
        seconds=4.0, ended="interrupted", problem=None, limits=PathLimits(2e-3, 0.02, 4e-3, "base"),
        filter_delay=0.019, tool="tcp, as calibrated", bias=None, scheduling="SCHED_FIFO 40",
        line=STATISTICS, loop=counts, logged=998, dropped=0, notes=("a note",),
    )  # fmt: skip
