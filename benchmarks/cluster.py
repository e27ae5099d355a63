"""Run a study on a Dask cluster of this machine, kill its parts, and keep what a campaign costs.

A scheduler, two workers of one thread and ``elastocal study`` run in a network of their own, so
that every byte on it is theirs. At a third of the samples one worker is killed (SIGKILL) and a new
one started; at two thirds the command, which is then given again. At the end the first samples are
compared bit for bit with those of one process, and the samples that were simulated twice counted.
A campaign is one arm under one condition. ``cluster.json`` keeps the figures of every run,
from which ``docs/hooks/cluster.py`` fills the page on studies.

Linux only. Run with ``python benchmarks/cluster.py [SAMPLES]``.
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from timing import commit

from elastocal.cell.examples import write_example
from elastocal.codec.study import DESIGN, PARTS, StudyStore, read_design

FIGURES = Path(__file__).with_name("cluster.json")
SAMPLES = 2000
"""With the five pose counts that a study varies by default, 10⁴ campaigns."""
_IN_OWN_NETWORK = "ELASTOCAL_BENCHMARK_NETWORK"
_ADDRESS = "tcp://127.0.0.1:8786"
_INTERVAL = 10.0
"""Between two looks at the memory, in s."""
_COMPARED = 20
"""Samples that one process simulates again."""
_TICK, _PAGE = os.sysconf("SC_CLK_TCK"), os.sysconf("SC_PAGE_SIZE")
_COUNTING = """
from functools import partial
from elastocal.codec.study import sampling
def counted(simulate_batch, simulate, seed, numbers):
    with open({log!r}, "a", encoding="ascii") as file:
        file.writelines(f"{{number}}\\n" for number in numbers)
    return simulate_batch(simulate, seed, numbers)
if not isinstance(sampling._simulate_batch, partial):  # Dask may load this twice
    sampling._simulate_batch = partial(counted, sampling._simulate_batch)
"""
"""What each worker loads first: it notes every sample that it begins."""


class Session:
    """A program with all that it starts."""

    def __init__(self, *words: str | Path) -> None:
        command = [sys.executable, *map(str, words)]
        self.program = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
        )

    def seconds(self) -> float:
        """Return the processor time of its processes that live, in s."""
        return sum(int(each[11]) + int(each[12]) for each in self._processes()) / _TICK

    def megabytes(self) -> float:
        """Return the resident memory of all its processes, in MB."""
        return sum(int(each[21]) for each in self._processes()) * _PAGE / 1e6

    def kill(self) -> float:
        """Kill all its processes; return the processor time that they had taken, in s."""
        taken = self.seconds()
        os.killpg(self.program.pid, signal.SIGKILL)
        self.program.wait()
        return taken

    def _processes(self) -> list[list[str]]:
        """Return the fields of each in ``/proc/PID/stat`` from the state on."""
        found = []
        for path in Path("/proc").glob("[0-9]*/stat"):
            try:
                fields = path.read_text("utf-8", "replace").rpartition(")")[2].split()
            except OSError:  # it has just ended
                continue
            if int(fields[3]) == self.program.pid:
                found.append(fields)
        return found


def bytes_sent() -> int:
    """Return the bytes that this network has carried, with the heads of their packets."""
    lines = Path("/proc/self/net/dev").read_text("ascii").splitlines()
    return int(next(line for line in lines if "lo:" in line).split()[9])


class Study:
    """The study on its cluster, and what is noted of it."""

    def __init__(self, folder: Path, samples: int) -> None:
        cell = folder / "cell"
        cell.mkdir()
        write_example(cell, "afp")
        self.out, self.samples = folder / "study", samples
        self.log = folder / "begun.txt"
        self.counting = folder / "counting.py"
        self.counting.write_text(_COUNTING.format(log=str(self.log)), "utf-8")
        self.words = ("-m", "elastocal", "study", cell / "cell.yaml", "--samples", str(samples))
        self.folder = folder
        self.start = time.perf_counter()
        self.memory: dict[str, list[tuple[float, float]]] = {}
        self.spent: defaultdict[str, float] = defaultdict(float)
        self.parts: dict[str, int] = {}
        dask = ("-m", "dask", "scheduler", "--host", "127.0.0.1", "--no-dashboard")
        self.roles = {"scheduler": Session(*dask)}
        self.roles |= {name: self.worker() for name in ("worker 1", "worker 2")}
        self.command()

    def worker(self) -> Session:
        """Start a worker with its nanny."""
        return Session(
            "-m", "dask", "worker", _ADDRESS, "--nthreads", "1", "--no-dashboard",
            "--local-directory", self.folder, "--preload", self.counting,
        )  # fmt: skip

    def command(self) -> None:
        """Give the command, the same each time."""
        self.roles["command"] = Session(*self.words, "--out", self.out, "--dask", _ADDRESS)

    def kill(self, role: str) -> None:
        """Kill a role by SIGKILL."""
        self.spent[role] += self.roles[role].kill()

    def kept(self) -> int:
        """Return how many samples are in the store."""
        for path in (self.out / PARTS).glob("*.json"):
            if path.name not in self.parts:
                self.parts[path.name] = part_samples(path)
        return sum(self.parts.values())

    def until(self, reached: Callable[[], bool]) -> None:
        """Wait; look at the memory meanwhile, and at the processor time of what may end."""
        looked = 0.0
        while not reached():
            if time.perf_counter() - looked > _INTERVAL:
                looked = time.perf_counter()
                for role, session in self.roles.items():
                    row = (looked - self.start, session.megabytes())
                    self.memory.setdefault(role, []).append(row)
            time.sleep(0.5)

    def counts(self) -> dict[str, float]:
        """Return what was kept and carried, and the processor time that was taken, by now."""
        kept = self.kept()
        roles = {role: session.seconds() for role, session in self.roles.items()}
        return roles | {"samples": kept, "tasks": len(self.parts), "bytes": bytes_sent()}


def measured(folder: Path, samples: int) -> dict[str, object]:
    """Run the study, kill parts of it, and return the figures.

    What a campaign and a task cost is counted between the first part and the first kill.
    """
    study = Study(folder, samples)
    command = study.roles["command"].program
    study.until(lambda: study.kept() > 0 or command.poll() is not None)
    first = study.counts()
    study.until(lambda: study.kept() >= samples // 3 or command.poll() is not None)
    found = {key: value - first[key] for key, value in study.counts().items()}
    study.kill("worker 2")
    time.sleep(_INTERVAL)
    study.roles["worker 2"] = study.worker()
    study.until(lambda: study.kept() >= 2 * samples // 3 or command.poll() is not None)
    if command.poll() is not None:
        raise SystemExit(f"the command ended with {command.poll()} before it was killed")
    study.kill("command")
    held = study.kept()
    study.command()
    command = study.roles["command"].program
    ticks: list[float] = []

    def ended() -> bool:
        ticks.append(study.roles["command"].seconds())
        return command.poll() is not None

    study.until(ended)
    if command.returncode:
        raise SystemExit(f"the command ended with {command.returncode}")
    study.spent["command"] += max(ticks)
    wall = time.perf_counter() - study.start
    carried = bytes_sent()
    for role in ("scheduler", "worker 1", "worker 2"):
        study.kill(role)
    begun = Counter(study.log.read_text("ascii").split())
    design = read_design(study.out / DESIGN)
    alone = folder / "alone"
    words = (*study.words[:-1], str(_COMPARED), "--out", alone, "--jobs", "1")
    subprocess.run([sys.executable, *map(str, words)], check=True, stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL)  # fmt: skip
    same = bits(study.out, _COMPARED) == bits(alone, _COMPARED)
    parts = [*(study.out / PARTS).glob("*.json")]
    conditions = len(design.conditions)
    counted = conditions * found["samples"]
    return {
        "date": str(datetime.now(tz=UTC).date()),
        "commit": commit(),
        "samples": samples,
        "campaigns": samples * conditions,
        "wall_s": wall,
        "spent_s": dict(study.spent),
        "bytes": carried,
        "counted": found,
        "worker_s_a_campaign": (found["worker 1"] + found["worker 2"]) / counted,
        "scheduler_s_a_task": found["scheduler"] / found["tasks"],
        "command_s_a_task": found["command"] / found["tasks"],
        "bytes_a_campaign": found["bytes"] / counted,
        "tasks": len(parts),
        "largest_task_samples": max(map(part_samples, parts)),
        "begun_twice": sum(count - 1 for count in begun.values()),
        "held_when_killed": held,
        "same_as_one_process": same,
        "store_bytes": sum(path.stat().st_size for path in parts),
        "tables_bytes": {
            name: (study.out / name).stat().st_size for name in ("study.csv", "compliance.csv")
        },
        "memory_mb": {
            role: {"after": [round(s) for s, _ in rows], "mb": [round(mb) for _, mb in rows]}
            for role, rows in study.memory.items()
        },
    }


def part_samples(path: Path) -> int:
    """Return how many samples a part of the store has."""
    return len(json.loads(path.read_text("utf-8"))["samples"])


def bits(folder: Path, count: int) -> list[tuple[object, ...]]:
    """Return the numbers of the first samples of a study."""
    found = StudyStore(folder).finished(read_design(folder / DESIGN))
    return [
        (number, each.error_mean, each.error_max, each.deflection_mean, *each.compliance.tolist())
        for number in range(count)
        for each in found[number].outcomes
    ]


def main() -> None:
    """Measure, print and keep."""
    if _IN_OWN_NETWORK not in os.environ:
        words = ["unshare", "--map-root-user", "--net", sys.executable, *sys.argv]
        os.execvpe(words[0], words, os.environ | {_IN_OWN_NETWORK: "1"})
    subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
    samples = int(sys.argv[1]) if len(sys.argv) > 1 else SAMPLES
    with tempfile.TemporaryDirectory() as folder:
        found = measured(Path(folder), samples)
    print(json.dumps(found, indent=1))
    runs = json.loads(FIGURES.read_text("utf-8")) if FIGURES.exists() else []
    lines = ",\n".join(json.dumps(run) for run in (*runs, found))
    FIGURES.write_text(f"[\n{lines}\n]\n", "utf-8")


if __name__ == "__main__":
    main()
