"""Notebooks of the site: pages whose Python is run when the site is made, and kept for download.

A notebook is a Markdown page in ``docs/notebooks``: every block of Python is a cell, what stands
between two of them is its text. Nothing that was computed stands in it. It is run in an empty
folder and needs no file of this repository; `make` writes it as ``NAME.ipynb`` with its outputs,
and its figures once more as SVG, whose greys follow the colour scheme of the page.

``python -m gallery.notebooks [NAME …]`` runs what a reader downloads as a reader does: by Jupyter,
in a fresh kernel, in an empty folder.
"""

import ast
import base64
import contextlib
import io
import json
import re
import sys
import tempfile
import warnings
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

from matplotlib.figure import Figure

from elastocal.report.plots import figure_bytes, themed_svg

SOURCES = Path(__file__).resolve().parents[2] / "notebooks"
FENCE = re.compile(r"^```python\n(.*?)^```$", flags=re.MULTILINE | re.DOTALL)
"""A cell of a page."""
SVG = "elastocal_svg"
"""Key in the metadata of an output: name of the same figure as SVG."""
_LINK = re.compile(r"\[([^\]]+)\]\((?!https?:)[^)]*\)")
"""To another page, which stands in no folder of a reader."""
_NEEDS = (
    'Needs Python with `pip install "elastocal[notebook]"` and no other file; what it writes, it'
    " writes into the folder that it is run in."
)
_DPI = 100
_SECONDS = 300

Output = dict[str, Any]
"""Of a cell, as the notebook format has it."""


class NotebookError(Exception):
    """A cell of a notebook does not run."""


@dataclass(frozen=True)
class Cell:
    """A part of a notebook."""

    source: str
    code: bool
    outputs: tuple[Output, ...] = ()
    number: int | None = None
    """Of a cell that was run, from 1."""


def paths() -> list[Path]:
    """Return the notebooks, by name."""
    return [path for path in sorted(SOURCES.glob("*.md")) if path.stem != "index"]


def cells_of(path: Path) -> list[Cell]:
    """Return the cells of a page, none of them run."""
    parts = FENCE.split(path.read_text(encoding="utf-8"))
    # Split by a pattern with one group: text and code by turns.
    cells = [Cell(part.strip(), bool(k % 2)) for k, part in enumerate(parts)]
    return [cell for cell in cells if cell.source]


def ipynb(cells: list[Cell]) -> str:
    """Return a notebook as its file, format 4.5."""
    shown = [cells[0], Cell(_NEEDS, code=False), *cells[1:]]
    data = {
        "cells": [_cell_data(cell, f"cell-{number}") for number, cell in enumerate(shown)],
        "metadata": {
            "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
            "language_info": {"name": "python"},
        },
        "nbformat": 4,
        "nbformat_minor": 5,
    }
    return json.dumps(data, indent=1, ensure_ascii=False) + "\n"


def _cell_data(cell: Cell, identity: str) -> dict[str, Any]:
    source = cell.source if cell.code else _LINK.sub(r"\1", cell.source)
    common = {"id": identity, "metadata": {}, "source": source.splitlines(keepends=True)}
    if not cell.code:
        return {"cell_type": "markdown", **common}
    run = {"execution_count": cell.number, "outputs": list(cell.outputs)}
    return {"cell_type": "code", **common, **run}


def run(path: Path, pictures: Path) -> list[Cell]:
    """Run a notebook in an empty folder; return its cells with what they put out.

    Parameters
    ----------
    path : Path
        The page.
    pictures : Path
        Folder to write its figures into, as SVG.

    Raises
    ------
    NotebookError
        If a cell does not run, or warns.
    """
    # The cells run in another folder.
    home, namespace = pictures.resolve(), {"__name__": "__main__"}
    done: list[Cell] = []
    with tempfile.TemporaryDirectory() as empty, contextlib.chdir(empty):
        for cell in cells_of(path):
            number = sum(each.code for each in done) + 1
            picture = home / f"notebook-{path.stem}-{number}.svg"
            try:
                outputs = _run_cell(cell.source, number, namespace, picture) if cell.code else ()
            except Exception as error:
                raise NotebookError(
                    f"{path.name}, cell {number}: {type(error).__name__}: {error}\n{cell.source}"
                ) from error
            done.append(replace(cell, outputs=tuple(outputs), number=number if cell.code else None))
    return done


def _run_cell(source: str, number: int, namespace: dict[str, Any], picture: Path) -> list[Output]:
    """Run a cell as Jupyter does; return what it printed, and how its last expression shows itself.

    A figure is also written as SVG.
    """
    tree, printed, value, outputs = ast.parse(source), io.StringIO(), None, list[Output]()
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    with warnings.catch_warnings(), contextlib.redirect_stdout(printed):
        warnings.simplefilter("error")
        exec(compile(tree, f"cell {number}", "exec"), namespace)
        if last is not None:
            value = eval(compile(ast.Expression(last.value), f"cell {number}", "eval"), namespace)
    if printed.getvalue():
        outputs.append({"output_type": "stream", "name": "stdout", "text": printed.getvalue()})
    if value is not None:
        data, metadata = _shown(value, picture)
        result = {"output_type": "execute_result", "execution_count": number}
        outputs.append({**result, "data": data, "metadata": metadata})
    return outputs


def _shown(value: object, picture: Path) -> tuple[dict[str, str], dict[str, str]]:
    """Return the forms of a value that a notebook may show, and what the site shows of a figure."""
    data = {"text/plain": repr(value)}
    if isinstance(value, Figure):
        png = figure_bytes(lambda: value, ".png", _DPI)
        picture.write_bytes(themed_svg(lambda: value))
        alt = ". ".join(text.get_text() for text in value.texts[:2]) or picture.stem
        data["image/png"] = base64.b64encode(png).decode()
        return data, {SVG: picture.name, "alt": alt}
    if hasattr(value, "_repr_html_"):
        data["text/html"] = value._repr_html_()
    return data, {}


def make(folder: Path) -> dict[str, str]:
    """Run every notebook; write it with its outputs, and its figures."""
    for path in paths():
        (folder / f"{path.stem}.ipynb").write_text(ipynb(run(path, folder)), encoding="utf-8")
    return {}


def main(names: list[str]) -> None:
    """Run notebooks by Jupyter, each in a fresh kernel and an empty folder; stop at an error."""
    import nbclient
    import nbformat
    from jupyter_client import AsyncKernelManager

    chosen = [path for path in paths() if not names or path.stem in names]
    for path in chosen:
        begin = perf_counter()
        notebook = nbformat.reads(ipynb(cells_of(path)), as_version=4)
        nbformat.validate(notebook)
        with tempfile.TemporaryDirectory() as empty, tempfile.TemporaryDirectory() as pipes:
            # Kernel and client talk through pipes of the system: nothing listens on any port.
            kernel = AsyncKernelManager(transport="ipc", ip=f"{pipes}/kernel")
            where = {"metadata": {"path": empty}}
            client = nbclient.NotebookClient(notebook, kernel, timeout=_SECONDS, resources=where)
            client.execute(cleanup_kc=True)
        sys.stdout.write(f"{path.stem}: {perf_counter() - begin:.1f} s in a fresh kernel\n")
        sys.stdout.flush()
    sys.stdout.write(f"{len(chosen)} passed, 0 failed\n")


if __name__ == "__main__":
    main(sys.argv[1:])
