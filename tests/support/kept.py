"""Folders that take long to make, kept for as long as nothing changes that they are made from.

The name of the folder that holds them is a hash of everything that they depend on: the package,
this folder, Python and the libraries. Changed code therefore looks elsewhere and finds nothing.
Beside each stands the hash of its own content, so that one that a test has written into, or that
was half made, is made again.
"""

import fcntl
import hashlib
import json
import os
import platform
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from functools import cache
from importlib import metadata
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
ROOT = REPOSITORY / ".pytest_cache" / "kept"
SOURCES = (REPOSITORY / "src" / "elastocal", Path(__file__).parent)
_DAY = 86400.0
"""How long folders of other code stay, in s."""


@cache
def kept(name: str, make: Callable[[Path], None]) -> Path:
    """Return a folder that ``make`` has filled, now or before; do not write into it.

    Parameters
    ----------
    name : str
        Name of the folder.
    make : callable
        Fills a new, empty folder. With xdist one process calls it and the others wait.
    """
    home = ROOT / source_key()
    home.mkdir(parents=True, exist_ok=True)
    folder, seal = home / name, home / f"{name}.sha256"
    with (home / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (seal.exists() and seal.read_text() == content_hash(folder)):
            _forget_others(home)
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            make(folder)
            seal.write_text(content_hash(folder))
    return folder


@cache
def source_key() -> str:
    """Return the hash of everything that a folder may depend on."""
    libraries = sorted(f"{each.name}={each.version}" for each in metadata.distributions())
    known = [sys.version, platform.platform(), str(ROOT), *libraries]
    # What mutates code in memory leaves the files alone.
    known.append(os.environ.get("MUTANT_UNDER_TEST", ""))
    if _coverage_is_measured():  # only what runs is counted
        known.append(os.environ.get("PYTEST_XDIST_TESTRUNUID", str(os.getpid())))
    known += [f"{source.name}={content_hash(source)}" for source in SOURCES]
    return hashlib.sha256(json.dumps(known).encode()).hexdigest()[:16]


def content_hash(folder: Path) -> str:
    """Return a hash of the names and bytes of all files of a folder."""
    found = hashlib.sha256()
    for path in sorted(_files(folder)):
        data = path.read_bytes()
        found.update(f"{path.relative_to(folder)} {len(data)}\n".encode() + data)
    return found.hexdigest()


def _files(folder: Path) -> Iterator[Path]:
    for path in folder.rglob("*"):
        if path.is_file() and "__pycache__" not in path.parts:
            yield path


def _coverage_is_measured() -> bool:
    coverage = sys.modules.get("coverage")
    return coverage is not None and coverage.Coverage.current() is not None


def _forget_others(home: Path) -> None:
    """Remove what other code made long ago; another run may be using what is newer."""
    for other in (*ROOT.iterdir(), *ROOT.glob("c/*")):
        if other.name not in (home.name, "c") and time.time() - other.stat().st_mtime > _DAY:
            shutil.rmtree(other) if other.is_dir() else other.unlink(missing_ok=True)
