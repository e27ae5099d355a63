"""The legend of variants over a printed chart."""

from collections.abc import Sequence

from matplotlib.figure import Figure

from elastocal.report.box_panel import legend_handles
from elastocal.report.looks import Look

ROW = 0.22
"""Height of a row, in inches."""
_CHARACTER, _SWATCH = 0.075, 0.55
"""Width of a letter, and of what stands before a name, in inches."""


def legend_height(looks: Sequence[Look], across: float) -> float:
    """Return the height of a legend of some width, both in inches."""
    return ROW * -(-len(looks) // _columns(looks, across))


def draw_legend(
    figure: Figure, looks: Sequence[Look], left: float, top: float, across: float
) -> None:
    """Draw the legend.

    Parameters
    ----------
    figure : Figure
        Where to.
    looks : sequence of Look
        Of the variants.
    left, top : float
        Its corner, from the left and the upper edge of the figure, in inches.
    across : float
        Its width, in inches.
    """
    width, height = figure.get_size_inches()
    figure.legend(
        handles=legend_handles(looks), loc="upper left", ncols=_columns(looks, across),
        frameon=False,
        bbox_to_anchor=(left / width, 1.0 - top / height), borderpad=0.0, borderaxespad=0.0,
        handlelength=1.4, columnspacing=1.6, fontsize=9.0,
    )  # fmt: skip


def _columns(looks: Sequence[Look], across: float) -> int:
    longest = max(len(look.name) for look in looks)
    return max(1, min(len(looks), int(across / (_CHARACTER * longest + _SWATCH))))
