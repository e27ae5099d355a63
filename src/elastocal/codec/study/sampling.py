"""Simulate the samples that are missing, in batches, on cores of this machine or a Dask cluster.

Every worker keeps its linear algebra to one thread: the systems are small, the processes already
use all cores, and sums split over threads would be rounded otherwise. For the same reason nothing
is simulated in the process of the command itself, whose linear algebra may use all cores.

Dask's own client continues to try long after its timeout, and prints its attempts. So the scheduler
is queried first, by one message with one deadline.
"""

import asyncio
import logging
import platform
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from typing import Any

from elastocal._version import package_versions
from elastocal.codec.study.samples import Sample, SampleResult, Simulate, StudyDesign, StudyStore
from elastocal.errors import CodecError
from elastocal.parallel import map_on_cluster, process_count, process_pool
from elastocal.progress import Progress, silent

_STAGE = "samples"
_LARGEST = 80
"""Campaigns that are done and kept together, at most: some seconds of work are lost when a study is
killed. A campaign is one sample under one condition."""
_ENDING = 4
"""A batch is at most this part of what a worker still has to do: all end at nearly one time."""

Work = Callable[[Sequence[int]], list[SampleResult]]
"""Simulates the samples of these numbers."""


@dataclass(frozen=True)
class BatchExecutor:
    """Has batches done, somewhere and in any order."""

    workers: int
    """Batches that are done side by side."""
    map: Callable[[Work, Sequence[Sequence[int]]], Iterator[list[SampleResult]]]
    """Yields the results of each batch when they are there."""


_PATIENCE = 10.0
"""Longest time that a scheduler or its first worker may take to answer, in s."""
_SCHEDULER = "Scheduler"
_LOGGERS = ("distributed", "distributed.client")
"""They print tracebacks of what is refused here in one line."""


def run_study(
    store: StudyStore,
    design: StudyDesign,
    samples: int,
    simulate: Simulate,
    execute: BatchExecutor,
    progress: Progress = silent,
) -> tuple[SampleResult, ...]:
    """Return the results of samples 0 to ``samples - 1``; those in the folder are not done again.

    Parameters
    ----------
    store : StudyStore
        Folder of the study.
    design : StudyDesign
        What it is a study of.
    samples : int
        Number of samples; a finished study goes on with a larger one.
    simulate : callable
        See `Simulate`.
    execute : BatchExecutor
        Has batches done: see `ONE_AFTER_THE_OTHER`, `batch_executor`.
    progress : Progress
        Called with stage, done and total.

    Raises
    ------
    CodecError
        If less than one sample is wanted, or the folder holds another study.
    ElastocalError
        If a sample cannot be simulated, or a file not be written.
    """
    check_samples(samples)
    store.open(design)
    found = store.finished(design)
    missing = [number for number in range(samples) if number not in found]
    done = samples - len(missing)
    progress(_STAGE, done, samples)
    if missing:
        largest = max(1, _LARGEST // len(design.conditions))
        work = partial(_simulate_batch, simulate, design.seed)
        for results in execute.map(work, batches(missing, execute.workers, largest)):
            store.keep(design, results)
            done += len(results)
            progress(_STAGE, done, samples)
            found |= {result.number: result for result in results}
    return tuple(found[number] for number in range(samples))


def check_samples(samples: int) -> None:
    """Refuse less than one sample.

    Raises
    ------
    CodecError
        If there is less than one.
    """
    if not samples >= 1:
        raise CodecError(f"{samples} samples: must be at least 1")


def batches(numbers: Sequence[int], workers: int, largest: int) -> list[Sequence[int]]:
    """Return numbers in batches that become smaller towards the end.

    Source: guided self-scheduling (C. D. Polychronopoulos, D. J. Kuck, IEEE Trans. Comput. C-36,
    1987), with a bound.

    >>> [len(each) for each in batches(range(30), 2, 3)]
    [3, 3, 3, 3, 3, 2, 2, 2, 2, 1, 1, 1, 1, 1, 1, 1]

    Parameters
    ----------
    numbers : sequence of int
        Numbers of samples.
    workers : int
        Batches that are done side by side.
    largest : int
        Samples of a batch, at most.
    """
    found, start = [], 0
    while start < len(numbers):
        count = min(largest, -(-(len(numbers) - start) // (_ENDING * workers)))
        found.append(numbers[start : start + count])
        start += count
    return found


ONE_AFTER_THE_OTHER = BatchExecutor(1, map)
"""Runs the batches in this process."""


@contextmanager
def batch_executor(
    jobs: int | None, address: str | None, prepare: Callable[[], object] = list
) -> Iterator[BatchExecutor]:
    """Yield what has batches done; processes of this machine get ready in the meantime.

    Parameters
    ----------
    jobs : int, optional
        Processes on this machine; all cores by default.
    address : str, optional
        Address of a Dask scheduler, whose workers are used instead, e.g. ``tcp://10.0.0.5:8786``.
    prepare : callable
        What each process does first, such as imports; can be pickled.

    Raises
    ------
    CodecError
        If Dask is not installed, the scheduler does not answer or is lost, a process dies, or a
        worker has other versions of what makes the numbers.
    """
    if address is not None:
        with closing(_connected(address)) as client:
            with _lost_cluster_named(address):
                client.wait_for_workers(1, timeout=_PATIENCE)
                _check_workers(client)
                workers = sum(client.ncores().values())
            yield BatchExecutor(workers, partial(_over_cluster, client=client, address=address))
        return
    processes = process_count(jobs)
    with _dead_process_named(), process_pool(processes, prepare) as pool:
        yield BatchExecutor(processes, partial(pool.map, ordered=False))


def _over_cluster(
    work: Work, parts: Sequence[Sequence[int]], client: Any, address: str
) -> Iterator[list[SampleResult]]:
    with _lost_cluster_named(address):
        # Workers may join later: each batch looks once more.
        yield from map_on_cluster(partial(_as_here, package_versions(), work), parts, client)


def _check_workers(client: Any) -> None:
    """Refuse workers whose numbers might be others, asked by nothing of elastocal's."""
    for name, here in package_versions().items():
        for worker, there in client.run(version, name).items():
            _require_version(f"its worker {worker}", name, here, there)


def _as_here(here: dict[str, str], work: Work, numbers: Sequence[int]) -> list[SampleResult]:
    """Do a batch on a worker that has the versions of the command."""
    for name, there in package_versions().items():
        _require_version(f"a worker on {platform.node()}", name, here[name], there)
    return work(numbers)


def _require_version(worker: str, name: str, here: str, there: str) -> None:
    if there != here:
        raise CodecError(
            f"--dask: {worker} has {name} {there}, this command {here}: the numbers would not be"
            " those of one machine; install the same versions where the workers run"
        )


@contextmanager
def _lost_cluster_named(address: str) -> Iterator[None]:
    from distributed import KilledWorker
    from distributed.comm.core import CommClosedError

    try:
        yield
    except (CancelledError, CommClosedError, KilledWorker, TimeoutError) as error:
        raise CodecError(
            f"--dask {address}: the cluster was lost or has no worker ({type(error).__name__});"
            " finished samples are kept: give the same command again"
        ) from error
    except ModuleNotFoundError as error:
        raise CodecError(
            f"--dask {address}: its workers have no {error.name}: install elastocal where they run"
        ) from error


@contextmanager
def _dead_process_named() -> Iterator[None]:
    try:
        yield
    except BrokenProcessPool as error:
        raise CodecError(
            "a process of the study died (out of memory?); finished samples are kept: give the"
            " same command again, with fewer --jobs"
        ) from error


def _simulate_batch(simulate: Simulate, seed: int, numbers: Sequence[int]) -> list[SampleResult]:
    return [simulate(Sample(seed, number)) for number in numbers]


def _check_scheduler(address: str) -> None:
    """Refuse an address where no Dask scheduler answers in time.

    Parameters
    ----------
    address : str
        E.g. ``tcp://10.0.0.5:8786``.

    Raises
    ------
    CodecError
        If Dask is not installed, nothing answers, or what answers is no scheduler.
    """
    try:
        import distributed  # noqa: F401 - sets the levels of its loggers
    except ImportError as error:
        raise CodecError(
            "--dask needs Dask, which is not installed: pip install 'elastocal[dask]'"
        ) from error
    from tornado.websocket import WebSocketError

    for name in _LOGGERS:
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        found = asyncio.run(asyncio.wait_for(_identity(address), _PATIENCE))
    except (OSError, ValueError, TypeError, EOFError, MemoryError, WebSocketError) as error:
        # Memory: other services' first letters are read as the length of a message.
        raise CodecError(
            f"--dask {address}: no Dask scheduler answers there within {_PATIENCE:g} s (an address"
            " looks like tcp://10.0.0.5:8786)"
        ) from error
    if found != _SCHEDULER:
        raise CodecError(
            f"--dask {address}: a Dask {found.lower()} answers there, not a scheduler: give the"
            " address that `dask scheduler` printed"
        )


def _connected(address: str) -> Any:
    """Return a client of a Dask scheduler.

    Raises
    ------
    CodecError
        As `_check_scheduler`.
    """
    _check_scheduler(address)
    from distributed import Client

    make: Callable[..., Any] = Client
    try:
        return make(address, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise CodecError(f"--dask {address}: the Dask scheduler has stopped answering") from error


async def _identity(address: str) -> str:
    """Return the kind of Dask process that answers."""
    from distributed.comm.core import connect

    reach: Callable[..., Any] = connect
    comm = await reach(address, timeout=_PATIENCE)
    try:
        await comm.write({"op": "identity"})
        answer = await comm.read()
    finally:
        comm.abort()
    return str(answer.get("type", "process") if isinstance(answer, dict) else "process")
