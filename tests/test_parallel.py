import importlib
import os
import signal
import subprocess
import sys
import time
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import pytest
from threadpoolctl import threadpool_limits

from elastocal import parallel
from elastocal.errors import ElastocalError
from elastocal.parallel import (
    GuardedError,
    core_count,
    guarded,
    map_in_processes,
    one_blas_thread,
    process_count,
    process_pool,
)
from support.cli import PATIENCE
from support.tasks import blas_threads, die, here, nothing, square, threads


@pytest.fixture(autouse=True)
def _more_threads_than_one(monkeypatch):
    """Let libraries of algebra take two unless they are told otherwise, as on a user's machine."""
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    with threadpool_limits(2, "blas"):
        yield


def interrupt(results):
    next(results)
    raise KeyboardInterrupt


def test_no_more_cores_are_counted_than_the_process_may_use():
    assert 1 <= core_count() <= len(os.sched_getaffinity(0))
    pinned = "import os; os.sched_setaffinity(0, {min(os.sched_getaffinity(0))}); "
    counted = pinned + "from elastocal.parallel import core_count; print(core_count())"
    found = subprocess.run([sys.executable, "-c", counted], capture_output=True, check=True)
    assert int(found.stdout) == 1


def test_the_user_decides_on_the_number_of_processes_and_the_cores_when_he_does_not(monkeypatch):
    monkeypatch.setattr(parallel, "core_count", lambda: 8)
    assert process_count() == 8
    assert process_count(worthwhile=False) == 1
    assert process_count(3, worthwhile=False) == 3
    assert process_count(3, 2) == process_count(tasks=2) == 2
    assert process_count(3, 0) == 1
    with pytest.raises(ValueError, match="0 jobs: must be at least 1"):
        process_count(0)


@pytest.mark.parametrize("processes", [1, 2])
def test_results_come_in_the_order_of_their_tasks(processes):
    assert list(map_in_processes(square, range(20), processes)) == [n * n for n in range(20)]


def test_one_process_is_this_one_and_more_are_others():
    assert set(map_in_processes(here, range(4), 1)) == {os.getpid()}
    assert os.getpid() not in set(map_in_processes(here, range(4), 2))


def test_every_process_keeps_its_linear_algebra_to_one_thread():
    for found in map_in_processes(threads, range(4), 2):
        assert set(found) == {1}


@pytest.mark.parametrize("processes", [1, 2])
@pytest.mark.parametrize("ordered", [True, False])
def test_a_pool_does_every_task_of_several_sets(processes, ordered):
    with process_pool(processes, nothing) as pool:
        assert list(pool.map(square, range(3))) == [0, 1, 4]
        assert sorted(pool.map(square, range(5), ordered=ordered)) == [0, 1, 4, 9, 16]


def test_a_pool_whose_process_dies_says_so():
    with process_pool(2, nothing) as pool, pytest.raises(BrokenProcessPool):
        list(pool.map(die, range(2)))


def test_an_error_of_ours_waits_for_processes_that_have_just_been_started():
    with pytest.raises(ElastocalError), process_pool(2, nothing):
        raise ElastocalError
    assert list(map_in_processes(square, range(3), 2)) == [0, 1, 4]


# Loky's own thread may complain of a process that it has just ended itself.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_ctrl_c_in_the_middle_of_the_work_leaves_a_pool_without_a_word():
    with pytest.raises(KeyboardInterrupt), process_pool(2, nothing) as pool:
        interrupt(pool.map(square, range(100)))
    assert list(map_in_processes(square, range(3), 2)) == [0, 1, 4]


def test_ctrl_c_of_the_terminal_reaches_no_process_that_is_started():
    masked = "import signal; print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))"
    with parallel._interrupts_blocked():
        child = subprocess.run([sys.executable, "-c", masked], capture_output=True, check=True)
    assert child.stdout.strip() == b"True"
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])


def test_linear_algebra_runs_in_one_thread_within_the_block_and_as_before_after_it():
    before = blas_threads()
    with one_blas_thread():
        assert set(blas_threads()) == {1}
    assert blas_threads() == before


def test_a_function_can_be_kept_to_one_thread_too():
    before = blas_threads()
    assert set(one_blas_thread()(blas_threads)()) == {1}
    assert blas_threads() == before


@pytest.mark.parametrize(
    ("module", "first", "run"),
    [
        (
            "elastocal.workflows.codec",
            "read_datasets",
            lambda module: module.codec("a.nc", out="a"),
        ),
        ("elastocal.planning.plan", "require_possible_search", lambda module: module.make_plan(0)),
    ],
)
def test_long_work_on_small_systems_keeps_to_one_thread(monkeypatch, module, first, run):
    seen = []

    def stop(*_):
        seen.extend(blas_threads())
        raise ElastocalError("enough")

    found = importlib.import_module(module)
    monkeypatch.setattr(found, first, stop)
    with pytest.raises((ElastocalError, AttributeError)):
        run(found)
    assert set(seen) == {1}


def test_libraries_that_are_loaded_within_the_block_are_not_forgotten():
    code = (
        "from elastocal.parallel import one_blas_thread\n"
        "from threadpoolctl import threadpool_info\n"
        "with one_blas_thread():\n"
        "    import numpy, scipy.linalg\n"
        "    print({found['num_threads'] for found in threadpool_info()})\n"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
    assert found.stdout.strip() == b"{1}"


def test_workers_end_when_their_parent_is_killed(tmp_path):
    code = (
        "import os, signal, sys\n"
        "from pathlib import Path\n"
        "from elastocal.parallel import map_in_processes\n"
        "def told(number):\n"
        "    Path(sys.argv[1], str(os.getpid())).touch()\n"
        "    return number\n"
        "list(map_in_processes(told, range(4), 2))\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    subprocess.run([sys.executable, "-c", code, tmp_path], check=False, timeout=PATIENCE)
    workers = [int(each.name) for each in tmp_path.iterdir()]
    assert workers
    for _ in range(100):
        if not any(Path(f"/proc/{each}").exists() for each in workers):
            return
        time.sleep(0.1)
    pytest.fail(f"{workers} outlive their parent")


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="looks at /dev/shm")
@pytest.mark.parametrize("group", [True, False], ids=["terminated_group", "killed_parent"])
def test_a_pool_that_is_ended_leaves_nothing_in_shared_memory(group):
    code = (
        "import numpy as np, os, time\n"
        "from elastocal.parallel import process_pool\n"
        "def told(many):\n"
        "    time.sleep(0.2)\n"
        "    return len(many)\n"
        "with process_pool(2, int) as pool:\n"
        "    for _ in pool.map(told, (np.ones(400_000) for _ in range(500))):\n"
        "        print(os.getpid(), flush=True)\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, start_new_session=True
    ) as begun:
        assert begun.stdout is not None
        assert begun.stdout.readline().split() == [str(begun.pid).encode()]
        shared = Path("/dev/shm")
        assert [*shared.glob(f"*{begun.pid}*")]
        if group:
            os.killpg(begun.pid, signal.SIGTERM)
        else:
            begun.kill()
    for _ in range(100):
        if not [*shared.glob(f"*[_-]{begun.pid}[_-]*")]:
            return
        time.sleep(0.1)
    pytest.fail(f"{[*shared.glob(f'*{begun.pid}*')]} are left")


def spin() -> None:
    while True:
        pass


def fill() -> int:
    return len(bytearray(200_000_000))


def crash() -> None:
    os.kill(os.getpid(), signal.SIGSEGV)


def test_guarded_work_comes_back():
    assert guarded(lambda: [0, 1, 2], 5, 100) == [0, 1, 2]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="elsewhere nothing is guarded")
@pytest.mark.parametrize(
    ("work", "reason"),
    [
        pytest.param(spin, "more than 1 s", marks=pytest.mark.slow),
        (signal.pause, "more than 1 s"),
        (crash, "crashed"),
        (fill, "more than 100 MB"),
    ],
)
def test_what_takes_too_much_is_ended_without_a_word(work, reason, capfd):
    with pytest.raises(GuardedError, match=reason):
        guarded(work, 1, 100)
    assert capfd.readouterr() == ("", "")
