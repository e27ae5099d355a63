"""Print what a pool of valid candidates costs, and how that grows with its size.

Beside each pool stands a reference of the same run: the bare inverse kinematics of as many poses.
One process, all cores and the reference take turns, so that what else the machine does meets all
three; times are medians over the rounds, and the ratios are what counts. Run with ``python
benchmarks/pool.py``; ``--large`` makes pools of up to a million candidates instead, once each, and
prints time and memory a candidate: up to an hour.
"""

import argparse
import os
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np
from timing import figure, inside

from elastocal.cell import Cell, load_cell
from elastocal.cell.examples import write_example
from elastocal.parallel import core_count
from elastocal.planning import cell_surface, pool, sample_pool
from elastocal.planning.pool import SampledPool
from elastocal.planning.scene import CollisionScene
from elastocal.robot.inverse import inverse_for

SIZES = (1000, 3000, 10_000)
LARGE = (10_000, 100_000, 1_000_000)
ROUNDS = 3
ASKED = (3000, "afp")

_Result = TypeVar("_Result")


def timed(work: Callable[..., _Result], *arguments: object) -> tuple[float, _Result]:
    """Return the seconds that a call takes, and what it returns."""
    start = time.perf_counter()
    result = work(*arguments)
    return time.perf_counter() - start, result


def example(folder: Path, like: str, size: int) -> Cell:
    """Return an example cell whose pool has a size."""
    path, *_ = write_example(folder, like, force=True)
    path.write_text(path.read_text().replace("pool: 3000", f"pool: {size}"))
    return load_cell(path)


def made(cell: Cell, jobs: int) -> SampledPool:
    """Make a pool, surface and checks included."""
    return sample_pool(cell, cell_surface(cell), np.random.default_rng(0), jobs)


def solved(cell: Cell, q: np.ndarray) -> None:
    """Solve the inverse kinematics of postures' poses: what no pool can do without."""
    inverse_for(cell.robot).solve_many(cell.robot.forward(q), q[:, : cell.robot.external_axes])


def parts(cell: Cell, size: int, like: str, alone: float) -> None:
    """Print what a pool's checks take, and those by Coal, of the time of one process."""
    own = ("one process", alone)
    for part, owner, function in (
        ("the checks alone", pool, "check_margins"),
        ("collisions by Coal alone", CollisionScene, "keeps"),
    ):
        spent = inside(lambda: made(cell, 1), owner, function, 3)
        figure(f"{size} candidates with all checks, {like}: {part}", spent, own)


def report(like: str, cores: int) -> None:
    """Print one example cell."""
    print(f"{like}: valid candidates with all checks")
    with tempfile.TemporaryDirectory() as name:
        for size in SIZES:
            cell, rounds = example(Path(name), like, size), []
            for _ in range(ROUNDS):
                alone, found = timed(made, cell, 1)
                helped, again = timed(made, cell, cores)
                q = found.pool.postures.q
                bare, _ = timed(solved, cell, q)
                rounds.append((alone, helped, bare))
            alone, helped, bare = map(statistics.median, zip(*rounds, strict=True))
            same = np.array_equal(q, again.pool.postures.q)
            figure(
                f"{size} candidates with all checks, {like}, one process",
                alone,
                ("inverse kinematics of as many poses", bare),
                aim=1.2 if (size, like) == ASKED else None,
            )
            if (size, like) == ASKED:
                parts(cell, size, like, alone)
            figure(
                f"{size} candidates with all checks, {like}, {cores} processes",
                helped,
                ("one process", alone),
            )
            print(f"  same pool: {same}", flush=True)


def peak_memory() -> float:
    """Return the most memory that this process and its workers have had, together, in bytes."""
    own = Path(f"/proc/self/task/{os.getpid()}")
    processes = [own, *(Path(f"/proc/{pid}") for pid in (own / "children").read_text().split())]
    peaks = (line for each in processes for line in (each / "status").read_text().splitlines())
    return sum(1024.0 * int(line.split()[1]) for line in peaks if line.startswith("VmHWM"))


def growth(like: str, cores: int) -> None:
    """Print time and memory a candidate of ever larger pools of one example cell."""
    print(f"{like}: valid candidates with all checks, {cores} processes")
    each: list[float] = []
    with tempfile.TemporaryDirectory() as name:
        for size in LARGE:
            cell = example(Path(name), like, size)
            taken, found = timed(made, cell, cores)
            each.append(taken / len(found.pool.postures))
            which = f"one candidate of {size}, {like}, {cores} processes"
            figure(which, each[-1], (f"of {LARGE[0]}", each[0]))
            print(
                f"  {len(found.pool.postures)} candidates of {found.pool.sampled} points;"
                f" most memory so far {peak_memory() / 1e6:.0f} MB",
                flush=True,
            )


def main() -> None:
    """Print the report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--large", action="store_true", help="up to a million candidates")
    large, cores = parser.parse_args().large, core_count()
    for like in ("afp", "machining"):
        if large:
            growth(like, cores)
        else:
            report(like, cores)


if __name__ == "__main__":
    main()
