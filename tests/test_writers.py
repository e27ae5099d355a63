"""What every writer of files does on a disk that is full: one line, nothing left behind.

The disk is a limit of the size of a file (``ulimit -f``), and a real one where this machine lets
us mount it.
"""

import contextlib
import resource
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from mcap.records import Metadata

from elastocal.cell.examples import write_example
from elastocal.compensation.export import write_c
from elastocal.compensation.online import design
from elastocal.dataset import write as write_dataset
from elastocal.errors import FileAccessError
from elastocal.files import filling, write_json, write_text
from elastocal.identification import write_model
from elastocal.procedure.record.streams import Topic, write_mcap
from elastocal.records import LabelledArray, LabelledArrays, write_arrays
from elastocal.report.plots import write_figure
from elastocal.tables import write_table
from support import compensated
from support.datasets import dataset

LIMIT = 4096
NUMBERS = np.random.default_rng(0).normal(size=20_000)


def stream(path: Path) -> None:
    messages = [b'{"x":%f}' % value for value in NUMBERS]
    topic = Topic("a", "schema", "{}", np.arange(len(messages)), messages)
    write_mcap(path, [topic], "library", Metadata(name="m", metadata={}))


def drawn() -> Figure:
    figure = Figure()
    figure.subplots().plot(NUMBERS)
    return figure


def arrays(path: Path, packed: bool) -> None:
    variable = LabelledArray(("x",), NUMBERS, packed=packed)
    texts = LabelledArray(("t",), np.array(["text"] * 4000))
    write_arrays(path, LabelledArrays({"a": variable, "b": texts}))


def folder(path: Path) -> None:
    with filling(path, "a") as temporary:
        (temporary / "a").write_bytes(NUMBERS.tobytes())


WRITERS: dict[str, Callable[[Path], object]] = {
    "arrays.nc": lambda path: arrays(path, packed=False),
    "packed.nc": lambda path: arrays(path, packed=True),
    "dataset.nc": lambda path: write_dataset(dataset(), path),
    "model.json": lambda path: write_model(path, compensated.arm()),
    "numbers.json": lambda path: write_json(path, NUMBERS.tolist()),
    "page.html": lambda path: write_text(path, str(NUMBERS.tolist())),
    "table.csv": lambda path: write_table(path, ["x"], NUMBERS[:, None].tolist()),
    "stream.mcap": stream,
    "figure.svg": lambda path: write_figure(path, drawn),
    "figure.png": lambda path: write_figure(path, drawn),
    "figure.pdf": lambda path: write_figure(path, drawn),
    "example": lambda path: write_example(path, "afp"),
    "c": lambda path: write_c(path, design(compensated.arm())),
    "folder": folder,
}


@contextlib.contextmanager
def short_files() -> Iterator[None]:
    """Let no file grow beyond `LIMIT`: what a full disk does, and ``ulimit -f``."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (LIMIT, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def left_in(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*") if path.is_file()]


@pytest.mark.parametrize("name", WRITERS)
def test_a_file_that_finds_no_room_is_refused_in_one_line_and_leaves_nothing(tmp_path, name):
    path = tmp_path / name
    with short_files(), pytest.raises(FileAccessError) as refusal:
        WRITERS[name](path)
    assert str(refusal.value).startswith(f"cannot write {path}")
    assert str(refusal.value).endswith("File too large")
    assert "\n" not in str(refusal.value)
    # An example is several files, each of them whole.
    assert [each.name for each in left_in(tmp_path)] in ([], ["cell.yaml"])


@pytest.mark.parametrize("name", [name for name in WRITERS if "." in name])
def test_a_file_that_is_there_stays_as_it_was(tmp_path, name):
    path = tmp_path / name
    path.write_text("before")
    with short_files(), pytest.raises(FileAccessError):
        WRITERS[name](path)
    assert path.read_text() == "before"
    assert left_in(tmp_path) == [path]


FULL = """
import sys
from pathlib import Path
from elastocal.errors import FileAccessError
from test_writers import WRITERS, left_in

disk = Path(sys.argv[1])
for name, write in WRITERS.items():
    try:
        write(disk / name)
    except FileAccessError as error:
        print(name, error)
    for path in left_in(disk):
        path.unlink()
"""


@pytest.mark.slow
def test_a_full_disk_is_no_crash(tmp_path):
    """A crash of a library would be one of Python: a process of its own."""
    if shutil.which("unshare") is None:
        pytest.skip("unshare is not on this machine")
    mount = 'mount -t tmpfs -o size=8k none "$0"'
    probe = ["unshare", "-rm", "sh", "-c", mount, tmp_path]
    if subprocess.run(probe, capture_output=True, check=False).returncode != 0:
        pytest.skip("this machine lets nobody mount a tmpfs of his own")
    script = f'{mount} && exec "$1" -c "$2" "$0"'
    command = ["unshare", "-rm", "sh", "-c", script, tmp_path, sys.executable, FULL]
    paths = {"PYTHONPATH": ":".join(path for path in sys.path if path)}
    done = subprocess.run(command, env=paths, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    lines = done.stdout.splitlines()
    assert [line.split()[0] for line in lines] == list(WRITERS)
    assert all(line.endswith("No space left on device") for line in lines)
