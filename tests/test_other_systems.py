"""What Windows and macOS lack or do otherwise, as far as it can be tried on Linux."""

import os
import subprocess
import sys
import types
from pathlib import Path

import pytest

from elastocal import files, locks
from elastocal.cell.examples import binary_stl, block_mesh
from elastocal.cli import _signals
from elastocal.dataset import read, write
from elastocal.errors import FileAccessError
from elastocal.procedure import Event, Journal
from elastocal.report.document import chromium
from elastocal.tables import opened_table
from support.cells import Cell, linear_truth
from support.cli import elastocal

IMPORT_ALL = """
import importlib, os, pkgutil, signal, sys
# What is not ours may look at the system; it comes first.
for name in ("joblib", "h5py", "matplotlib.pyplot", "mcap", "numpy", "pinocchio", "plotly.io",
             "pydantic", "rich.live", "scipy.optimize", "scipy.stats", "threadpoolctl", "trimesh",
             "typer", "xarray", "yaml", "zstandard", "multiprocessing.util", "subprocess",
             "tempfile", "socket", "asyncio", "http.server", "webbrowser"):
    try: importlib.import_module(name)
    except ImportError: pass
for name in ("fcntl", "resource", "termios", "pwd", "grp", "tty", "pty"):
    sys.modules[name] = None
for name in ("fork", "geteuid", "O_NOFOLLOW", "O_DIRECTORY", "sched_getaffinity", "uname"):
    if hasattr(os, name): delattr(os, name)
for name in ("SIGHUP", "SIGALRM", "SIGQUIT", "SIGTSTP", "SIGXCPU", "pthread_kill", "setitimer"):
    if hasattr(signal, name): delattr(signal, name)
import elastocal
for module in pkgutil.walk_packages(elastocal.__path__, "elastocal."):
    if not module.name.endswith("__main__"):
        importlib.import_module(module.name)
print(sum(name.startswith("elastocal.") for name in sys.modules))
"""


@pytest.mark.slow
def test_every_module_can_be_imported_without_what_only_posix_has():
    done = subprocess.run(
        [sys.executable, "-c", IMPORT_ALL], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 300


@pytest.fixture
def windows(monkeypatch):
    """Locks as on Windows; the list holds the descriptors that are locked."""
    held: list[tuple[int, int]] = []

    def locking(handle: int, mode: int, count: int) -> None:
        assert (mode, count) == (2, 1)
        node = os.fstat(handle).st_ino
        if any(other == node for _, other in held):
            raise PermissionError(13, "in use")
        assert os.lseek(handle, 0, os.SEEK_CUR) == locks._FAR
        held.append((handle, node))

    module = types.ModuleType("msvcrt")
    module.LK_NBLCK, module.locking = 2, locking
    monkeypatch.setitem(sys.modules, "msvcrt", module)
    monkeypatch.setattr(locks, "POSIX", False)
    return held


class TestWindows:
    def test_a_journal_is_locked_against_a_second_process(self, windows, tmp_path):
        path = tmp_path / "journal.jsonl"
        with Journal(path) as journal:
            with pytest.raises(FileAccessError, match="another process"):
                Journal(path)
            journal.write(0.0, Event.END)
        assert len(windows) == 1
        assert path.read_bytes().endswith(b"}\n")

    def test_files_and_folders_are_written_whole_and_nothing_is_left(self, windows, tmp_path):
        files.write_text(tmp_path / "a b.txt", "one\n")
        with files.filling(tmp_path / "folder", "last") as inside:
            (inside / "last").write_text("x")
        with pytest.raises(RuntimeError), files.replacing(tmp_path / "a b.txt"):
            raise RuntimeError
        assert (tmp_path / "a b.txt").read_bytes() == b"one\n"
        assert {each.name for each in tmp_path.iterdir()} == {"a b.txt", "folder"}
        assert windows == []

    @pytest.mark.usefixtures("windows")
    def test_what_a_killed_writer_left_is_left_alone(self, tmp_path):
        left = tmp_path / ".a.txt.elastocal-0"
        left.write_text("half")
        files.remove_leftovers(tmp_path / "a.txt")
        assert left.exists()

    def test_a_pdf_is_refused_with_the_way_that_is_left(self, monkeypatch):
        monkeypatch.setattr(chromium.os, "name", "nt")
        with pytest.raises(FileAccessError, match="print it"):
            chromium.find_browser()

    def test_a_signal_is_sent_once_more_without_pthread_kill(self, monkeypatch):
        sent: list[int] = []
        monkeypatch.delattr(_signals.signal, "pthread_kill")
        monkeypatch.setattr(_signals._thread, "interrupt_main", sent.append)
        _signals._send(2)
        assert sent == [2]


def test_a_browser_of_macos_is_found_in_its_folder(monkeypatch, tmp_path):
    place = tmp_path / "Google Chrome.app/Contents/MacOS/Google Chrome"
    place.parent.mkdir(parents=True)
    place.write_text("")
    monkeypatch.setattr(chromium.shutil, "which", lambda _: None)
    monkeypatch.setattr(chromium, "_APPLICATION_FOLDERS", (tmp_path,))
    assert chromium.find_browser() == str(place)


def _rewritten(path: Path, target: Path, end: str, mark: bytes = b"") -> Path:
    text = path.read_bytes().decode().replace("\r\n", "\n").replace("\n", end)
    target.write_bytes(mark + text.encode())
    return target


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"], ids=["plain", "with a byte order mark"])
def test_a_dataset_with_windows_line_ends_is_the_same_dataset(tmp_path, mark):
    write(Cell(linear_truth(), poses=6).measure(), tmp_path / "unix.csv")
    written = _rewritten(tmp_path / "unix.csv", tmp_path / "of windows.csv", "\r\n", mark)
    ours, theirs = read(tmp_path / "unix.csv"), read(written)
    assert ours.to_xarray().drop_attrs().equals(theirs.to_xarray().drop_attrs())


def test_a_table_in_an_ansi_code_page_is_refused_with_what_to_do(tmp_path):
    path = tmp_path / "werte.csv"
    path.write_bytes("pose,Höhe[mm]\r\n1,2\r\n".encode("cp1252"))
    with pytest.raises(FileAccessError, match=r"werte\.csv.*CSV UTF-8"), opened_table(path):
        pass


def test_commands_take_paths_with_spaces(tmp_path):
    folder = tmp_path / "cell of hall 7, ä"
    folder.mkdir()
    mesh = folder / "part number 1.stl"
    mesh.write_bytes(binary_stl(block_mesh()))
    cell = folder / "my cell.yaml"
    assert elastocal("new", "--robot", "UR20", "--mesh", mesh, "-o", cell).code == 0
    assert elastocal("check", cell).code == 0
