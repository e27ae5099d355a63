"""Where the samples of a study are simulated: on the cores of this machine, or on a Dask cluster.

Both through joblib. Every worker keeps its linear algebra to one thread: the systems are small,
the processes already use all cores, and sums split over threads would be rounded otherwise. For
the same reason nothing is simulated in the process of the command itself, whose linear algebra
may use all cores.
"""

import importlib
import os
import signal
import warnings
from collections.abc import Generator, Iterable, Iterator
from concurrent.futures import CancelledError
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, contextmanager
from functools import partial

from joblib import Parallel, delayed, parallel_config

from elastocal.cli.study_cluster import PATIENCE, check_scheduler, connected
from elastocal.codec.study import SampleResult, Spread, Work
from elastocal.errors import CodecError, ElastocalError

Results = Iterator[list[SampleResult]]
_SIMULATION = "elastocal.cli.study_simulation"
"""What a process imports before it can simulate."""


@contextmanager
def spread_over(jobs: int | None, address: str | None) -> Iterator[Spread]:
    """Yield what has batches done; processes of this machine get ready in the meantime.

    Parameters
    ----------
    jobs : int, optional
        Processes on this machine; all cores by default.
    address : str, optional
        Of a Dask scheduler, whose workers are used instead.

    Raises
    ------
    CodecError
        If Dask is not installed, or the scheduler does not answer.
    """
    if address is not None:
        check_scheduler(address)  # refused before the long work
        yield partial(over_cluster, address=address)
        return
    processes = jobs or _cores()
    with _deaf_to_ctrl_c():
        ready: Generator[object] = _on_cores(processes, processes)(
            delayed(_get_ready)() for _ in range(processes)
        )

    def spread(batches: Iterable[Work]) -> Results:
        # Joblib runs one set of tasks at a time without a loss; these take a second or two.
        _wait_for(ready)
        return over_cores(batches, processes)

    try:
        yield spread
    except (KeyboardInterrupt, SystemExit):
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", r"\d+ tasks", UserWarning)
            ready.close()
        raise
    except ElastocalError:
        # Processes that are ended while they start complain.
        _wait_for(ready)
        raise
    _wait_for(ready)


def over_cores(batches: Iterable[Work], jobs: int | None = None) -> Results:
    """Yield the results of batches as they come, done on all cores or in some processes.

    Raises
    ------
    CodecError
        If a process dies.
    """
    processes = jobs or _cores()
    # With one job one of two processes gets all the work.
    parallel = _on_cores(processes, 1 if processes == 1 else 3 * processes)
    with _naming_the_dead():
        yield from parallel(delayed(_do)(work) for work in batches)


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

        parallel = Parallel(batch_size=1, pre_dispatch="3*n_jobs", return_as="generator_unordered")
        try:
            yield from parallel(delayed(_do)(work) for work in batches)
        except (CancelledError, CommClosedError, KilledWorker, TimeoutError) as error:
            raise CodecError(
                f"--dask {address}: the cluster was lost or has no worker"
                f" ({type(error).__name__}); finished samples are kept: give the same command again"
            ) from error


def _on_cores(processes: int, at_once: int) -> Parallel:
    """Return what runs tasks in processes that are kept from one call to the next."""
    # With one job joblib would start no process.
    with parallel_config("loky", n_jobs=max(processes, 2), inner_max_num_threads=1):
        return Parallel(batch_size=1, pre_dispatch=at_once, return_as="generator_unordered")


def _wait_for(ready: Iterator[object]) -> None:
    with _naming_the_dead():
        for _ in ready:
            pass


@contextmanager
def _deaf_to_ctrl_c() -> Iterator[None]:
    """Keep Ctrl-C from the processes that are started meanwhile: this one ends them.

    A terminal sends it to all of them, and each would print where it was. Blocked signals stay
    blocked in what is started; this process gets its own afterwards.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _naming_the_dead() -> Iterator[None]:
    try:
        yield
    except BrokenProcessPool as error:
        raise CodecError(
            "a process of the study died (out of memory?); finished samples are kept: give the"
            " same command again, with fewer --jobs"
        ) from error


def _do(work: Work) -> list[SampleResult]:
    return work()


def _get_ready() -> None:
    importlib.import_module(_SIMULATION)


def _cores() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
