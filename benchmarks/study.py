"""Print how a study uses the cores of this machine, and how it grows with its samples.

Runs the command itself on the example cell, so that starting, pool and results count. On a shared
machine other processes take their part, so three figures are printed: the CPU time over that of
all cores, the part that others took, and how many cores the study's processes were ready to run on
(looked at every 20 ms; what the first would be with nobody else there). The reference is the same
study by one process, in the same run: how much sooner all cores are done, and how much more CPU
time they take. Linux only. Run with ``python benchmarks/study.py [SAMPLES ...]``.
"""

import os
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from timing import figure

from elastocal.cell.examples import write_example
from elastocal.parallel import core_count

COMMAND = "from elastocal.cli.main import run; run()"
SAMPLES = (50, 100, 200)
CORES = core_count()


class Use(NamedTuple):
    """What one run took, in s."""

    wall: float
    own: float
    """CPU of the command and its processes."""
    user: float
    """Part of it in user mode."""
    busy: float
    """CPU of everything on the machine meanwhile."""
    ready: float
    """Mean part of the cores that its processes ran on or were waiting for."""


def run(cell: Path, out: Path, samples: int, *options: str) -> Use:
    """Run a study in processes of its own."""
    arguments = [cell, "--out", out, "--samples", samples, *options]
    argv = [sys.executable, "-c", COMMAND, "study", *map(str, arguments)]
    before, start, ready = busy_seconds(), time.perf_counter(), []
    pid = os.posix_spawn(
        sys.executable, argv, os.environ, setsid=True,
        file_actions=[(os.POSIX_SPAWN_OPEN, 2, os.devnull, os.O_WRONLY, 0)],
    )  # fmt: skip
    while True:
        ended, status, usage = os.wait4(pid, os.WNOHANG)
        if ended:
            break
        ready.append(min(ready_processes(pid), CORES) / CORES)
        time.sleep(0.02)
    wall = time.perf_counter() - start
    if status:
        raise SystemExit(f"study of {samples} samples failed with status {status}")
    own, busy = usage.ru_utime + usage.ru_stime, busy_seconds() - before
    return Use(wall, own, usage.ru_utime, busy, statistics.mean(ready))


def ready_processes(session: int) -> int:
    """Return how many processes of a session run or wait for a core."""
    count = 0
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, own = path.read_text().rpartition(")")[2].split()[:4]
        except OSError:  # it has just ended
            continue
        count += state == "R" and int(own) == session
    return count


def busy_seconds() -> float:
    """Return the CPU time that all processes of the machine have used; Linux only."""
    fields = Path("/proc/stat").read_text("ascii").splitlines()[0].split()[1:]
    user, nice, system, _, _, irq, softirq, steal = map(int, fields[:8])
    return (user + nice + system + irq + softirq + steal) / os.sysconf("SC_CLK_TCK")


def main() -> None:
    """Measure and print."""
    wanted = tuple(map(int, sys.argv[1:])) or SAMPLES
    print(f"study of the afp example, 5 conditions (poses 6, 10, 15, 20, 31), {CORES} cores")
    with tempfile.TemporaryDirectory() as folder:
        cell = Path(folder) / "cell"
        cell.mkdir()
        write_example(cell, "afp")
        for samples in wanted:
            out = Path(folder) / f"study_{samples}"
            use = run(cell / "cell.yaml", out, samples)
            alone = run(cell / "cell.yaml", out.with_suffix(".alone"), samples, "--jobs", "1")
            everything = CORES * use.wall
            print(
                f"  {samples:4d} samples: {use.wall:6.1f} s, {use.own:6.1f} s CPU;"
                f" user / (wall x {CORES}) {use.user / everything:.0%}, others took"
                f" {max(use.busy - use.own, 0.0) / everything:.0%}; ready for"
                f" {use.ready:.0%} of the cores; CPU time {use.own / alone.own:.2f} x that of one"
                " process",
                flush=True,
            )
            name = f"`study`, {samples} arms under 5 conditions, processes: {CORES}"
            figure(name, use.wall, ("one process", alone.wall))


if __name__ == "__main__":
    main()
