"""Printed figures as part of the page: same figure, same bytes."""

import base64
import io
from collections.abc import Callable
from html import escape

import matplotlib
from matplotlib.figure import Figure

from elastocal.report import style
from elastocal.report.document.markup import html
from elastocal.report.printed import notes

_DPI = 130
"""Of figures with thousands of points, which would be large as SVG."""
_TYPES = {".svg": "image/svg+xml", ".png": "image/png"}


def picture(draw: Callable[[], Figure], alt: str, caption: object, kind: str = ".svg") -> str:
    """Return a figure with its caption as HTML.

    Parameters
    ----------
    draw : callable
        Returns the figure; called with the settings of print.
    alt : str
        What it shows, for readers that cannot see it.
    caption : object
        For all readers.
    kind : str
        ``.svg``, or ``.png`` for figures with many points.
    """
    data = base64.b64encode(_bytes(draw, kind)).decode("ascii")
    return (
        '<figure><div class="pan" tabindex="0" role="group" aria-label="Figure">'
        f'<img src="data:{_TYPES[kind]};base64,{data}" alt="{escape(alt, quote=True)}"></div>'
        f"<figcaption>{html(caption)}</figcaption></figure>"
    )


def _bytes(draw: Callable[[], Figure], kind: str) -> bytes:
    buffer = io.BytesIO()
    with matplotlib.rc_context(style.print_settings()):
        draw().savefig(buffer, format=kind[1:], dpi=_DPI, metadata=notes(kind))
    return buffer.getvalue()
