"""A signed run with its signed report, and what forgers do to them."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

from elastocal.errors import ElastocalError
from elastocal.verdict import (
    EMPTY_MANIFEST,
    embed_manifest,
    make_key,
    read_manifest,
)
from elastocal.workflows import verify
from support.cli import elastocal
from support.kept import kept
from support.run_cells import planned_cell

OPENED, CLOSED = EMPTY_MANIFEST.partition("></")[0] + ">", "</script>"
PAGE, RUN = "report.html", "run"


def signed() -> Path:
    """Return a folder with ``mine``, ``other`` (keys) and ``all``, ``twin``: signed runs.

    Each of the two holds ``run``, ``model.json`` and ``report.html``; ``all`` also ``older.html``,
    a report on an earlier calibration of the same run. All tests share them: copy what is to be
    changed.
    """
    return kept("signed", _make)


def _make(folder: Path) -> None:
    for name in ("mine", "other"):
        make_key(folder / name)
    planned = planned_cell(folder / "planned", 5)
    for name, seed in (("all", 0), ("twin", 1)):
        whole = folder / name
        whole.mkdir()
        sign = ("--sign", folder / "mine")
        _done(
            *("run", planned.cell, "--plan", planned.plan, "--out", whole / RUN, *sign),
            *("--seed", seed),
        )
        model = (whole / RUN / "dataset.nc", "--out", whole / "model.json", "--draws", 40)
        if name == "all":
            _done("calibrate", *model, "--springs", "actuated")
            _done("report", whole / RUN, "--out", whole / "older.html", *sign)
        _done("calibrate", *model, "--springs", "bearing", "--force")
        _done("report", whole / RUN, "--out", whole / PAGE, *sign)


def _done(*arguments: object) -> None:
    result = elastocal(*arguments)
    assert result.code == 0, (arguments, result.err)


def copied(target: Path, name: str = "all") -> Path:
    """Copy one of the two into a new folder; return it."""
    shutil.copytree(signed() / name, target)
    return target


def refusal(target: Path, **options: Any) -> str:
    """Return why `verify` refuses a report or a run; empty where it does not."""
    try:
        verify(target, **{"key": signed() / "mine.pub", **options}).require_whole()
    except ElastocalError as error:
        return str(error)
    return ""


def split(page: bytes) -> tuple[bytes, bytes, bytes]:
    """Return what stands before the text of a manifest, that text, and what stands behind it."""
    before, opened, rest = page.partition(OPENED.encode())
    text, closed, after = rest.partition(CLOSED.encode())
    return before + opened, text, closed + after


def renew(path: Path, **changes: Any) -> None:
    """Change entries of the manifest of a report, with its own hash, as whoever has our library."""
    found = read_manifest(path).manifest
    before, _, after = split(path.read_bytes())
    made = embed_manifest(EMPTY_MANIFEST, replace(found, **changes)).encode()
    path.write_bytes(before + split(made)[1] + after)
