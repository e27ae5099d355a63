"""How variants are told apart: by colour, by marker, and by their place in a group."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.report import style

COLOURS = (style.BLUE, style.VERMILLION, style.GREEN, style.PURPLE, style.ORANGE, style.SKY)
MARKERS = "os^Dv"
"""Of medians in print; one less than colours, so that both together repeat late."""
_SCREEN = {"o": "circle", "s": "square", "^": "triangle-up", "D": "diamond", "v": "triangle-down"}
_FILL = 0.35
"""Part of the colour in a box; the rest is paper."""


@dataclass(frozen=True)
class Look:
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


def looks_of(names: Sequence[str]) -> tuple[Look, ...]:
    """Return the looks of variants, in their order from left to right."""
    step = 0.82 / len(names)
    return tuple(
        Look(
            name=name,
            colour=COLOURS[k % len(COLOURS)],
            fill=tint(COLOURS[k % len(COLOURS)]) if k < len(COLOURS) else style.PAPER,
            marker=MARKERS[k % len(MARKERS)],
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
