"""Measure live compensation on loopback: times of answers of `elastocal live` and of its C.

Both ends of the line are light, and in a process of their own: a controller that sends every 4 ms
and does not wait for anybody, a Net F/T at 1000 records a second whose stream stops for a second.
Run with ``python benchmarks/live.py [SECONDS]`` (60) on a machine that has nothing else to do.
"""

import contextlib
import json
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from timing import figure

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from elastocal import workflows  # noqa: E402 - the path comes first
from elastocal.cell import SensorStatus, WrenchBlock, load_cell  # noqa: E402
from elastocal.robot import xyzabc_from_T  # noqa: E402
from elastocal.sim.wire.net_ft import NetFtServer  # noqa: E402
from support.live_on_wire import LiveFiles  # noqa: E402

CYCLE, LATE = 0.004, 0.0035
_ECHO = """
import socket, sys
line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
line.bind(("127.0.0.1", 0))
line.sendto(b"here", ("127.0.0.1", int(sys.argv[1])))
while data := line.recv(4096):
    line.sendto(data, ("127.0.0.1", int(sys.argv[1])))
"""
IPOC = 4_208_163_634
RATE = 1000.0


class Wave:
    """A force sensor that feels a slow wave; a cell for the simulated box."""

    rate = RATE

    def __init__(self, cell) -> None:
        self.cell, self._begin, self._sent = cell, time.monotonic(), 0

    def sensor(self) -> "Wave":
        """Return itself."""
        return self

    def read(self) -> WrenchBlock:
        """Return the samples since the last call."""
        due = int(RATE * (time.monotonic() - self._begin))
        times = np.arange(self._sent, due) / RATE
        self._sent = due
        force = np.zeros((len(times), 3))
        force[:, 2] = -400.0 + 300.0 * np.sin(np.pi * times)
        zero = np.zeros((len(times), 3))
        return WrenchBlock(times, force, zero, 0.5, 0.01, SensorStatus.OK, "wave")


def messages(cell):
    """Return what a controller sends whose arm stands at HOME, by IPOC."""
    place, q = xyzabc_from_T(cell.robot.forward(cell.home)), cell.home

    def element(name, keys, values):
        inside = " ".join(f'{k}="{v:.6f}"' for k, v in zip(keys, values, strict=True))
        return f"<{name} {inside}/>"

    frame = [*(1e3 * place[:3]), *np.degrees(place[3:])]
    axes, joints = [f"A{k}" for k in range(1, 7)], np.degrees(q[1:])
    external = [1e3 * q[0], 0.0, 0.0, 0.0, 0.0, 0.0]
    parts = "".join(element(name, "XYZABC", frame) for name in ("RIst", "RSol"))
    parts += "".join(element(name, axes, joints) for name in ("AIPos", "ASPos"))
    parts += element("EIPos", [f"E{k}" for k in range(1, 7)], external)
    parts += element("MACur", axes, np.zeros(6)) + '<Delay D="0"/>'
    return lambda ipoc: f'<Rob Type="KUKA">{parts}<IPOC>{ipoc}</IPOC></Rob>'.encode()


def serve(cell_path: Path, seconds: float) -> None:
    """Be both ends of the line for a time; print what the controller has seen."""
    cell = load_cell(cell_path)
    devices = cell.file.devices
    told = devices.sensor.told
    box = NetFtServer(Wave(cell), told["port"], told["http_port"], told["tcp_port"])
    box.start()
    print("ready", flush=True)
    line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    line.bind(("127.0.0.1", 0))
    peer, message = ("127.0.0.1", devices.arm.told["port"]), messages(cell)
    took, late, missing, cycle, heard = [], 0, 0, 0, False
    with contextlib.suppress(OSError, AttributeError):
        # A controller is on time.
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(60))
    due = time.perf_counter()
    while cycle * CYCLE < seconds:
        due += CYCLE
        sent = time.perf_counter()
        line.sendto(message(IPOC + 4 * cycle), peer)
        wanted, found = f"<IPOC>{IPOC + 4 * cycle}</IPOC>".encode(), None
        while (left := due - time.perf_counter()) > 0.0:
            line.settimeout(left)
            try:
                if wanted in line.recv(4096):
                    found = time.perf_counter() - sent
                    break
            except OSError:
                continue
        heard = heard or found is not None
        if not heard:
            due = time.perf_counter() + CYCLE
            time.sleep(CYCLE)
            continue  # nobody listens yet
        cycle += 1
        missing += found is None
        late += found is None or found > LATE
        took += [] if found is None else [found]
        box.box.lose = 10**6 if 0.4 * seconds < cycle * CYCLE < 0.4 * seconds + 1.0 else 0
        time.sleep(max(0.0, due - time.perf_counter()))
    box.close()
    shown = {"p50": np.median(took), "p999": np.quantile(took, 0.999), "longest": max(took)}
    print(json.dumps({**shown, "cycles": cycle, "late": late, "missing": missing}))


def peers(files: LiveFiles, seconds: float) -> subprocess.Popen:
    """Start both ends of the line in a process; return when the box answers."""
    words = [sys.executable, __file__, "--serve", str(files.cell), str(seconds)]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    return process


def shown(name: str, line: dict[str, float], far: dict[str, float]) -> None:
    """Print the times of one program, and what the controller has seen of it."""
    ms = {key: 1e3 * line[key] for key in ("p50", "p99", "p999", "longest")}
    print(
        f"{name}: datagram in to datagram out p50 {ms['p50']:.3f}, p99 {ms['p99']:.3f}, p99.9"
        f" {ms['p999']:.3f}, longest {ms['longest']:.3f} ms"
    )
    share = far["late"] / far["cycles"]
    print(
        f"{name}: at the controller p50 {1e3 * far['p50']:.3f}, p99.9 {1e3 * far['p999']:.3f}"
        f" ms; later than 3.5 ms {far['late']} of {far['cycles']} ({share:.3%},"
        f" {far['missing']} of them never)"
    )


def echo_seconds(repetitions: int = 2000) -> float:
    """Return the median time of a datagram to another process and back: what no answer beats."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        line.bind(("127.0.0.1", 0))
        line.settimeout(1.0)
        words = [sys.executable, "-c", _ECHO, str(line.getsockname()[1])]
        process = subprocess.Popen(words)
        taken = []
        _, peer = line.recvfrom(16)
        for _ in range(repetitions):
            start = time.perf_counter()
            line.sendto(b"x" * 1000, peer)
            line.recv(4096)
            taken.append(time.perf_counter() - start)
            time.sleep(CYCLE / 4.0)
        line.sendto(b"", peer)
        process.wait()
    return float(np.median(taken))


def python(files: LiveFiles, seconds: float, echo: tuple[str, float]) -> None:
    """Measure `elastocal live`."""
    process = peers(files, seconds)
    out = files.cell.parent / "live"
    result = workflows.live(
        files.cell, model=files.model, tool=files.tool, arm=True, out=out,
        interrupted=lambda: process.poll() is not None,
    )  # fmt: skip
    line, loop = result.line, result.loop
    times = {
        "p50": line.answer_p50, "p99": line.answer_p99, "p999": line.answer_p999,
        "longest": line.answer_longest,
    }  # fmt: skip
    shown("Python", times, json.loads(process.communicate()[0]))
    if line.answer_p50 is not None:
        figure("`live`, datagram in to datagram out: median", line.answer_p50, echo, aim=0.15e-3)
    print(
        f"Python: {line.late} of {line.answered} answers later than 3.5 ms ({line.late_share:.3%});"
        f" {result.scheduling}; log {result.logged} cycles, {result.dropped} dropped"
    )
    if result.problem:
        print(f"Python: {result.problem}")
    print(
        f"Python: stream stopped for 1 s: {loop.held} cycles held, {loop.faded} faded; largest step"
        f" {1e3 * loop.largest_step:.4f} mm of {1e3 * 0.03 * CYCLE:.4f} allowed"
    )


def in_c(files: LiveFiles, seconds: float, echo: tuple[str, float]) -> None:
    """Measure the C program."""
    folder = files.cell.parent / "c"
    workflows.export(files.model, out=folder, platform="linux", cell=files.cell, tool=files.tool)
    subprocess.run(["make", "-s", "-C", folder, "check"], check=True)
    process = peers(files, seconds)
    program = subprocess.Popen([folder / "elastocal_live", "--arm"], stdout=subprocess.PIPE)
    far = json.loads(process.communicate()[0])
    program.terminate()
    found = json.loads(program.communicate()[0])
    shown("C", found["answer"], far)
    figure("the same in C: median", found["answer"]["p50"], echo)
    figure("the same in C: 999 of 1000 within", found["answer"]["p999"], echo, aim=0.1e-3)
    work = found["work"]
    print(
        f"C: from when the program had it p50 {1e3 * work['p50']:.3f}, p99.9"
        f" {1e3 * work['p999']:.3f} ms; {found['late']} of {found['answered']} later than 3.5 ms;"
        f" {found['held']} held, {found['faded']} faded; FIFO {found['fifo_priority']}, memory"
        f" {'locked' if found['memory_locked'] else 'not locked'}"
    )


def main() -> None:
    """Measure both, or be the ends of the line."""
    if sys.argv[1:2] == ["--serve"]:
        serve(Path(sys.argv[2]), float(sys.argv[3]))
        return
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 60.0
    folder = Path(tempfile.mkdtemp(prefix="elastocal_live_"))
    try:
        echo = ("a datagram to another Python process and back", echo_seconds())
        python(LiveFiles.written(folder / "python"), seconds, echo)
        in_c(LiveFiles.written(folder / "c"), seconds, echo)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
