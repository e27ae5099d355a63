"""A small cell taken through every command, once, as a user would: what reports are made from."""

import shutil
from pathlib import Path

from elastocal.cell import load_cell
from elastocal.planning import make_plan, write_plan, write_pool
from support.cli import elastocal
from support.kept import kept
from support.run_cells import planned_cell

POSES = 7
MADE = "2026-01-02T03:04:05+00:00"


def finished() -> Path:
    """Return a folder with ``run``, ``model.json``, ``tool.json``, ``codec`` and ``process``.

    All tests share it: copy what is to be changed.
    """
    return kept("reported", _make)


def _make(folder: Path) -> None:
    made = planned_cell(folder, POSES)
    planned = make_plan(load_cell(made.cell), "ioops", 1)
    write_plan(made.plan, planned.plan)
    write_pool(made.plan, planned.pool)
    run, model, tool = folder / "run", folder / "model.json", folder / "tool.json"
    data = run / "dataset.nc"
    _done("run", made.cell, "--plan", made.plan, "--out", run)
    _done("calibrate", data, "--out", model, "--draws", 40)
    _done("tool", run, "--out", tool)
    _done("codec", data, "--compare", "springs=actuated,bearing", "--out", folder / "codec")
    _done(
        *("simulate-process", made.cell, "--model", model, "--tool", tool, "--process", "afp"),
        *("--courses", 1, "--out", folder / "process"),
    )


def copied(source: Path, target: Path, *names: str) -> Path:
    """Copy parts of the finished cell (all of them by default) into a new folder; return it."""
    target.mkdir(parents=True, exist_ok=True)
    for name in names or ("run", "model.json", "tool.json", "codec", "process"):
        if (source / name).is_dir():
            shutil.copytree(source / name, target / name)
        else:
            shutil.copy(source / name, target / name)
    return target


def _done(*arguments: object) -> None:
    result = elastocal(*arguments)
    assert result.code == 0, (arguments, result.err)
