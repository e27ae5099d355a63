"""Exported C, compiled and run over many rows."""

import hashlib
import os
import shutil
import subprocess
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from elastocal.compensation.export.writer import c_files
from elastocal.compensation.online import Design
from support.kept import ROOT

HARNESS = Path(__file__).with_name("export_harness.c")
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror")
SANITIZED = ("-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")

GCC = shutil.which("gcc")
needs_gcc = pytest.mark.skipif(GCC is None, reason="gcc is not on this machine")


@dataclass(frozen=True)
class Executable:
    """An exported model with the harness around it."""

    path: Path

    def run(self, mode: str, rows: np.ndarray | None = None) -> subprocess.CompletedProcess[bytes]:
        data = b"" if rows is None else np.ascontiguousarray(rows, dtype=float).tobytes()
        return subprocess.run([self.path, mode], input=data, capture_output=True, check=False)

    def numbers(self, mode: str, rows: np.ndarray) -> np.ndarray:
        """Return what comes out for rows that go in; fails when the program does."""
        done = self.run(mode, rows)
        assert done.returncode == 0, done.stderr.decode()
        return np.frombuffer(done.stdout).reshape(len(rows), -1)

    def selftest(self) -> int:
        return self.run("selftest").returncode


def written(folder: Path, design: Design) -> Path:
    """Write the C files of a design into a new folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in c_files(design).items():
        (folder / name).write_text(text)
    return folder


def build(folder: Path, *flags: str, name: str = "run") -> Executable:
    """Compile the model of a folder strictly, and the harness with it.

    Programs are kept by what they are compiled from: the same C gives the same program.
    """
    sources = [folder / "elastocal_model.c", folder / "elastocal_model.h", HARNESS]
    known = [
        _compiler(),
        repr((*STRICT, *flags)).encode(),
        *(each.read_bytes() for each in sources),
    ]
    kept = ROOT / "c" / hashlib.sha256(b"\0".join(known)).hexdigest()[:24]
    if not kept.exists():
        kept.parent.mkdir(parents=True, exist_ok=True)
        compiled = _compiled(folder, *flags, name=name)
        # Moved there whole, whichever process is first.
        arriving = kept.with_name(f"{kept.name}.{os.getpid()}")
        shutil.copy(compiled, arriving)
        arriving.replace(kept)
    kept.touch()
    return Executable(kept)


@cache
def _compiler() -> bytes:
    return subprocess.run([GCC, "--version"], capture_output=True, check=True).stdout


def _compiled(folder: Path, *flags: str, name: str) -> Path:
    model, target = folder / "elastocal_model.o", folder / name
    strict = [GCC, *STRICT, *flags, "-c", folder / "elastocal_model.c", "-o", model]
    done = subprocess.run(strict, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    link = [GCC, "-std=c99", *flags, f"-I{folder}", HARNESS, model, "-o", target, "-lm"]
    done = subprocess.run(link, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return target
