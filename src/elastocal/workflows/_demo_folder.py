"""The folder of a demo: made, emptied when it holds an earlier one, explained at the end."""

import shutil
from collections.abc import Sequence
from pathlib import Path

from elastocal import __version__
from elastocal.errors import FileAccessError
from elastocal.files import write_text

LOG = "log.txt"
README = "README.md"
_FIRST = "# A demo of elastocal:"
"""How a README begins that tells an earlier demo from somebody's own folder."""

_FILES = (
    ("report.html", "the report: open it in a browser; it needs no network"),
    ("cell.yaml", "the cell: robot, tool, sensor, trackers, tooling, load cases, limits"),
    ("plan/plan.html", "the chosen poses in three dimensions; plan.json holds them for programs"),
    ("run/", "cell and plan as used, journal, raw streams (.mcap), dataset.nc, summary.json"),
    ("model.json", "the calibrated model: compliances, their bootstrap draws, what is observable"),
    ("tool.json", "mass, centre of mass, sensor bias and rotation, from the unloaded poses"),
    ("codec/", "were there enough poses: one folder a comparison, with codec.html"),
    ("process/", "the process without and with correction in real time: the paper's Table 1"),
    ("process/path.csv", "the programmed path with the forces that are expected"),
    ("corrected.csv", "the same path, corrected offline"),
    ("c/", "C99 of the model and its compensator, for the real-time target"),
    (LOG, "every command as it was given, and what it printed"),
)


def begin(out: Path, kind: str, force: bool) -> None:
    """Make the folder, without an earlier demo.

    Raises
    ------
    FileAccessError
        If it holds files, unless all are those of a demo and ``force`` is given.
    """
    try:
        holds = sorted(entry.name for entry in out.iterdir()) if out.exists() else []
        if holds:
            _refuse_foreign(out, holds, force)
            _empty(out)
        out.mkdir(parents=True, exist_ok=True)
        # Written first: a demo that is interrupted can be removed like a finished one.
        write_text(out / README, f"{_FIRST} {kind}\n\nNot finished.\n")
    except OSError as error:
        if isinstance(error, FileAccessError):
            raise
        raise FileAccessError(f"cannot use folder {out}: {error.strerror or error}") from error


def finish(out: Path, kind: str, seed: int, commands: Sequence[str]) -> None:
    """Write what each file is, and how to make all of them again.

    Raises
    ------
    FileAccessError
        If it cannot be written.
    """
    rows = "".join(f"| [{name}]({name}) | {text} |\n" for name, text in _FILES)
    lines = "".join(f"{command}\n" for command in commands)
    write_text(
        out / README,
        f"{_FIRST} {kind}\n\n"
        f"Made by elastocal {__version__} on a simulated cell, seed {seed}. Every measurement in"
        " it was simulated, with a truth that the model cannot express; nothing was measured on a"
        " robot.\n\n"
        f"| file | what it is |\n|---|---|\n{rows}\n"
        f"## How it was made\n\n```sh\n{lines}```\n",
    )


def _refuse_foreign(out: Path, holds: list[str], force: bool) -> None:
    readme = out / README
    ours = readme.is_file() and readme.read_text("utf-8", "replace").startswith(_FIRST)
    known = {name.partition("/")[0] for name, _ in _FILES} | {README}
    foreign = [name for name in holds if name not in known and not name.endswith(".stl")]
    if foreign or not ours:
        first = (foreign or holds)[0]
        raise FileAccessError(f"{out} holds files that are no demo's ({first}): name another")
    if not force:
        raise FileAccessError(f"{out} holds a demo already: name another, or give --force")


def _empty(out: Path) -> None:
    """Remove what a folder holds, the README last: what is left then is known as a demo's.

    The folder itself stays: it may be a link, or the one that somebody stands in.
    """
    for entry in sorted(out.iterdir(), key=lambda each: each.name == README):
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry)
        else:
            entry.unlink()
