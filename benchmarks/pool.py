"""Print what a pool of valid candidates costs, and how that grows with its size.

Each size is made by one process and by all cores in the same run; the ratios are what counts.
Run with ``python benchmarks/pool.py``; ``--large`` goes on to 100 000 candidates, some minutes.
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from elastocal.cell import load_cell
from elastocal.cell.examples import write_example
from elastocal.parallel import core_count
from elastocal.planning import SampledPool, cell_surface, sample_pool

SIZES = (1000, 3000, 10_000)
LARGE = (*SIZES, 30_000, 100_000)


def made(folder: Path, like: str, size: int, jobs: int) -> tuple[float, SampledPool]:
    """Return the seconds that a pool takes, surface and checks included, and the pool."""
    path, *_ = write_example(folder, like, force=True)
    path.write_text(path.read_text().replace("pool: 3000", f"pool: {size}"))
    cell = load_cell(path)
    start = time.perf_counter()
    found = sample_pool(cell, cell_surface(cell), np.random.default_rng(0), jobs)
    return time.perf_counter() - start, found


def report(like: str, sizes: tuple[int, ...], cores: int) -> None:
    """Print one example cell."""
    print(f"{like}: valid candidates with all checks")
    with tempfile.TemporaryDirectory() as name:
        for size in sizes:
            alone, found = made(Path(name), like, size, 1)
            helped, again = made(Path(name), like, size, cores)
            same = np.array_equal(found.pool.postures.q, again.pool.postures.q)
            print(
                f"  {size:6d}: {alone:6.2f} s by one process ({1e3 * alone / size:.2f} ms each),"
                f" {helped:6.2f} s by {cores}; ratio {alone / helped:.2f}; same pool: {same}"
            )


def main() -> None:
    """Print the report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--large", action="store_true", help="go on to 100 000 candidates")
    sizes = LARGE if parser.parse_args().large else SIZES
    cores = core_count()
    for like in ("afp", "machining"):
        report(like, sizes, cores)


if __name__ == "__main__":
    main()
