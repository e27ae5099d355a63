"""One printable figure of a plan, after the paper's Fig. 3: two search techniques side by side.

Colour tells how far each candidate is from its nearest chosen pose; the numbers under a panel
tell the same in short. Clustering at the edges shows as dark areas, a large covering radius, a
small distance from the edge and a small distance between neighbours.
"""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from elastocal.arrays import FloatArray
from elastocal.planning import PlanResult, PoolData, check_pool_of
from elastocal.planning.surface import Surface
from elastocal.report import style
from elastocal.report.flat_map import FlatMap, flat_map
from elastocal.report.panel import WIDTH, Choice, draw_panel
from elastocal.report.printed import new_figure, write_figure

_HEAD, _FOOT, _SIDE = 0.7, 1.95, 0.25
"""Room above, below and beside the panels, in inches."""
_FLATTEST, _TALLEST = 0.25, 1.3
"""Height of a panel as part of its width; a longer surface has room beside it."""


def write_plan_figure(path: Path, surface: Surface, plan: PlanResult, pool: PoolData) -> Path:
    """Write the figure of a plan, atomically; return its path.

    Parameters
    ----------
    path : Path
        Its suffix decides the kind: SVG, PNG or PDF.
    surface : Surface
        That the plan was made for.
    plan, pool : PlanResult, PoolData
        Of one run. Without a comparison in the plan there is one panel.

    Raises
    ------
    SchemaError
        If plan and pool are not of one run.
    FileAccessError
        If the suffix is another or the file cannot be written.
    """
    check_pool_of(plan, pool)
    return write_figure(path, lambda: plan_figure(surface, plan, pool))


def plan_figure(surface: Surface, plan: PlanResult, pool: PoolData) -> Figure:
    """Return the figure; see `write_plan_figure`."""
    flat = flat_map(surface, pool.contact, pool.normal)
    choices = _choices(plan)
    low, high = _extent(surface, flat)
    height = WIDTH * float((high - low)[1] / (high - low)[0])
    size = (len(choices) * (WIDTH + _SIDE) + _SIDE, _HEAD + height + _FOOT)
    figure = new_figure(*size)
    farthest = max(float(choice.distance(pool).max()) for choice in choices)
    dots = None
    for number, choice in enumerate(choices):
        left = _SIDE + number * (WIDTH + _SIDE)
        box = (left / size[0], _FOOT / size[1], WIDTH / size[0], height / size[1])
        axes = figure.add_axes(box, xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        dots = draw_panel(axes, surface, flat, pool, choice, farthest)
    _draw_frame(figure, plan, flat, dots)
    return figure


def _choices(plan: PlanResult) -> list[Choice]:
    """Return what the plan's technique chose, and the one that it is compared with."""
    candidate = {pose.id: pose.candidate for pose in plan.poses}
    search, other = plan.search, plan.comparison
    found = [(search.name, "this plan", [candidate[i] for i in search.order], search.spread)]
    if other is not None:
        found.append((other.name, "for comparison", list(other.candidates), other.spread))
    return [
        Choice(f"{name.upper()} ({role})", colour, marker, order, numbers, search.metric)
        for (name, role, order, numbers), colour, marker in zip(
            found, style.CHOSEN, "os", strict=False
        )
    ]


def _extent(surface: Surface, flat: FlatMap) -> tuple[FloatArray, FloatArray]:
    """Return the corners of the map with some room about it, each of shape (2,), in m."""
    points = np.concatenate(
        [
            sheet.flat(surface.mesh.vertices[surface.mesh.faces[sheet.faces]]).reshape(-1, 2)
            for sheet in flat.sheets
        ]
    )
    low, high = points.min(axis=0), points.max(axis=0)
    size = 1.08 * (high - low)
    size = np.maximum(size, (size[1] / _TALLEST, _FLATTEST * size[0]))
    middle = 0.5 * (low + high)
    return middle - 0.5 * size, middle + 0.5 * size


def _draw_frame(figure: Figure, plan: PlanResult, flat: FlatMap, dots: Any) -> None:
    """Draw what belongs to all panels: title, colour bar, how to read it."""
    width, height = figure.get_size_inches()
    sizes = f"{len(plan.poses)} of {plan.pool.valid} candidate poses"
    figure.text(
        0.5, 1.0 - 0.12 / height, f"{plan.cell.name}: {sizes}".replace("$", r"\$"),
        ha="center", va="top", fontsize=12,
    )  # fmt: skip
    bar = figure.add_axes((0.5 - 1.7 / width, 0.72 / height, 3.4 / width, 0.11 / height))
    figure.colorbar(dots, cax=bar, orientation="horizontal")
    bar.set_title(
        "Straight distance of each candidate from its nearest chosen pose in mm", fontsize=8, pad=3
    )
    bar.tick_params(labelsize=8, length=2)
    figure.text(
        0.5, 0.1 / height,
        f"Surface {flat.kind}.\n"
        "Poses are numbered in the order in which they were chosen.",
        ha="center", va="bottom", fontsize=8, color=style.MUTED,
    )  # fmt: skip
