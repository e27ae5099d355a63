"""Where samples are simulated: processes that get ready early, schedulers that are none."""

import contextlib
import socket
import threading
from functools import partial

import numpy as np
import pytest

from elastocal.codec.study import sampling
from elastocal.codec.study.sampling import batch_executor
from elastocal.errors import CodecError, ProcedureError
from support.cli import elastocal
from support.simulated import example_cell
from support.studies import batch, lack, numbers, refuse, strides


@contextlib.contextmanager
def listening(answer=b""):
    """Yield the address of a port where nobody speaks Dask."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        kept = []

        def serve():
            with contextlib.suppress(OSError):
                while True:
                    kept.append(server.accept()[0])
                    kept[-1].sendall(answer)

        threading.Thread(target=serve, daemon=True).start()
        yield f"tcp://127.0.0.1:{server.getsockname()[1]}"
        for each in kept:
            each.close()


@pytest.mark.parametrize("jobs", [1, 2])
def test_processes_that_got_ready_early_do_every_batch(jobs):
    parts = [[0, 1], [2, 3], [4]]
    with batch_executor(jobs, None) as spread:
        assert spread.workers == jobs
        found = list(spread.map(batch, parts))
    assert sorted(map(numbers, found)) == [numbers(batch(part)) for part in parts]


def test_processes_that_find_nothing_to_do_end_without_a_word(recwarn):
    with batch_executor(2, None):
        pass
    assert not recwarn.list


@pytest.mark.parametrize("answer", [b"", b"SSH-2.0-OpenSSH_9.6\r\n"])
def test_a_port_that_speaks_no_dask_is_refused_and_not_waited_for(monkeypatch, answer):
    pytest.importorskip("distributed")
    monkeypatch.setattr(sampling, "_PATIENCE", 0.5)
    with listening(answer) as address, pytest.raises(CodecError, match="no Dask scheduler answers"):
        sampling._check_scheduler(address)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense://x", "foo", ""])
def test_an_address_without_a_scheduler_is_refused_before_anything_is_written(
    tmp_path, monkeypatch, address
):
    pytest.importorskip("distributed")
    monkeypatch.setattr(sampling, "_PATIENCE", 0.3)
    cell = example_cell("afp").path
    found = elastocal("study", cell, "--out", tmp_path / "study", "--dask", address)
    assert f"--dask {address}: no Dask scheduler answers there" in found.reason
    assert not (tmp_path / "study").exists()


def test_a_worker_is_not_taken_for_a_scheduler(monkeypatch):
    pytest.importorskip("distributed")

    async def worker(_):
        return "Worker"

    monkeypatch.setattr(sampling, "_identity", worker)
    with pytest.raises(CodecError, match="a Dask worker answers there, not a scheduler"):
        sampling._check_scheduler("tcp://127.0.0.1:1")


def test_a_missing_extra_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    with pytest.raises(CodecError, match=r"pip install 'elastocal\[dask\]'"):
        sampling._check_scheduler("tcp://127.0.0.1:9")


def test_workers_of_a_cluster_do_every_batch_and_an_error_of_a_batch_comes_back():
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None
        ) as cluster,
        batch_executor(None, cluster.scheduler_address) as spread,
    ):
        assert spread.workers == 2
        parts = [[0, 1, 2], [3, 4], [5], [6]]
        found = list(spread.map(batch, parts))
        assert sorted(map(numbers, found)) == [numbers(batch(part)) for part in parts]
        turned = np.ones((3, 6, 6)).transpose(1, 2, 0)
        found = spread.map(partial(strides, turned), parts)
        assert set(found) == {turned.strides}
        with pytest.raises(ProcedureError, match="enough"):
            list(spread.map(refuse, parts))
        with pytest.raises(CodecError, match="its workers have no pinocchio: install"):
            list(spread.map(lack, parts))


@pytest.mark.parametrize("joins", ["early", "late"])
def test_a_worker_with_other_versions_is_refused_before_it_simulates(monkeypatch, joins):
    distributed = pytest.importorskip("distributed")
    theirs = {"elastocal": "0.1", "numpy": "2.0", "scipy": "1.0", "pin": "2.0"}
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster:
        address = cluster.scheduler_address
        if joins == "early":
            monkeypatch.setattr(sampling, "version", theirs.__getitem__)
            with pytest.raises(CodecError, match=r"its worker .* has elastocal 0\.1, this command"):
                batch_executor(None, address).__enter__()
        else:
            with batch_executor(None, address) as spread:
                work = partial(sampling._as_here, theirs, batch)
                with pytest.raises(CodecError, match=r"a worker on .* has elastocal .* 0\.1: the"):
                    list(spread.map(work, [[0]]))


def test_a_cluster_without_workers_is_refused_before_the_long_work(monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(sampling, "_PATIENCE", 0.5)
    with (
        distributed.LocalCluster(n_workers=0, processes=False, dashboard_address=None) as cluster,
        pytest.raises(CodecError, match="the cluster was lost or has no worker"),
        batch_executor(None, cluster.scheduler_address),
    ):
        pass
