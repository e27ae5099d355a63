"""Figures as files: the same figure has the same bytes, and says in words what it shows."""

import io
import textwrap
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from elastocal.errors import FileAccessError
from elastocal.files import replacing
from elastocal.report.plots import style

SUFFIXES = (".pdf", ".png", ".svg")
_DPI = 200
_UNDATED: dict[str, dict[str, Any]] = {
    ".svg": {"Date": None, "Creator": "elastocal"},
    ".pdf": {"CreationDate": None, "Creator": "elastocal"},
    ".png": {"Software": "elastocal"},
}
"""No date, or the bytes of a figure would change."""


def write_figure(
    path: Path, draw: Callable[[], Figure], title: str = "", description: str = ""
) -> Path:
    """Write a figure, atomically; return its path. See `write_kinds`."""
    return write_kinds([path], draw, title, description)[0]


def write_kinds(
    paths: Sequence[Path], draw: Callable[[], Figure], title: str = "", description: str = ""
) -> list[Path]:
    """Write one figure in several kinds, each atomically; return their paths.

    Parameters
    ----------
    paths : sequence of Path
        The suffix decides the kind: SVG, PNG or PDF.
    draw : callable
        Returns the figure; called once, with the settings of print.
    title, description : str, optional
        What it is and shows, for readers that cannot see it; kept in the file.

    Raises
    ------
    FileAccessError
        If a suffix is another or a file cannot be written.
    """
    paths = [Path(path) for path in paths]
    for path in paths:
        if path.suffix.lower() not in SUFFIXES:
            raise FileAccessError(
                f"figure {path}: suffix {path.suffix!r} is not one of {', '.join(SUFFIXES)}"
            )
    with matplotlib.rc_context(style.print_settings()), ExitStack() as files:
        temporary = [files.enter_context(replacing(path)) for path in paths]
        figure = draw()
        for path, place in zip(paths, temporary, strict=True):
            suffix = path.suffix.lower()
            notes = _metadata(suffix, title, description)
            figure.savefig(place, format=suffix[1:], dpi=_DPI, metadata=notes)
    return paths


def figure_bytes(draw: Callable[[], Figure], suffix: str, dpi: int) -> bytes:
    """Return a figure as the bytes of a file; the same figure has the same bytes.

    Parameters
    ----------
    draw : callable
        Returns the figure; called with the settings of print.
    suffix : str
        ``.svg``, ``.png`` or ``.pdf``.
    dpi : int
        Resolution of what is stored as an image.
    """
    buffer = io.BytesIO()
    with matplotlib.rc_context(style.print_settings()):
        draw().savefig(buffer, format=suffix[1:], dpi=dpi, metadata=_metadata(suffix))
    return buffer.getvalue()


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of a size in inches, without a window."""
    figure = Figure((width, height))
    FigureCanvasAgg(figure)
    return figure


def literal(text: str) -> str:
    r"""Return a text whose dollar signs begin no formula.

    >>> literal("a$b")
    'a\\$b'
    """
    return text.replace("$", r"\$")


def _metadata(suffix: str, title: str = "", description: str = "") -> dict[str, Any]:
    """Return what the file says about itself; what is empty is left out."""
    found = {"Title": title, "Subject" if suffix == ".pdf" else "Description": description}
    return _UNDATED[suffix] | {key: text for key, text in found.items() if text}


def wrapped(text: str, width: int) -> list[str]:
    """Return a text in lines of at most ``width`` characters.

    >>> wrapped("one two three", 8)
    ['one two', 'three']
    """
    return textwrap.wrap(text, width, break_long_words=True, break_on_hyphens=False)
