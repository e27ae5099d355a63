"""Printed figures as part of the page: same figure, same bytes."""

import base64
from collections.abc import Callable
from html import escape

from matplotlib.figure import Figure

from elastocal.report.document.markup import html
from elastocal.report.plots import figure_bytes

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
    data = base64.b64encode(figure_bytes(draw, kind, _DPI)).decode("ascii")
    return (
        '<figure><div class="pan" tabindex="0" role="group" aria-label="Figure">'
        f'<img src="data:{_TYPES[kind]};base64,{data}" alt="{escape(alt, quote=True)}"></div>'
        f"<figcaption>{html(caption)}</figcaption></figure>"
    )
