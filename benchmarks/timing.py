"""How the benchmarks time a call."""

import statistics
import time
from collections.abc import Callable


def seconds(work: Callable[[], object], repetitions: int) -> float:
    """Return the median time of a call, after one call that is not counted."""
    work()
    times = []
    for _ in range(repetitions):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)
