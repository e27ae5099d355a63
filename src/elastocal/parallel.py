"""Processes and threads: how many there may be, and what runs in them.

This is the one place that counts cores, starts processes (through joblib) and limits the threads
of linear algebra. NumPy and SciPy each bring an OpenBLAS of their own, with a thread a core. On the
systems of a calibration, 18 by 18, a second thread computes nothing sooner, but every call waits
for it to wake up: six times as long when another program keeps the cores busy. Processes therefore
run one thread each, and so do the workflows with `one_blas_thread`.
"""

import importlib
import os
import pickle
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

from elastocal.errors import ElastocalError

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

_WATCH = 1.0
"""Between two looks of a worker at whether its parent lives, in s."""
_Task = TypeVar("_Task")
_Result = TypeVar("_Result")


def core_count() -> int:
    """Return the number of cores that this process may use.

    Counts its CPU affinity and the quota of its control group (containers, batch systems).
    """
    from joblib import cpu_count  # takes longer to import than a calibration to compute

    return int(cpu_count())


def process_count(
    jobs: int | None = None, tasks: int | None = None, *, worthwhile: bool = True
) -> int:
    """Return the number of processes for some work.

    Parameters
    ----------
    jobs : int, optional
        Number that the user asks for; all cores by default.
    tasks : int, optional
        Number of tasks: more processes than these have nothing to do.
    worthwhile : bool
        Whether the work outweighs the seconds that processes need to start. If not, and the user
        asks for nothing else, it is done by this process.

    Raises
    ------
    ValueError
        If ``jobs`` is below 1.
    """
    if jobs is None:
        jobs = core_count() if worthwhile else 1
    elif not jobs >= 1:
        raise ValueError(f"{jobs} jobs: must be at least 1")
    return jobs if tasks is None else max(1, min(jobs, tasks))


def map_in_processes(
    function: Callable[[_Task], _Result], tasks: Iterable[_Task], processes: int
) -> Iterator[_Result]:
    """Yield the result of each task, in their order, as soon as it is known.

    Parameters
    ----------
    function : callable
        Can be pickled, as can tasks and results.
    tasks : iterable
        What it is called with. With one process it is called here, one task at a time.
    processes : int
        Number of processes, from `process_count`.
    """
    if processes == 1:
        yield from map(function, tasks)
        return
    from joblib import Parallel, delayed

    with _one_thread_each(processes):
        parallel = Parallel(return_as="generator")
    work = delayed(_work_for)
    yield from _to_the_end(parallel(work(os.getpid(), function, task) for task in tasks))


class ProcessPool:
    """Processes that get ready while the caller goes on, and are kept for the next pool.

    Parameters
    ----------
    processes : int
        Number of processes. There are at least two, but with one no two tasks run side by side.
    prepare : callable
        What each does first, such as imports; can be pickled.
    """

    def __init__(self, processes: int, prepare: Callable[[], object]) -> None:
        self._processes = processes
        with _interrupts_blocked():
            self._ready = self._run(_call, [prepare] * processes, at_once=processes, ordered=False)

    def map(
        self, function: Callable[[_Task], _Result], tasks: Iterable[_Task], *, ordered: bool = True
    ) -> Iterator[_Result]:
        """Yield the result of each task.

        Parameters
        ----------
        function : callable
            Can be pickled, as can tasks and results.
        tasks : iterable
            What it is called with; taken from as processes become free.
        ordered : bool
            Whether results come in the order of the tasks, or as they are known.

        Raises
        ------
        concurrent.futures.process.BrokenProcessPool
            If a process dies.
        """
        # Joblib runs one set of tasks at a time without a loss; these take a second or two.
        self.wait()
        at_once = 1 if self._processes == 1 else 3 * self._processes
        yield from _to_the_end(self._run(function, tasks, at_once, ordered))

    def wait(self) -> None:
        """Wait until all processes are ready.

        Raises
        ------
        concurrent.futures.process.BrokenProcessPool
            If a process dies.
        """
        for _ in self._ready:
            pass

    def abandon(self) -> None:
        """Cancel what the processes still have to prepare."""
        self._ready.close()

    def _run(
        self,
        function: Callable[[_Task], _Result],
        tasks: Iterable[_Task],
        at_once: int,
        ordered: bool,
    ) -> Any:
        from joblib import Parallel, delayed

        # With one job joblib would start no process.
        with _one_thread_each(max(self._processes, 2)):
            parallel = Parallel(
                batch_size=1,
                pre_dispatch=at_once,
                return_as="generator" if ordered else "generator_unordered",
            )
        work = delayed(_work_for)
        return parallel(work(os.getpid(), function, task) for task in tasks)


@contextmanager
def process_pool(processes: int, prepare: Callable[[], object]) -> Iterator[ProcessPool]:
    """Yield processes that are prepared while the block runs.

    An error waits for them, since processes that are ended during their start print errors; Ctrl-C
    does not.

    Parameters
    ----------
    processes, prepare
        See `ProcessPool`.
    """
    with _without_complaints():
        pool = ProcessPool(processes, prepare)
        try:
            yield pool
        except (KeyboardInterrupt, SystemExit):
            pool.abandon()
            raise
        except ElastocalError:
            pool.wait()
            raise
        pool.wait()


def map_on_cluster(
    function: Callable[[_Task], _Result], tasks: Sequence[_Task], client: Any
) -> Iterator[_Result]:
    """Yield the results of tasks as they are known, done by the workers of a Dask scheduler.

    The function goes over the wire once. Reading it is a task of its own, which the scheduler has
    done again if the workers that hold the result die; workers that join later get a copy from
    those that have one. Tasks of a worker that dies go to another.

    Parameters
    ----------
    function : callable
        Can be pickled, as can tasks and results.
    tasks : sequence
        What it is called with; all are given to the scheduler at once.
    client : distributed.Client
        Connection to the scheduler.
    """
    from distributed import as_completed

    # Older protocols lay arrays out anew, and sums over them are then rounded otherwise.
    sent = pickle.dumps(function, protocol=pickle.HIGHEST_PROTOCOL)
    shared = client.submit(pickle.loads, sent, pure=False)
    # Results are forgotten by the cluster as soon as nothing here names them.
    futures = client.map(_apply, [shared] * len(tasks), tasks, pure=False)
    following: Callable[..., Any] = as_completed
    completed = following(futures, loop=client.loop)
    del futures
    for future in completed:
        yield future.result()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Run linear algebra in the thread that calls it while the block lasts: for small systems.

    Afterwards NumPy and SciPy use as many threads as before. Also a decorator of functions.

    Examples
    --------
    >>> import numpy as np
    >>> with one_blas_thread():
    ...     x = np.linalg.solve(np.eye(18), np.ones(18))
    """
    with _blas().limit(limits=1, user_api="blas"):
        yield


@cache
def _blas() -> "ThreadpoolController":
    """Return the thread pools of linear algebra, sought once: it takes 2 ms."""
    from threadpoolctl import ThreadpoolController

    # Only libraries that are loaded are found.
    importlib.import_module("scipy.linalg")
    return ThreadpoolController()


def _work_for(parent: int, function: Callable[[_Task], _Result], task: _Task) -> _Result:
    """Do a task in a process that ends with its parent, without a long wait for the next task."""
    _end_with(parent)
    return function(task)


@cache
def _end_with(parent: int) -> None:
    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_WATCH)
        os._exit(1)

    # Nobody is left to hear of a worker whose parent was killed, nor to clean up for it.
    threading.Thread(target=watch, daemon=True).start()


def _call(task: Callable[[], object]) -> object:
    return task()


def _apply(function: Callable[[_Task], _Result], task: _Task) -> _Result:
    return function(task)


def _one_thread_each(processes: int) -> Any:
    """Return joblib's settings for processes that leave each other's cores alone."""
    from joblib import parallel_config

    return parallel_config("loky", n_jobs=processes, inner_max_num_threads=1)


def _to_the_end(results: Generator[_Result]) -> Iterator[_Result]:
    """Yield results; a caller may stop early without an error."""
    try:
        for result in results:  # noqa: UP028 - `yield from` would close them with complaints
            yield result
    except GeneratorExit:
        with _without_complaints():
            results.close()
        raise


@contextmanager
def _without_complaints() -> Iterator[None]:
    """Keep joblib quiet about tasks that Ctrl-C leaves unfinished, which is what a user wants."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=r"\s*\d+ tasks", category=UserWarning)
        yield


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
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


class GuardedError(ElastocalError, RuntimeError):
    """Work in a child process that came to no end: it took too long, or crashed."""


_PATIENCE = 5
"""Time that a child may wait beyond the time that it may work."""


def guarded(work: Callable[[], _Result], seconds: int, megabytes: int) -> _Result:
    """Return the value of ``work``, done in a child process with bounded time and memory.

    For libraries that hang where no signal handler runs, ask for any amount of memory, crash, or
    print: with files of which a byte has changed HDF5 does all of that. Elsewhere than on Linux,
    where a process with threads cannot be forked safely, this process does the work.

    Parameters
    ----------
    work : callable
        What is to be done. Its result comes back over a pipe; what it prints is lost.
    seconds : int
        Seconds of a processor, at most.
    megabytes : int
        Megabytes of memory, at most, beside what this process has.

    Raises
    ------
    GuardedError
        If the child ends without a result.
    """
    if not sys.platform.startswith("linux"):
        return work()
    reading, writing = os.pipe()
    with warnings.catch_warnings():
        # Threads that hold a lock now will never release it in the child, which needs none of them.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child == 0:
        _work_guarded(work, writing, seconds, megabytes)
    os.close(writing)
    status = 0
    try:
        with os.fdopen(reading, "rb") as pipe:
            result: _Result = pickle.load(pipe)
            return result
    except (EOFError, pickle.UnpicklingError):
        status = os.waitpid(child, 0)[1]
        child = 0
    finally:
        if child:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
    if status in (signal.SIGXCPU, signal.SIGALRM):
        raise GuardedError(f"it takes more than {seconds} s")
    raise GuardedError(f"the library that reads it crashed, or takes more than {megabytes} MB")


def _work_guarded(
    work: Callable[[], object], writing: int, seconds: int, megabytes: int
) -> NoReturn:
    """Do the work in the child and send the result."""
    import faulthandler
    import gc
    import resource

    faulthandler.disable()  # If enabled by the user: a crash here is reported in a line instead
    gc.disable()  # looking for garbage would copy all memory of the parent
    try:
        # By default the system ends a process that has used its time, whatever it is doing.
        ending = (signal.SIGXCPU, signal.SIGALRM, signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
        for number in ending:
            signal.signal(number, signal.SIG_DFL)
        signal.alarm(_PATIENCE * seconds)
        nothing = os.open(os.devnull, os.O_RDWR)
        os.dup2(nothing, 1)
        os.dup2(nothing, 2)
        # Limits set by the calling process must not be raised.
        hard = resource.getrlimit(resource.RLIMIT_CPU)[1]
        if hard == resource.RLIM_INFINITY or hard > seconds:
            resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        size = int(Path("/proc/self/statm").read_text("ascii").split()[0]) * resource.getpagesize()
        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        most = size + megabytes * 1_000_000
        resource.setrlimit(
            resource.RLIMIT_AS, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard)
        )
        with os.fdopen(writing, "wb") as pipe:
            pickle.dump(work(), pipe, protocol=pickle.HIGHEST_PROTOCOL)
    finally:
        # No handler of the parent, no buffer of its output: they are the parent's.
        os._exit(0)
