"""A signal ends a short command, whenever it comes: by its own exit code, without a traceback."""

import signal
import subprocess
import sys

import pytest

from support.by_day import some_by_day
from support.cli import PATIENCE, default_signals

LATE = """
import importlib.abc, os, signal, sys
from elastocal.cli import main

class Sends(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name == "{module}":
            os.kill(os.getpid(), signal.{name})

sys.meta_path.insert(0, Sends())
main.run()
"""
EARLY = """
import importlib.abc, os, signal, sys

class Sends(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name == "{module}":
            os.kill(os.getpid(), signal.{name})

sys.meta_path.insert(0, Sends())
from _elastocal_program import run
from support.by_day import some_by_day
run()
"""


def _ended(code, *words):
    command = [sys.executable, "-c", code, *words]
    return subprocess.run(
        command,
        capture_output=True, text=True, timeout=PATIENCE, check=False, preexec_fn=default_signals,
    )  # fmt: skip


@pytest.mark.parametrize("name", some_by_day(["SIGINT", "SIGTERM"]))
@pytest.mark.parametrize(
    ("words", "module"),
    [(["--version"], "importlib.metadata"), (["--help"], "rich.panel"), (["robots"], "rich.table")],
)
def test_one_that_comes_during_the_last_import_is_not_swallowed(name, words, module):
    """It is held back until the import has ended, by which time a short command has, too."""
    ended = _ended(LATE.format(name=name, module=module), *words)
    number = getattr(signal, name)
    assert ended.returncode in (128 + number, -number)
    assert "Traceback" not in ended.stderr


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
@pytest.mark.parametrize("module", ["lazy_loader", "elastocal.cli", "typer"])
def test_one_that_comes_while_the_command_line_is_imported_ends_it_at_once(name, module):
    ended = _ended(EARLY.format(name=name, module=module), "--version")
    assert ended.returncode == -getattr(signal, name)
    assert (ended.stdout, ended.stderr) == ("", "")
