"""One panel of the printed figure: a surface, its candidates and what one technique chose."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from scipy.spatial import cKDTree

from elastocal.arrays import FloatArray
from elastocal.planning import PoolData, SpreadRecord
from elastocal.planning.surface import Surface
from elastocal.report import style
from elastocal.report.flat_map import FlatMap
from elastocal.report.labels import spread
from elastocal.report.text import readable

WIDTH = 5.1
"""Of a panel, in inches."""
_DISC, _CROWD = 13.0, 200.0
"""Diameter of a numbered disc in points; with many it shrinks to the second over their root."""
_MANY = 20_000
"""With more candidates than this their dots are stored as an image."""
_FINE = 5_000
"""With more faces or border lines than this the surface is stored as an image."""
_NAME: dict[str, Any] = {"color": style.MUTED}
_VALUE: dict[str, Any] = {"ha": "right", "weight": "bold"}


@dataclass(frozen=True, eq=False)
class Choice:
    """One panel: what a technique chose."""

    title: str
    colour: str
    marker: str
    order: list[int]
    """Candidates in search order."""
    spread: SpreadRecord
    metric: str
    """Of the covering radius: ``euclidean`` or ``geodesic``."""

    def distance(self, pool: PoolData) -> FloatArray:
        """Return how far each candidate is from the nearest chosen one, straight, in m."""
        return np.asarray(cKDTree(pool.contact[self.order]).query(pool.contact)[0])


def draw_panel(
    axes: Axes, surface: Surface, flat: FlatMap, pool: PoolData, choice: Choice, farthest: float
) -> Any:
    """Draw a panel; return the dots, for a colour bar.

    Parameters
    ----------
    axes : Axes
        As wide as `WIDTH`, its limits set.
    surface, flat, pool : Surface, FlatMap, PoolData
        What was chosen from.
    choice : Choice
        What was chosen.
    farthest : float
        Distance at the dark end of the colours, in m.
    """
    axes.set_axis_off()
    axes.set_title(choice.title, fontsize=11, fontweight="bold", color=choice.colour, pad=2)
    _draw_surface(axes, surface, flat)
    dots = _draw_candidates(axes, flat, pool, choice, farthest)
    _draw_chosen(axes, flat, pool, choice)
    _draw_scale(axes)
    _draw_numbers(axes, choice)
    return dots


def _draw_surface(axes: Axes, surface: Surface, flat: FlatMap) -> None:
    face, corner = np.divmod(surface.border_half_edges, 3)
    for sheet in flat.sheets:
        triangles = surface.mesh.vertices[surface.mesh.faces[sheet.faces]]
        lit = surface.face_normals[sheet.faces] @ sheet.towards_viewer
        grey = 0.86 + 0.1 * lit.clip(0.0, 1.0)
        colours = np.repeat(grey[:, None], 3, axis=1)
        axes.add_collection(
            PolyCollection(
                list(sheet.flat(triangles)),
                facecolors=colours,
                edgecolors=colours,
                lw=0.3,
                rasterized=len(triangles) > _FINE,
            )
        )
        shown = np.isin(face, sheet.faces)
        ends = [surface.mesh.faces[face[shown], (corner[shown] + step) % 3] for step in (0, 1)]
        border = sheet.flat(surface.mesh.vertices[np.stack(ends, axis=1)])
        axes.add_collection(
            LineCollection(list(border), colors=style.MUTED, lw=0.8, rasterized=len(border) > _FINE)
        )


def _draw_candidates(
    axes: Axes, flat: FlatMap, pool: PoolData, choice: Choice, farthest: float
) -> Any:
    distance = choice.distance(pool)
    # The farthest come last, so that no gap hides under near ones.
    order = np.argsort(distance)
    x, y = flat.positions(pool.contact)[order].T
    return axes.scatter(
        x, y, s=_dot_size(len(pool.contact)), c=1e3 * distance[order], cmap=f"{style.SEQUENTIAL}_r",
        vmin=0.0, vmax=1e3 * farthest, linewidths=0, rasterized=len(order) > _MANY,
    )  # fmt: skip


def _dot_size(count: int) -> float:
    return float(np.clip(12_000.0 / count, 0.5, 12.0))


def _draw_chosen(axes: Axes, flat: FlatMap, pool: PoolData, choice: Choice) -> None:
    """Draw numbered discs; where they crowd, they move aside and point to their place."""
    anchor = flat.positions(pool.contact)[choice.order]
    left, right = axes.get_xlim()
    points = min(_DISC, _CROWD / np.sqrt(len(anchor)))
    disc = points * (right - left) / (72.0 * WIDTH)
    place = spread(anchor, 1.08 * disc)
    moved = np.linalg.norm(place - anchor, axis=1) > 0.1 * disc
    pairs = np.stack([anchor, place], axis=1)[moved]
    axes.add_collection(LineCollection(list(pairs), colors=choice.colour, lw=0.8, zorder=3))
    axes.scatter(anchor[moved, 0], anchor[moved, 1], s=9, c=choice.colour, linewidths=0, zorder=3)
    axes.scatter(
        place[:, 0], place[:, 1], s=points**2, c=style.PAPER, edgecolors=choice.colour,
        linewidths=1.3, marker=choice.marker, zorder=4,
    )  # fmt: skip
    for number, (x, y) in enumerate(place, start=1):
        axes.text(
            x, y, str(number), ha="center", va="center_baseline", fontsize=0.5 * points, zorder=5,
        )  # fmt: skip


def _draw_scale(axes: Axes) -> None:
    """Draw a bar of a round length in the lower left corner."""
    (left, right), (low, _) = axes.get_xlim(), axes.get_ylim()
    width = right - left
    round_lengths = np.outer(10.0 ** np.arange(-3, 4), (1.0, 2.0, 5.0)).ravel()
    length = float(round_lengths[round_lengths <= max(0.25 * width, 1e-3)].max())
    start, up = left + 0.03 * width, low + 0.012 * width
    axes.plot([start, start + length], [up, up], color=style.INK, lw=1.6, solid_capstyle="butt")
    axes.text(
        start + 0.5 * length, up + 0.008 * width, readable(length, "m"), ha="center", va="bottom",
        fontsize=7.5,
    )  # fmt: skip


def _draw_numbers(axes: Axes, choice: Choice) -> None:
    """Write the figures that show clustering under the panel."""
    numbers = choice.spread
    lines = [
        (f"Covering radius ({choice.metric})", readable(numbers.covering_radius, "m")),
        ("Mean distance from the edge", _length(numbers.boundary_distance)),
        ("Mean distance to the nearest other pose", _length(numbers.nearest_neighbour)),
        ("Observability index O1 (no unit)", f"{numbers.o1:.3g}"),
    ]
    for row, (name, value) in enumerate(lines):
        for x, text, look in ((0.08, name, _NAME), (0.92, value, _VALUE)):
            axes.annotate(
                text, (x, 0.0), (0, -8 - 14 * row), "axes fraction", "offset points",
                va="top", **look,
            )  # fmt: skip


def _length(value: float | None) -> str:
    return "none" if value is None else readable(value, "m")
