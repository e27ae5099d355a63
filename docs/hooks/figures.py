"""Figures of the site are made by its build: from fixed seeds, on simulated cells.

What is drawn and how stands in the package ``gallery`` beside this file, which runs in two
processes. Figures are kept in ``.cache/figures``, under a hash of everything that they are made
by, so that a build without changes to the sources takes them from there. Nothing that is made is
committed.

A comment ``<!-- told: NAME -->`` in a page becomes the sentence with the figures that belong to
the picture of that name.

With ``SITE_FIGURES=false`` none is made, and what a page names stands there empty: so `make test`
tries pages and links, in half the time. `make site` draws.
"""

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parents[2]
CACHE = ROOT / ".cache" / "figures"
DRAWN = os.environ.get("SITE_FIGURES") != "false"
PROCESSES = (
    ("placement", "notebooks"),
    (
        "machining",
        "small",
        "budget",
        "demos",
        "instruments",
        "faults",
        "mistakes",
        "stopping",
        "studio",
    ),
)
"""Modules of ``gallery``, by the process that runs them."""
TOLD = "told.json"
_PACKAGES = ("numpy", "scipy", "pin", "matplotlib", "plotly")
_MARK = re.compile(r"<!-- told: (\S+) -->")
_NAMED = re.compile(r"\bfigures/[\w-]+\.\w+")
_IMAGE = re.compile(r'(<img [^>]*src="([^"]*figures/[^"]+)"[^>]*>)')
_told: dict[str, str] = {}


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the figures to the site, below ``figures/``; make them first where that is needed."""
    if not DRAWN:
        for name in {each for page in files.documentation_pages() for each in _named(page)}:
            files.append(File.generated(config, name, content=""))
        return files
    folder = CACHE / _hash()
    if not folder.is_dir():
        _make(folder)
    _told.clear()
    for path in sorted(folder.rglob("*")):
        if path.name == TOLD:
            _told.update(json.loads(path.read_text(encoding="utf-8")))
        elif path.is_file():
            name = f"figures/{path.name}"
            files.append(File.generated(config, name, abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, **_: object) -> str:
    """Return the page with what was measured in place of its marks."""
    return _MARK.sub(lambda mark: _said(mark[1]), markdown) if DRAWN else markdown


def on_page_content(html: str, **_: object) -> str:
    """Return the page with every figure a link to itself: text in it is small on a phone."""
    return _IMAGE.sub(r'<a class="figure" href="\2">\1</a>', html)


def _named(page: File) -> list[str]:
    """Return the figures that a page names."""
    return _NAMED.findall(page.content_string)


def _said(name: str) -> str:
    if name not in _told:
        raise PluginError(f"no figure {name!r} was made (made: {', '.join(sorted(_told))})")
    return _told[name]


def _hash() -> str:
    """Return a hash of everything that the figures are made by."""
    beside = ROOT.parent / "shared" / "data" / "fanuc_r2000ic"
    found = hashlib.sha256("".join(version(name) for name in _PACKAGES).encode())
    for folder in (ROOT / "src", Path(__file__).parent, ROOT / "docs" / "notebooks", beside):
        for path in sorted(folder.rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                found.update(str(path.relative_to(folder)).encode() + path.read_bytes())
    return found.hexdigest()[:16]


def _make(folder: Path) -> None:
    """Run every part, then put the new figures in place of the old ones."""
    CACHE.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=CACHE.parent) as made:
        # Several threads a process would only get into each other's way.
        environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        running = {
            parts: subprocess.Popen(
                [sys.executable, "-m", "gallery", made, *parts],
                cwd=Path(__file__).parent, env=environment, stderr=subprocess.PIPE, text=True,
            )
            for parts in PROCESSES
        }  # fmt: skip
        wrong = {parts: process.communicate()[1] for parts, process in running.items()}
        for parts, process in running.items():
            if process.returncode != 0:
                what = " and ".join(parts)
                raise PluginError(f"figures of {what} could not be made:\n{wrong[parts]}")
        for old in CACHE.iterdir():
            shutil.rmtree(old)
        Path(made).rename(folder)
        Path(made).mkdir()  # what is left to be removed
