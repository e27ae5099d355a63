"""One palette and one type for all pictures: told apart by colour-blind readers, and on paper.

Colours are those of M. Okabe and K. Ito, "Color Universal Design", 2008. Shapes or words always
say the same again, so that no figure needs colour to be read.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from elastocal.arrays import FloatArray, IndexArray

INK = "#1b1b1b"
MUTED = "#595959"
FAINT = "#b5b5b5"
PAPER = "#ffffff"
BLUE = "#0072b2"
SKY = "#56b4e9"
GREEN = "#009e73"
VERMILLION = "#d55e00"
ORANGE = "#e69f00"
PURPLE = "#cc79a7"
YELLOW = "#f0e442"
CHOSEN = (BLUE, VERMILLION)
"""Chosen poses of the plan's technique, and of the one that it is compared with."""
ARM = ORANGE
TOOL = "#4d4d4d"
TOOLING = "#c3ccd6"
FIXTURE = "#eeeae2"
SIGHT = GREEN
TOUR = PURPLE
REFUSED = "#8c8c8c"
SEQUENTIAL = "cividis"
"""Colour map of quantities; its order survives colour blindness and grey printing."""
_FONTS = ("DejaVu Sans",)
"""Of printed figures; comes with matplotlib."""
COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY)
_MARKERS = "os^Dv"
"""Of medians in print; one less than colours, so that both together repeat late."""
_SCREEN = {"o": "circle", "s": "square", "^": "triangle-up", "D": "diamond", "v": "triangle-down"}
_FILL = 0.35
"""Part of the colour in a box; the rest is paper."""


@dataclass(frozen=True)
class VariantStyle:
    """How one variant of several is drawn."""

    name: str
    colour: str
    fill: str
    """Of its boxes; the second time that a colour is used, paper."""
    marker: str
    place: float
    """Middle of its boxes from the middle of their group, in numbers of training poses."""
    width: float
    """Of its boxes, likewise."""

    @property
    def symbol(self) -> str:
        """Return the marker's name on screen."""
        return _SCREEN[self.marker]

    def at(self, n: IndexArray) -> FloatArray:
        """Return where its boxes stand, shape (box,)."""
        return np.asarray(n + self.place, dtype=float)


def print_settings() -> dict[Any, Any]:
    """Return matplotlib's settings of a printed figure; the same figure has the same bytes."""
    return {
        "font.family": list(_FONTS),
        "font.size": 9.0,
        "text.color": INK,
        "axes.edgecolor": MUTED,
        "axes.labelcolor": INK,
        "xtick.color": INK,
        "ytick.color": INK,
        "figure.facecolor": PAPER,
        "savefig.facecolor": PAPER,
        "svg.hashsalt": "elastocal",
        "pdf.fonttype": 42,
    }


def variant_styles(names: Sequence[str]) -> tuple[VariantStyle, ...]:
    """Return the styles of variants, in their order from left to right."""
    step = 0.82 / len(names)
    return tuple(
        VariantStyle(
            name=name,
            colour=COLOURS[k % len(COLOURS)],
            fill=tint(COLOURS[k % len(COLOURS)]) if k < len(COLOURS) else PAPER,
            marker=_MARKERS[k % len(_MARKERS)],
            place=(k + 0.5) * step - 0.41,
            width=0.8 * step,
        )
        for k, name in enumerate(names)
    )


def tint(colour: str, part: float = _FILL) -> str:
    """Return a colour on paper.

    >>> tint("#0072b2", 0.5)
    '#80b8d8'

    Parameters
    ----------
    colour : str
        ``#rrggbb``.
    part : float
        How much of it is left, from 0 to 1.
    """
    channels = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return "#" + "".join(f"{round(255 + part * (channel - 255)):02x}" for channel in channels)
