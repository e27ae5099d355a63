"""Locks that all users of a machine share: who is refused reads by whom, a killed one is gone."""

import os
import signal
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from elastocal import locks
from elastocal.locks import claim

HOLD = """
import sys, time
from pathlib import Path
from elastocal import locks
locks.SHARED = Path(sys.argv[1])
locks.claim("box:49152", "elastocal run a.yaml (process 1)")
print("held", flush=True)
time.sleep(600)
"""


@pytest.fixture
def shared(tmp_path, monkeypatch) -> Path:
    folder = tmp_path / "shared"
    monkeypatch.setattr(locks, "SHARED", folder)
    return folder


@pytest.fixture
def holder(shared):
    """Another process, which has the lock of box:49152."""
    process = subprocess.Popen([sys.executable, "-c", HOLD, str(shared)], stdout=subprocess.PIPE)
    assert process.stdout.readline() == b"held\n"
    yield process
    process.kill()
    process.communicate()


def test_who_is_refused_reads_what_the_holder_says(holder):
    with pytest.raises(BlockingIOError) as refused:
        claim("box:49152", "another")
    assert refused.value.strerror == "elastocal run a.yaml (process 1)"
    claim("box:49153", "another")()


def test_the_lock_of_a_killed_process_is_free(holder):
    holder.send_signal(signal.SIGKILL)
    holder.wait()
    claim("box:49152", "the next")()


def test_within_a_process_it_is_held_too_until_it_is_given_back(shared):
    give_back = claim("box", "the first")
    with pytest.raises(BlockingIOError, match="the first"):
        claim("box", "the second")
    give_back()
    claim("box", "the second")()
    assert list(shared.iterdir()) == []


def test_a_lock_whose_file_was_removed_before_it_was_had_is_taken_anew(shared, monkeypatch):
    """A holder that gives back removes the file that the next one has opened already."""
    first, lock = claim("box", "the first"), locks.lock_file

    def late(handle: int) -> None:
        monkeypatch.setattr(locks, "lock_file", lock)
        first()
        lock(handle)

    monkeypatch.setattr(locks, "lock_file", late)
    claim("box", "the second")
    with pytest.raises(BlockingIOError, match="the second"):
        claim("box", "the third")


def test_every_user_may_lock_what_another_has_left_and_remove_nothing(shared):
    before = os.umask(0o077)
    try:
        give_back = claim("box", "the first")
    finally:
        os.umask(before)
    (file,) = shared.iterdir()
    assert stat.S_IMODE(shared.stat().st_mode) == 0o1777
    assert stat.S_IMODE(file.stat().st_mode) == 0o666
    give_back()


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="needs two users")
def test_two_users_exclude_one_another_whoever_came_first(tmp_path_factory, monkeypatch):
    monkeypatch.setattr(locks, "SHARED", Path("/tmp", f"elastocal-locks-{os.getpid()}"))

    def as_user(user: int, name: str) -> int:
        """Return what a claim of another user ends with: 0 had, 1 refused."""
        child = os.fork()
        if child == 0:
            os.setgid(user)
            os.setuid(user)
            try:
                claim(name, f"user {user}")
            except BlockingIOError:
                os._exit(1)
            except OSError:
                os._exit(2)
            os._exit(0)
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])

    try:
        assert as_user(12345, "left") == 0
        give_back = claim("left", "root")
        assert as_user(12346, "left") == 1
        give_back()
        assert as_user(12346, "left") == 0
    finally:
        for file in locks.SHARED.iterdir():
            file.unlink()
        locks.SHARED.rmdir()


@pytest.mark.parametrize("what", ["link to a folder", "link to nothing", "file"])
def test_a_folder_of_locks_that_is_none_is_refused_and_left_as_it_is(tmp_path, shared, what):
    mine = tmp_path / "mine"
    if what == "link to a folder":
        mine.mkdir(mode=0o700)
    if what == "file":
        shared.write_text("mine")
    else:
        shared.symlink_to(mine)
    with pytest.raises(OSError, match=r"Not a directory|File exists"):
        claim("box", "me")
    assert not mine.exists() or stat.S_IMODE(mine.stat().st_mode) == 0o700


def test_a_link_in_the_place_of_a_lock_is_not_followed(tmp_path, shared):
    give_back = claim("box", "me")
    (file,) = shared.iterdir()
    give_back()
    mine = tmp_path / "mine"
    mine.write_text("mine")
    file.symlink_to(mine)
    with pytest.raises(OSError, match="symbolic links"):
        claim("box", "me")
    assert mine.read_text() == "mine"


def test_what_a_holder_writes_reaches_a_terminal_as_one_short_line(shared):
    claim("box", "a\x1b[2J\nb" + "c" * 10_000)
    with pytest.raises(BlockingIOError) as refused:
        claim("box", "me")
    assert refused.value.strerror.startswith("a[2Jbccc")
    assert len(refused.value.strerror) <= 400
