"""Where the samples of a study are simulated: on the cores of this machine, or on a Dask cluster.

Both through joblib. Every worker keeps its linear algebra to one thread: the systems are small,
the processes already use all cores, and sums split over threads would be rounded otherwise. For
the same reason nothing is simulated in the process of the command itself, whose linear algebra
may use all cores.
"""

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing
from typing import Any

from joblib import Parallel, delayed, parallel_config

from elastocal.codec.study.running import Work
from elastocal.codec.study.samples import SampleResult
from elastocal.errors import CodecError

Results = Iterator[list[SampleResult]]
PATIENCE = 10.0
"""How long a scheduler or its first worker may take to answer, in s."""


def over_cores(batches: Iterable[Work], jobs: int | None = None) -> Results:
    """Yield the results of batches as they come, done on all cores or in some processes.

    Raises
    ------
    CodecError
        If a process dies.
    """
    processes = jobs or _cores()
    # With one job joblib would start no process, so one of two gets all the work.
    at_once = 1 if processes == 1 else 3 * processes
    with parallel_config("loky", n_jobs=max(processes, 2), inner_max_num_threads=1):
        try:
            yield from _unordered(batches, at_once)
        except BrokenProcessPool as error:
            raise CodecError(
                "a process of the study died (out of memory?); finished samples are kept: give the"
                " same command again, with fewer --jobs"
            ) from error


def over_cluster(batches: Iterable[Work], address: str) -> Results:
    """Yield the results of batches as they come, done by the workers of a Dask scheduler.

    Parameters
    ----------
    batches : iterable of callable
        Work.
    address : str
        Of the scheduler, e.g. ``tcp://10.0.0.5:8786``.

    Raises
    ------
    CodecError
        If Dask is not installed, the scheduler does not answer, or is lost.
    """
    client = connected(address)
    with closing(client), parallel_config("dask", client=client, wait_for_workers_timeout=PATIENCE):
        from distributed import KilledWorker
        from distributed.comm.core import CommClosedError

        try:
            yield from _unordered(batches, "3*n_jobs")
        except (CommClosedError, KilledWorker, TimeoutError) as error:
            raise CodecError(
                f"--dask {address}: the cluster was lost or has no worker"
                f" ({type(error).__name__}); finished samples are kept: give the same command again"
            ) from error


def connected(address: str) -> Any:
    """Return a client of a Dask scheduler.

    Raises
    ------
    CodecError
        If Dask is not installed, or the scheduler does not answer.
    """
    try:
        from distributed import Client as Connect
    except ImportError as error:
        raise CodecError(
            "--dask needs Dask, which is not installed: pip install 'elastocal[dask]'"
        ) from error
    try:
        make: Callable[..., Any] = Connect
        return make(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise CodecError(
            f"--dask {address}: no Dask scheduler answers there (an address looks like"
            " tcp://10.0.0.5:8786)"
        ) from error


def _unordered(batches: Iterable[Work], at_once: int | str) -> Results:
    parallel = Parallel(batch_size=1, pre_dispatch=at_once, return_as="generator_unordered")
    found: Results = parallel(delayed(_do)(work) for work in batches)
    return found


def _do(work: Work) -> list[SampleResult]:
    return work()


def _cores() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
