"""One palette and one type for all pictures: told apart by colour-blind readers, and on paper.

Colours are those of M. Okabe and K. Ito, "Color Universal Design", 2008. Shapes or words always
say the same again, so that no figure needs colour to be read.
"""

from typing import Any

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

FONTS = ("DejaVu Sans",)
"""Of printed figures; comes with matplotlib."""


def print_settings() -> dict[Any, Any]:
    """Return matplotlib's settings of a printed figure; the same figure has the same bytes."""
    return {
        "font.family": list(FONTS),
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
