"""How the benchmarks time a call, print a figure beside its reference, and keep it.

`figure` appends each to ``history.csv``, from which ``docs/hooks/performance.py`` makes the table
of the page on performance: the newest of each.
"""

import csv
import statistics
import subprocess
import time
from collections.abc import Callable
from datetime import UTC, datetime
from functools import cache
from pathlib import Path

HISTORY = Path(__file__).with_name("history.csv")
COLUMNS = ("date", "commit", "figure", "seconds", "reference", "reference_seconds", "aim_seconds")
_UNITS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns"))


def seconds(work: Callable[[], object], repetitions: int) -> float:
    """Return the median time of a call, after one call that is not counted."""
    work()
    times = []
    for _ in range(repetitions):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def inside(work: Callable[[], object], owner: object, name: str, repetitions: int = 5) -> float:
    """Return the median time of a call that is spent in one function of a module or class, in s.

    Parameters
    ----------
    work : callable
        What is timed, after one call that is not counted.
    owner, name : object, str
        Where the function is looked up by those that call it; it must not call itself.
    repetitions : int
        Calls.
    """
    original, spent = getattr(owner, name), [0.0]

    def timed(*arguments: object, **keywords: object) -> object:
        start = time.perf_counter()
        try:
            return original(*arguments, **keywords)
        finally:
            spent[-1] += time.perf_counter() - start

    work()
    setattr(owner, name, timed)
    try:
        for _ in range(repetitions):
            spent.append(0.0)
            work()
    finally:
        setattr(owner, name, original)
    return statistics.median(spent[1:])


def shown(duration: float) -> str:
    """Return a time in s as people read it.

    >>> shown(0.00027), shown(43.62)
    ('270 µs', '43.6 s')
    """
    factor, unit = next((each for each in _UNITS if duration >= each[0]), _UNITS[-1])
    return f"{duration / factor:.3g} {unit}"


def figure(
    name: str,
    taken: float,
    reference: tuple[str, float] | None = None,
    aim: float | None = None,
) -> None:
    """Print a figure beside its reference of the same run, and keep it.

    Parameters
    ----------
    name : str
        What took the time; a figure of the same name is the same one at another date.
    taken : float
        In s.
    reference : tuple, optional
        What else was timed in the same run, and its time in s.
    aim : float, optional
        Largest time asked for, in s.
    """
    parts = [f"{name}: {shown(taken)}"]
    if reference is not None:
        what, other = reference
        ratio = f"{other / taken:.3g}" if other >= taken else f"1/{taken / other:.3g}"
        parts.append(f"{what}: {shown(other)}, ratio {ratio}")
    if aim is not None:
        parts.append(f"asked: {shown(aim)}{'' if taken <= aim else ', short'}")
    print("; ".join(parts), flush=True)
    what, other = reference or ("", None)
    row = (datetime.now(tz=UTC).date(), commit(), name, _digits(taken), what, _digits(other))
    new = not HISTORY.exists()
    with HISTORY.open("a", encoding="utf-8", newline="") as file:
        lines = csv.writer(file, lineterminator="\n")
        if new:
            lines.writerow(COLUMNS)
        lines.writerow((*row, _digits(aim)))


def _digits(value: float | None) -> str:
    return "" if value is None else f"{value:.4g}"


@cache
def commit() -> str:
    """Return the commit that is measured, with a plus where files differ from it."""
    said = ["git", "-C", str(Path(__file__).parent), "describe", "--always", "--dirty=+"]
    return subprocess.run(said, capture_output=True, text=True, check=True).stdout.strip()
